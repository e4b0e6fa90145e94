//! A multiScan136 in an orchard: the points of every layer are where the leaves are, an estimate over UDP and of its recordings, and fragments.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use rowscan_canopy::Placing;
use rowscan_emulator::stage::Stage;
use rowscan_protocol::compact::CompactListener;
use rowscan_protocol::device::{Device, Mirror};
use rowscan_protocol::host::{HostEvent, HostSession};
use rowscan_protocol::model;
use rowscan_protocol::rig::{Phi, Rig};
use rowscan_protocol::scan::{Scan, is_level};
use rowscan_protocol::time::SimTime;
use rowscan_recording::{Recording, Side};
use rowscan_scenes::Return;
use serde_json::{Value, json};

use crate::common::binary::{Telling, assert_says, run};
use crate::common::captured::pcap;
use crate::common::points::Leaves;
use crate::common::recorded::{estimate, folder};
use crate::common::small_scene;
use crate::picoscan::post;

/// How far a point may be beside its leaf, metres: the facets of a cone, elevations in 1/100°, and beams that advance by chords.
const BESIDE_M: f64 = 0.006;
const TURNS: u32 = 3;

/// A turn as it was cast, and the scans that came of its telegrams.
struct Heard {
    mirrors: Vec<Mirror>,
    returns: Vec<Vec<Return>>,
    scans: Vec<Scan>,
}

/// What goes out over UDP while the tractor drives, where the rig reads phi so.
fn heard(phi: Phi) -> (Stage, Vec<Heard>) {
    let mut scene = small_scene();
    let mut mount = scene.rig.scanners[0].clone();
    mount.phi = phi;
    scene.rig.scanners = vec![mount];
    let stage = Stage::grow(scene, &|_, _| {}).expect("it grows");
    let model = model::by_name("multiscan136").expect("known");
    let (mut device, mut view): (Device, _) = stage.scanner(0, model).expect("it fits");
    device.direct("127.0.0.1:2115".parse().expect("an address"));
    device.enable_streaming();
    view.tractor().begin(SimTime::ZERO);
    let mut listener = CompactListener::default();
    let mut turns = Vec::new();
    for turn in 0..TURNS {
        let at = SimTime::ZERO + Duration::from_millis(50) * turn;
        let mirrors = device.mirrors();
        view.look_at_layers(&mirrors, at);
        device.measure(at, &view.line()).expect("it measures");
        let mut datagrams = Vec::new();
        device.segments(at, &view.lines(), &mut datagrams);
        let mut scans = Vec::new();
        for datagram in datagrams {
            let (_, bytes) = device.send(datagram).expect("it streams");
            listener.handle_datagram(Duration::ZERO, &bytes);
        }
        if turn + 1 == TURNS {
            listener.handle_end();
        }
        while let Some(event) = listener.poll_event() {
            assert_eq!(event, HostEvent::Scan);
            scans.push(listener.scan().clone());
        }
        let returns = (0..mirrors.len()).map(|line| view.returns_of(line).to_vec()).collect();
        turns.push(Heard { mirrors, returns, scans });
    }
    (stage, turns)
}

/// Points by layer: all that were leaves, and those that a rig which reads phi so places on the leaf that the beam met.
fn points_on_leaves(simulated: Phi, read: Phi) -> BTreeMap<i16, (u32, u32)> {
    let (stage, turns) = heard(simulated);
    let mut rig: Rig = stage.rig.clone();
    rig.scanners[0].phi = read;
    let mut placing = Placing::new(Some(rig), 0, Some(0));
    let leaves = Leaves { orchard: &stage.orchard, beside_m: BESIDE_M, periods: 9 };
    let mut found = BTreeMap::<i16, (u32, u32)>::new();
    // The first turns come late: until two were whole nobody knows how many segments a turn has.
    for scan in turns.iter().flat_map(|turn| &turn.scans) {
        let Heard { mirrors, returns, .. } = &turns[usize::from(scan.scan_counter)];
        let line = mirrors.iter().position(|mirror| mirror.layer_centideg == scan.layer_centideg);
        let returns = &returns[line.expect("a layer of the unit")];
        let (all, on) = leaves.points(&mut placing, scan, returns);
        let sum = found.entry(scan.layer_centideg).or_default();
        *sum = (sum.0 + all, sum.1 + on);
    }
    found
}

/// Both readings of the sign: what is simulated by one is found by it, and beside its leaves by the other.
#[test]
fn points_of_every_layer_are_on_the_leaves_that_its_beams_met() {
    for (phi, other) in [(Phi::Up, Phi::Down), (Phi::Down, Phi::Up)] {
        let found = points_on_leaves(phi, phi);
        assert_eq!(found.len(), 16);
        for (layer, (all, on)) in &found {
            assert!(on + all / 25 >= *all, "{phi:?}, layer {layer}: {on} of {all} on their leaves");
        }
        assert!(found.values().map(|(all, _)| all).sum::<u32>() > 2000, "{found:?}");
        // The wrong twin.
        for (layer, (all, on)) in points_on_leaves(phi, other) {
            assert!(
                is_level(layer) || all == 0 || f64::from(on) < 0.5 * f64::from(all),
                "{phi:?}, layer {layer}: {on} of {all}"
            );
        }
    }
}

const SCANS: [&str; 4] = ["--model", "multiscan136", "--scans", "30"];

