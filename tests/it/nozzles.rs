//! A controller that opens a nozzle where the scanner sees something, over CAN: the scanner then sees the spray.

use crate::common::small_scene;

use rowscan_bus::pgn::sprayer::NOZZLE_DUTY;
use rowscan_bus::tractor::TractorEcu;
use rowscan_bus::{CanFrame, pgn};
use rowscan_emulator::offline::Offline;
use rowscan_emulator::stage::Stage;
use rowscan_protocol::client::ColaConfig;
use rowscan_protocol::model;
use rowscan_protocol::scan::Scan;
use rowscan_protocol::time::SimTime;
use rowscan_scenes::Scene;
use rowscan_scenes::optics::Plume;

/// A tree, a gap as long as three trees, and a nozzle that only a controller opens.
fn gap(flow_l_min: f64) -> Scene {
    let mut scene = small_scene();
    scene.orchard.trees = Some(4);
    scene.orchard.missing = vec![1, 2, 3].into();
    scene.optics.stages = "echoes,energy,air".parse().expect("stages");
    scene.optics.air.plumes = vec![Plume { flow_l_min, shut: true, ..Plume::default() }];
    scene
}

/// What the controller did after each scan: whether it opened the nozzle, for anything within 2.2 m in the upper half.
fn loop_of(scene: Scene) -> Vec<bool> {
    let stage = Stage::grow(scene, &|_, _| {}).expect("it grows");
    let tractor = stage.tractor();
    let (device, view) =
        stage.scanner_on(&tractor, 0, model::by_name("lms111").expect("known")).expect("it fits");
    let scans = stage.scans_per_row(&device);
    let mut ecu = TractorEcu::new(tractor, stage.receiver());
    let mut out = Vec::new();
    ecu.open(SimTime::ZERO, &mut out);
    // The address is its own after a quarter of a second.
    ecu.poll(SimTime(300_000_000), &mut out);
    let mut offline = Offline::new(device, view);
    offline.set_up(ColaConfig::default()).expect("taken");
    let (mut scan, mut opened) = (Scan::default(), Vec::new());
    for number in 1..=scans {
        assert!(offline.scan_into(&mut scan).expect("a scan"));
        let near = scan.echoes[0].range_m.iter().skip(250).take(120).any(|range_m| *range_m < 2.2);
        let duty = if near { 100.0 } else { 0.0 };
        let data = NOZZLE_DUTY.encode(&[Some(0.0), Some(duty)]);
        let frame = CanFrame::new(NOZZLE_DUTY.id(0x28).id(), data.bytes()).expect("a frame");
        // The scan is 20 ms after the one before; the frame follows it by one.
        ecu.handle(SimTime(number * 20_000_000 + 1_000_000), &frame, &mut out);
        opened.push(near);
    }
    opened
}

#[test]
fn a_controller_that_opens_for_all_it_sees_is_blinded_by_its_own_spray() {
    let (dry, wet) = (loop_of(gap(0.0)), loop_of(gap(1.0)));
    // 1.5 m a tree at 1 m/s: the gap's middle after 3.7 s.
    let middle = 175..200;
    assert!(dry[10..50].iter().any(|open| *open), "it opens at the tree");
    assert!(dry[middle.clone()].iter().all(|open| !open), "nothing stands in the gap");
    assert!(wet[middle].iter().all(|open| *open), "it sees its own spray, and never shuts again");
    assert_eq!(wet, loop_of(gap(1.0)));
}

#[test]
fn a_message_that_others_hear_is_in_the_table() {
    assert!(pgn::MESSAGES.iter().any(|message| message.pgn == NOZZLE_DUTY.pgn));
}
