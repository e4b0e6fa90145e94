//! Everything on the tractor tells the same drive: encoder, GNSS and CAN beside the scans.
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::unwrap_used,
    clippy::print_stderr,
    reason = "a test fails by panicking and says what it skips"
)]

use crate::common;

use common::small_scene;
use rowscan_bus::nmea::GnssEpochs;
use rowscan_bus::tractor::TractorEcu;
use rowscan_bus::{CanFrame, J1939Id, dbc, link::candump::write_line, markdown, pgn};
use rowscan_canopy::{AdvanceSource, Estimate, Pipeline};
use rowscan_emulator::offline::Offline;
use rowscan_emulator::stage::Stage;
use rowscan_protocol::device::{DialectPolicy, Session};
use rowscan_protocol::frame::{Dialect, encode};
use rowscan_protocol::model;
use rowscan_protocol::rig::{Mount, Orientation, RowSide};
use rowscan_protocol::scan::{EncoderReading, Scan};
use rowscan_protocol::time::SimTime;
use rowscan_scenes::Scene;
use rowscan_scenes::files::load_scene;
use rowscan_scenes::orchard::ByRow;
use rowscan_vehicle::trajectory::{Drive, StopAndGo};

const MS: u64 = 1_000_000;

fn stage(scene: Scene) -> Stage {
    Stage::grow(scene, &|_, _| {}).expect("it grows")
}

#[test]
fn the_shipped_dbc_is_what_the_table_makes() {
    let shipped = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/rowscan.dbc")).unwrap();
    assert!(shipped == dbc(), "make it again with `rowscan bus dbc > docs/rowscan.dbc`");
    let page = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/can.md")).unwrap();
    assert!(page.contains(&markdown()), "put what `rowscan bus markdown` prints into docs/can.md");
}

/// What the tractor says in six seconds, commanded after three: CAN as a log, GNSS as text.
fn voices() -> (String, String) {
    let stage = stage(small_scene());
    let tractor = stage.tractor();
    let mut ecu = TractorEcu::new(tractor.clone(), stage.receiver());
    let mut nmea = GnssEpochs::new(tractor.clone(), stage.receiver());
    let (mut log, mut sentences, mut out) = (String::new(), String::new(), Vec::new());
    ecu.open(SimTime::ZERO, &mut out);
    tractor.begin(SimTime(20 * MS));
    let mut now = SimTime::ZERO;
    while now < SimTime(6_000 * MS) {
        ecu.poll(now, &mut out);
        if now == SimTime(3_000 * MS) {
            let data = [0xDC, 0x05, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFD];
            let command = CanFrame::new(pgn::tractor::SPEED_COMMAND.id(0x28).id(), &data).unwrap();
            ecu.handle(now, &command, &mut out);
        }
        for frame in out.drain(..) {
            write_line(&mut log, now, &frame);
        }
        while nmea.next() <= now {
            sentences.push_str(&nmea.next_epoch());
        }
        now = SimTime(now.0 + 10 * MS);
    }
    (log, sentences)
}

#[test]
fn two_runs_say_the_same_bytes_at_the_same_instants() {
    let (log, sentences) = voices();
    assert_eq!(voices(), (log.clone(), sentences.clone()));
    // Rates by the standard: 100 ms from the first whole step after the claim; the claim itself; the facilities once.
    let count = |pgn: u32| {
        log.lines()
            .filter_map(rowscan_bus::link::candump::read_frame)
            .filter(|(_, frame)| J1939Id::of(frame.id).unwrap().pgn == pgn)
            .count()
    };
    assert_eq!((count(65_096), count(65_097), count(61_474)), (57, 57, 57), "{log}");
    assert_eq!((count(60_928), count(65_033), count(129_029)), (1, 1, 5 * 7));
    assert_eq!(sentences.matches("$GNGGA").count(), 60);
    // Half a metre a second squared from 1 to 1.5 m/s: there at four seconds.
    let (at, last) = log
        .lines()
        .filter_map(rowscan_bus::link::candump::read_frame)
        .rfind(|(_, frame)| J1939Id::of(frame.id).unwrap().pgn == 65_097)
        .unwrap();
    let told = pgn::tractor::GROUND_SPEED.decode(last.data());
    let way_m = 2.98 + 1.25 + 1.5 * (at.as_secs_f64() - 4.0);
    assert_eq!(told[0], Some(1.5));
    assert!((told[1].unwrap() - way_m).abs() < 0.001, "{told:?} {way_m}");
}

