#![allow(clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use rowscan_emulator::clock::TimeScale;
use rowscan_emulator::offline::Offline;
use rowscan_emulator::stage::Stage;
use rowscan_protocol::client::ColaConfig;
use rowscan_protocol::device::scan_event;
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::model;
use rowscan_scenes::files::scene_from_text;
use rowscan_study::reading::{CalibrationChoice, Reading};

use super::*;

/// A witness of one device, and so many of its scan telegrams in CoLa B.
pub(crate) fn bench(scans: usize) -> (Witness, Vec<Vec<u8>>) {
    let scene =
        scene_from_text("version = 1\n[orchard]\ntrees = 1\n[orchard.tree]\niterations = 5\n", |_| {});
    let stage = Stage::grow(scene.expect("sound"), &|_, _| {}).expect("it grows");
    let (device, view) = stage.scanner(0, model::by_name("lms111").expect("known")).expect("it fits");
    let mut offline = Offline::new(device, view);
    offline.set_up(ColaConfig::default()).expect("set up");
    let mut telegrams = Vec::new();
    while telegrams.len() < scans {
        let mut frame = Vec::new();
        scan_event(Dialect::B, offline.telegram().expect("a telegram"), &mut frame);
        telegrams.push(frame);
    }
    let tractor = stage.tractor();
    tractor.begin(SimTime::ZERO);
    let rig = rowscan_emulator::Rig::new(tractor.clone(), TimeScale::Max);
    let witness = Witness::new(Journal::new(rig.clock(), tractor));
    let reading = Reading::of(Some(&stage.rig), 0, true, CalibrationChoice::OfRig).expect("read");
    witness.watch("left", reading.pipeline);
    (witness, telegrams)
}

/// The bytes of these telegrams over one connection.
pub(crate) fn deliver<'a>(witness: &Witness, telegrams: impl IntoIterator<Item = &'a Vec<u8>>) {
    let tap = witness.taps().open("left", StreamKind::Cola);
    // In pieces, as a link gives them.
    for telegram in telegrams {
        telegram.chunks(100).for_each(|bytes| tap.record(Side::Device, bytes));
    }
}

/// Lost, repeated, bad, connections.
fn counted(witness: &Witness) -> (u64, u64, u64, u64) {
    let counts = witness.close(true)["left"].counts();
    (counts.scans_lost, counts.scans_repeated, counts.telegrams_bad, counts.connections)
}

#[test]
fn whole_telegrams_are_no_fault() {
    let (witness, telegrams) = bench(10);
    deliver(&witness, &telegrams);
    let streams = witness.close(true);
    let stream = &streams["left"];
    assert_eq!((stream.counts().scans, stream.scan_times.len()), (10, 10));
    assert_eq!(stream.counts().rare(), Counts { connections: 1, ..Counts::default() });
    assert_eq!(stream.estimate.as_ref().map(|estimate| estimate.scans), Some(10));
}

#[test]
fn scans_before_the_drive_are_counted_and_measure_nothing() {
    let (witness, telegrams) = bench(10);
    let mut reader = ScanReader::new(StreamKind::Cola, MAX_PAYLOAD).expect("a reader");
    let mut stream = witness.lock().streams.remove("left").expect("watched");
    let began = SimTime(5_000_000_000);
    for (number, telegram) in telegrams.iter().enumerate() {
        let packet = Packet { from: Some(Side::Device), bytes: telegram.clone(), ..Packet::default() };
        reader.push(Duration::ZERO, &packet);
        assert_eq!(reader.next_event(), Some(HostEvent::Scan));
        let at = SimTime(number as u64 * 1_000_000_000);
        // That the scan of second 5 has started the drive is known only at the next one.
        stream.scan(at, reader.scan(), Some(began).filter(|began| at > *began));
    }
    assert_eq!((stream.counts().scans, stream.scan_times.len()), (10, 10));
    assert_eq!(stream.pipeline.finish().scans, 5, "from the one on that has started the drive");

    let (witness, telegrams) = bench(4);
    // The drive starts only later than anything that is delivered.
    let journal = Journal::new(rowscan_emulator::Rig::new(standing(), TimeScale::Max).clock(), standing());
    let still = Witness { journal, seen: Arc::clone(&witness.seen) };
    deliver(&still, &telegrams);
    let streams = still.close(true);
    let estimate = streams["left"].estimate.as_ref().expect("closed");
    assert_eq!((streams["left"].counts().scans, estimate.scans), (4, 0));
}