/// A row over UDP, recorded as the driver reads it; its estimate. Three of the layers are sent: to cast all of them takes a test's binary too long.
fn recorded(scene: &str, file: &str) -> String {
    let args =
        ["--model", "multiscan136", "--rest", "127.0.0.1:0", "--tcp", "127.0.0.1:0", "--time-scale", "0.1"];
    let mut telling = Telling::start("emulate", &[&[scene], &args[..]].concat());
    assert_eq!(telling.next().expect("TCP")["endpoint"], "tcp");
    let rest = telling.address();
    let layers: Vec<bool> = (1..=16).map(|layer| [1, 6, 14].contains(&layer)).collect();
    assert_eq!(
        post(&rest, "LFPlayerFilter", &json!({ "bEnable": true, "aLayers": layers })),
        (200, json!(0))
    );
    estimate(&format!("picoscan://{rest}?udp=0"), scene, &[&SCANS[..], &["--record", file]].concat())
}

/// The device's datagrams in a recording, with their times.
fn datagrams(file: &str) -> Vec<(u64, Vec<u8>)> {
    let mut recording = Recording::open(Path::new(file)).expect("it opens");
    let mut all = Vec::new();
    while let Some(packet) = recording.next_packet().expect("it reads") {
        if packet.from == Some(Side::Device) {
            all.push((packet.at_ns.expect("a time"), packet.bytes));
        }
    }
    all
}

/// UDP in Ethernet packets of 1500 bytes at most.
fn packets(number: u16, bytes: &[u8]) -> Vec<Vec<u8>> {
    let head = [2115_u16, 2115, 8 + bytes.len() as u16, 0].map(u16::to_be_bytes).concat();
    let udp = [&head[..], bytes].concat();
    let count = udp.chunks(1480).len();
    let packet = |(place, piece): (usize, &[u8])| {
        let more = if place + 1 < count { 0x2000 } else { 0 };
        let mut packet = vec![0_u8; 12];
        packet.extend([0x08, 0x00, 0x45, 0]);
        packet.extend(
            [20 + piece.len() as u16, number, more | (place * 185) as u16].map(u16::to_be_bytes).concat(),
        );
        packet.extend([64, 17, 0, 0, 192, 168, 0, 1, 192, 168, 0, 100]);
        packet.extend(piece);
        packet
    };
    udp.chunks(1480).enumerate().map(packet).collect()
}

/// A capture whose datagrams came in fragments, the last one first; of the datagram `hurt` one fragment is missing.
fn capture(datagrams: &[(u64, Vec<u8>)], hurt: Option<usize>) -> Vec<u8> {
    let fragments = datagrams.iter().enumerate().flat_map(|(number, (at_ns, bytes))| {
        let mut packets = packets(number as u16, bytes);
        packets.reverse();
        if hurt == Some(number) {
            packets.remove(1);
        }
        packets.into_iter().map(|packet| (*at_ns, packet))
    });
    pcap(fragments)
}

#[test]
fn a_row_is_the_same_over_udp_and_from_recordings_and_captures() {
    let (_folder, path) = folder();
    let (scene, file) = (path("row.toml"), path("row.mcap"));
    let live = recorded(&scene, &file);
    let told: Value = serde_json::from_str(&live).expect("JSON");
    assert_eq!(
        (&told["scans"], &told["segments_lost"], &told["scans_lost"]),
        (&json!(30), &json!(0), &json!(0))
    );
    assert_eq!(told["points_per_scan"], 2880, "the level layer");
    assert_says(
        &told["warnings"].to_string(),
        &[
            "other_layer: 20 scans are of inclined layers",
            "scanner_limited",
            "LFPlayerFilter",
            "uncalibrated",
        ],
    );
    // What the scanner's settings are is known of a live one only.
    let limited = live.lines().find(|line| line.contains("scanner_limited")).expect("told");
    let of_file = live.replace(&format!(",\n{limited}"), "");
    assert_ne!(of_file, live);
    // The file may hold a turn more: the scanner sends until the end of the stream is answered.
    assert_eq!(estimate(&file, &scene, &SCANS), of_file, "the recording, to the byte");

    // Beside the encoder's, which the rig has the driver ask for: one a turn.
    const ENCODER: usize = 88;
    let datagrams = datagrams(&file);
    assert!(
        datagrams.len() >= 130 && datagrams.iter().all(|(_, bytes)| [3822, ENCODER].contains(&bytes.len())),
        "{}",
        datagrams[0].1.len()
    );
    let whole = path("whole.pcap");
    std::fs::write(&whole, capture(&datagrams, None)).expect("written");
    assert_eq!(estimate(&whole, &scene, &SCANS), of_file, "a capture in fragments");
    let hurt = path("hurt.pcap");
    std::fs::write(&hurt, capture(&datagrams, Some(54))).expect("written");
    let told: Value = serde_json::from_str(&estimate(&hurt, &scene, &SCANS)).expect("JSON");
    assert_eq!((&told["scans"], &told["segments_lost"]), (&json!(30), &json!(1)));
    // Of ten turns of twelve segments one is not known.
    assert_eq!(told["ranges"]["invalid"], 240);
    let info = run(&["record", "--info", &hurt, "--format", "json"]);
    assert_eq!(info.code, Some(0), "{}", info.stderr);
    let info: Value = serde_json::from_str(&info.stdout).expect("JSON");
    assert_eq!(info["streams"][0]["packets_lost"], 1, "{info}");

    // Played again, over REST and UDP.
    let mut telling = Telling::start("replay", &[&file, "--rest", "127.0.0.1:0", "--time-scale", "0.2"]);
    let rest = telling.address();
    assert_eq!(estimate(&format!("picoscan://{rest}?udp=0"), &scene, &SCANS), of_file, "a replay");
    drop(telling);
}