/// One pass of the row, estimated with the encoder or without.
fn pass(scene: Scene, encoder: bool) -> Estimate {
    let stage = stage(scene);
    let (device, world) = stage.scanner(0, model::by_name("lms111").unwrap()).unwrap();
    let scans = stage.scans_per_row(&device);
    let mut rig = stage.rig.clone();
    let ticks_per_m = rig.encoder_ticks_per_m.unwrap();
    if !encoder {
        rig.encoder_ticks_per_m = None;
    }
    // What the driver believes, not what is driven.
    rig.speed_m_s = 1.0;
    let tractor = world.tractor().clone();
    let mut pipeline = Pipeline::new(Some(&rig), 0, None).unwrap();
    let (mut offline, mut scan) = (Offline::new(device, world), Scan::default());
    for turn in 1..=scans {
        assert!(offline.scan_into(&mut scan).unwrap());
        let wheel_m = tractor.motion(SimTime(turn * 20 * MS)).wheel_m;
        scan.encoders.clear();
        scan.encoders
            .push(EncoderReading { position_ticks: (wheel_m * ticks_per_m) as i64 as u32, speed: 0 });
        pipeline.push(&scan);
    }
    pipeline.finish()
}

fn driven(speed_m_s: f64, drive: Drive) -> Scene {
    let mut scene = small_scene();
    scene.rig.speed_m_s = speed_m_s;
    Scene { drive, ..scene }
}

#[test]
fn with_an_encoder_impacted_area_does_not_depend_on_how_fast_it_is_driven() {
    let stop_and_go = StopAndGo { go_s: 1.0, stop_s: 2.0, ramp_s: 0.5 };
    let stop_and_go = || Drive { stop_and_go: Some(stop_and_go), ..Drive::default() };
    // The whole built-in row: on a few small trees lines half as far apart find another percent by chance alone.
    let driven = |speed_m_s, drive| {
        let mut scene = load_scene("spindle", |_| {}).unwrap();
        scene.rig.speed_m_s = speed_m_s;
        Scene { drive, ..scene }
    };
    let reference = pass(driven(1.0, Drive::default()), true);
    assert_eq!(reference.advance_source, Some(AdvanceSource::Encoder));
    let reference_m2 = reference.impacted_total_area_m2.unwrap();
    for (name, speed_m_s, drive) in [
        ("half", 0.5, Drive::default()),
        ("double", 2.0, Drive::default()),
        ("stop and go", 1.0, stop_and_go()),
    ] {
        let with = pass(driven(speed_m_s, drive.clone()), true).impacted_total_area_m2.unwrap();
        let off = (with - reference_m2) / reference_m2;
        assert!(off.abs() < 0.01, "{name}: {off:+.4} with the encoder");
        let without = pass(driven(speed_m_s, drive), false).impacted_total_area_m2.unwrap();
        let without = (without - reference_m2) / reference_m2;
        eprintln!("{name}: {:+.2} % with the encoder, {:+.1} % without", off * 100.0, without * 100.0);
        assert!(without.abs() > 0.2, "{name}: {without:+.3} without it");
    }
}

/// A pass with the scanner's own encoder of 500 ticks a metre, set up by a client that says `ticks_per_mm`: ticks in the second second, and
/// the estimate of a rig that knows the wheel.
fn pass_by_ticks(ticks_per_mm: f32) -> (u32, Estimate) {
    let mut scene = small_scene();
    scene.encoder.ticks_per_m = 500.0;
    let stage = stage(scene);
    let (mut device, world) = stage.scanner(0, model::by_name("lms111").unwrap()).unwrap();
    let scans = stage.scans_per_row(&device);
    let (mut session, mut replies) = (Session::new(DialectPolicy::Auto), Vec::new());
    for request in [
        "sMN SetAccessMode 3 F4724744",
        "sWN LICsrc 1",
        "sWN LICencset 1",
        &format!("sWN LICencres {:08X}", ticks_per_mm.to_bits()),
        "sWN LMDscandatacfg 01 00 0 0 0 01 00 0 0 0 0 +1",
        "sMN Run",
    ] {
        let mut frame = Vec::new();
        encode(Dialect::A, request.as_bytes(), &mut frame);
        session.handle_bytes(&mut device, SimTime::ZERO, &frame, &mut replies);
    }
    assert!(replies.iter().all(|reply| !reply.bytes.starts_with(b"\x02sFA")), "{replies:?}");
    let mut pipeline = Pipeline::new(Some(&stage.rig), 0, None).unwrap();
    let (mut offline, mut scan) = (Offline::new(device, world), Scan::default());
    let mut positions = Vec::new();
    for _ in 1..=scans {
        assert!(offline.scan_into(&mut scan).unwrap());
        positions.push(scan.encoders[0].position_ticks);
        pipeline.push(&scan);
    }
    (positions[100] - positions[50], pipeline.finish())
}