/// The echo is the device's: set on one connection, it holds on the next one.
#[test]
fn an_echo_that_one_connection_set_is_known_on_another() {
    use rowscan_protocol::rig::EchoChoice;
    let ask = |code: u8| [b"\x02sWN FREchoFilter ".as_slice(), &[b'0' + code], b"\x03"].concat();
    for (code, is_other) in [(Some(2), true), (Some(0), false), (None, false)] {
        let (witness, telegrams) = bench(10);
        let mount = rowscan_protocol::rig::Mount { echo: Some(EchoChoice::First), ..Default::default() };
        // Of rays every echo is the first.
        let optics = Some(rowscan_protocol::rig::BeamWidth::Device);
        let rig = rowscan_protocol::rig::Rig { scanners: vec![mount], optics, ..Default::default() };
        let reading = Reading::of(Some(&rig), 0, true, CalibrationChoice::Given(None)).expect("read");
        witness.watch("left", reading.pipeline);
        if let Some(code) = code {
            let tap = witness.taps().open("left", StreamKind::Cola);
            tap.record(Side::Host, &ask(code));
            tap.record(Side::Device, b"\x02sWA FREchoFilter\x03");
        }
        deliver(&witness, &telegrams);
        let streams = witness.close(true);
        let estimate = streams["left"].estimate.as_ref().expect("closed");
        let told = estimate.warnings.iter().any(|warning| warning.code() == "other_echo");
        assert_eq!(told, is_other, "{code:?}: {:?}", estimate.warnings);
    }
}

/// A tractor that has not begun to drive.
fn standing() -> rowscan_vehicle::Tractor {
    rowscan_vehicle::Tractor::new(rowscan_vehicle::trajectory::Trajectory::straight(0.0, 1.0))
}

#[test]
fn what_is_lost_repeated_or_broken_on_the_way_is_counted() {
    let (witness, telegrams) = bench(10);
    deliver(&witness, telegrams.iter().enumerate().filter(|(n, _)| !(4..7).contains(n)).map(|(_, t)| t));
    assert_eq!(counted(&witness), (3, 0, 0, 1));

    let (witness, telegrams) = bench(10);
    deliver(&witness, telegrams[..5].iter().chain(&telegrams[4..]));
    assert_eq!(counted(&witness), (0, 1, 0, 1));

    let (witness, mut telegrams) = bench(10);
    let last = telegrams[5].len() - 1;
    telegrams[5][last] ^= 1;
    deliver(&witness, &telegrams);
    assert_eq!(counted(&witness), (1, 0, 1, 1));
}

#[test]
fn a_connection_that_ends_inside_a_telegram_and_another_one() {
    let (witness, telegrams) = bench(10);
    let cut = telegrams[3][..200].to_vec();
    deliver(&witness, telegrams[..3].iter().chain([&cut]));
    deliver(&witness, &telegrams[6..]);
    let (lost, repeated, _, connections) = counted(&witness);
    assert_eq!((lost, repeated, connections), (3, 0, 2));
}

#[test]
fn scans_over_two_connections_at_once_count_once() {
    let (witness, telegrams) = bench(4);
    let taps = witness.taps();
    let (first, second) = (taps.open("left", StreamKind::Cola), taps.open("left", StreamKind::Cola));
    for telegram in &telegrams {
        first.record(Side::Device, telegram);
        second.record(Side::Device, telegram);
    }
    assert_eq!(counted(&witness), (0, 0, 0, 2));
}