#[test]
fn the_wheel_gives_its_ticks_whatever_resolution_a_client_sets() {
    let (ticks, right) = pass_by_ticks(0.5);
    assert_eq!((ticks, right.advance_source), (500, Some(AdvanceSource::Encoder)));
    let by_speed = pass(small_scene(), false).impacted_total_area_m2.unwrap();
    let by_ticks = right.impacted_total_area_m2.unwrap();
    assert!(((by_ticks - by_speed) / by_speed).abs() < 0.01, "{by_ticks} {by_speed}");
    for ticks_per_mm in [1.0, 2.0] {
        let (ticks, estimate) = pass_by_ticks(ticks_per_mm);
        assert_eq!(ticks, 500, "LICencres {ticks_per_mm}");
        assert_eq!(estimate.impacted_total_area_m2, right.impacted_total_area_m2);
    }
}

#[test]
fn a_tree_driven_over_twice_is_one_tree() {
    let leg = |seconds, speed_m_s| rowscan_vehicle::trajectory::Leg { seconds, speed_m_s, slip: None };
    let there_and_back = vec![leg(0.0, 1.0), leg(2.5, 1.0), leg(0.0, -1.0), leg(1.5, -1.0), leg(0.0, 1.0)];
    let once = pass(driven(1.0, Drive::default()), true);
    let twice = pass(driven(1.0, Drive { legs: there_and_back, ..Drive::default() }), true);
    let (once_m2, twice_m2) = (once.impacted_total_area_m2.unwrap(), twice.impacted_total_area_m2.unwrap());
    assert!(((twice_m2 - once_m2) / once_m2).abs() < 0.01, "{once_m2} {twice_m2}");
    assert_eq!(once.trees.len(), twice.trees.len());
}

/// Two rows, the tractor between them; what each mount makes of its row.
fn between_two_rows(mounts: [Mount; 2], missing: ByRow) -> [Estimate; 2] {
    let mut scene = small_scene();
    (scene.orchard.rows, scene.orchard.missing) = (Some(2), missing);
    scene.drive.alley = Some(1);
    scene.rig.scanners = mounts.to_vec();
    let stage = stage(scene);
    let tractor = stage.tractor();
    let scanner = |index: usize| {
        let (device, world) = stage.scanner_on(&tractor, index, model::by_name("lms111").unwrap()).unwrap();
        let scans = stage.scans_per_row(&device);
        let pipeline = Pipeline::new(Some(&stage.rig), index, None).unwrap();
        (Offline::new(device, world), pipeline, scans)
    };
    let mut pair = [scanner(0), scanner(1)];
    let mut scan = Scan::default();
    for _ in 0..pair[0].2 {
        for (offline, pipeline, _) in &mut pair {
            assert!(offline.scan_into(&mut scan).unwrap());
            pipeline.push(&scan);
        }
    }
    pair.map(|(_, mut pipeline, _)| pipeline.finish())
}

#[test]
fn left_and_right_scanners_see_their_own_rows_and_an_upright_one_sees_both() {
    let mount = |orientation, row| Mount { orientation, row, distance_m: 2.0, ..Mount::default() };
    let area = |estimate: &Estimate| estimate.impacted_total_area_m2.unwrap();
    let both = |orientation| {
        let mounts = [RowSide::Right, RowSide::Left].map(|row| mount(orientation, row));
        between_two_rows(mounts, ByRow::default())
    };
    let (side, up) = (both(Orientation::Side), both(Orientation::Up));
    let rows = [area(&side[0]), area(&side[1])];
    assert!(rows.iter().all(|area_m2| *area_m2 > 0.5), "{rows:?}");
    assert!((rows[0] - rows[1]).abs() > 0.01, "different trees, seen from different sides: {rows:?}");
    for (side, up) in side.iter().zip(&up) {
        // The upright one is blind below 45 degrees down, and that is all the difference.
        let (side_m2, up_m2) = (area(side), area(up));
        assert!(up_m2 < side_m2 * 1.02 && up_m2 > side_m2 * 0.6, "{side_m2} {up_m2}");
    }
}

#[test]
fn the_row_on_the_other_side_of_the_alley_is_no_part_of_an_estimate() {
    let mounts = || {
        let mount = Mount { distance_m: 2.0, ..Mount::default() };
        [Mount { row: RowSide::Right, ..mount.clone() }, Mount { row: RowSide::Left, ..mount }]
    };
    let all: Vec<u32> = (0..small_scene().orchard.layout().trees).collect();
    let [right, left] = between_two_rows(mounts(), ByRow::default());
    let [alone, felled] = between_two_rows(mounts(), ByRow::Each(vec![all, vec![]]));
    assert!(right.impacted_total_area_m2.unwrap() > 0.5);
    assert_eq!(alone.impacted_total_area_m2, right.impacted_total_area_m2);
    assert!(left.impacted_total_area_m2.unwrap() > 0.5);
    assert!(felled.impacted_total_area_m2.unwrap() < 0.1, "{:?}", felled.impacted_total_area_m2);
}