#[test]
fn behind_a_dead_connection_the_next_one_counts() {
    let (witness, telegrams) = bench(10);
    let taps = witness.taps();
    let first = taps.open("left", StreamKind::Cola);
    telegrams[..3].iter().for_each(|telegram| first.record(Side::Device, telegram));
    // It stays open, and gets nothing any more.
    let second = taps.open("left", StreamKind::Cola);
    telegrams[6..].iter().for_each(|telegram| second.record(Side::Device, telegram));
    assert_eq!(counted(&witness), (3, 0, 0, 2));
}

#[test]
fn counts_at_one_instant_keep_the_order_of_the_events() {
    let (witness, telegrams) = bench(10);
    let journal = witness.journal.clone();
    journal.note("before", "");
    deliver(&witness, telegrams.iter().enumerate().filter(|(n, _)| *n != 4).map(|(_, telegram)| telegram));
    journal.note("after", "");
    let streams = witness.close(true);
    let number = |name: &str| journal.events().iter().position(|event| event.event == name).expect(name);
    let lost = |name: &str| streams["left"].counts_at(number(name)).scans_lost;
    assert_eq!((lost("before"), lost("after")), (0, 1));
    assert!(journal.events().iter().all(|event| event.t_s == 0.0), "time stood still");
}

/// Datagrams of a picoScan that turns at 15 Hz: ten a turn.
fn datagrams(witness: &Witness, turns: usize) -> Vec<Vec<u8>> {
    let scene =
        scene_from_text("version = 1\n[orchard]\ntrees = 1\n[orchard.tree]\niterations = 5\n", |_| {});
    let stage = Stage::grow(scene.expect("sound"), &|_, _| {}).expect("it grows");
    let model = model::by_name("picoscan150").expect("known");
    let (mut device, mut view) = stage.scanner(0, model).expect("it fits");
    device.enable_streaming();
    device.direct(std::net::SocketAddrV4::new(std::net::Ipv4Addr::LOCALHOST, 2115));
    let reading = Reading::of(
        Some(&rowscan_study::reading::rig_with(&stage.rig, 0, "picoscan150")),
        0,
        true,
        CalibrationChoice::OfRig,
    );
    witness.watch("pico", reading.expect("read").pipeline);
    let mut all = Vec::new();
    for turn in 0..turns {
        let at = SimTime(turn as u64 * 1_000_000_000 / 15);
        view.look(device.mirror(), at);
        device.measure(at, &view.line()).expect("it measures");
        let mut found = Vec::new();
        device.segments(at, &[view.line()], &mut found);
        all.extend(found.into_iter().map(|datagram| device.send(datagram).expect("it goes out").1));
    }
    all
}

/// Delivers those datagrams whose number `is_kept`; scans, scans lost, segments lost.
fn heard(turns: usize, is_kept: impl Fn(usize) -> bool) -> (u64, u64, u64) {
    let (witness, _) = bench(0);
    let all = datagrams(&witness, turns);
    let tap = witness.taps().open(&format!("pico{DATAGRAMS}"), StreamKind::Compact);
    let kept = all.iter().enumerate().filter(|(number, _)| is_kept(*number));
    kept.for_each(|(_, datagram)| tap.record(Side::Device, datagram));
    let streams = witness.close(true);
    let counts = streams["pico"].counts();
    assert_eq!((counts.connections, streams["left"].counts().scans), (0, 0));
    (counts.scans, counts.scans_lost, counts.segments_lost)
}

#[test]
fn turns_that_come_as_datagrams_are_scans() {
    assert_eq!(heard(6, |_| true), (6, 0, 0));
    assert_eq!(heard(6, |number| number % 10 != 3), (6, 0, 6), "a segment of each turn");
    assert_eq!(heard(6, |number| !(20..40).contains(&number)), (4, 2, 20), "two turns");
    // Of the last turn all but its end has come: nobody can tell that it is over.
    assert_eq!(heard(6, |number| number < 59), (5, 0, 0));
    assert_eq!(heard(6, |_| false), (0, 0, 0));
}
