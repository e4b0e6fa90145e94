//! Faults on the emulator's own connections, with the host's clock frozen and our driver's session as the system under test.

use std::fs;
use std::sync::Arc;
use std::time::Duration;

use rowscan_driver::{Connection, ConnectionEvent};
use rowscan_emulator::clock::TimeScale;
use rowscan_emulator::stage::Stage;
use rowscan_emulator::{
    Emulator, EmulatorConfig, Rig, Running, ScannerCounts, SerialConfig, StageRow, VirtualScanner,
};
use rowscan_faults::{FaultControl, FaultEvents, Language, Medium, What, read};
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::host::{HostEvent, HostSession};
use rowscan_protocol::lms2xx;
use rowscan_protocol::lms2xx::client::{Lms2xxClient, Lms2xxConfig};
use rowscan_protocol::model;
use serde_json::Value;
use tokio::time::Instant;

use crate::common::binary::{Telling, assert_says, refused, run, text};
use crate::common::{RawClient, raw_client, small_scene};

/// A scanner of this model whose clients meet these faults.
struct Bench {
    emulator: Emulator,
    control: FaultControl,
    events: FaultEvents,
    _running: Running,
}

fn faulty(model: &str, scale: TimeScale, faults: &str) -> Bench {
    let stage = Stage::grow(small_scene(), &|_, _| {}).expect("it grows");
    let tractor = stage.tractor();
    let model = model::by_name(model).expect("known");
    let (device, view) = stage.scanner_on(&tractor, 0, model).expect("it fits");
    let mut rig = Rig::new(tractor.clone(), scale);
    let row = Arc::new(StageRow::new(tractor, &stage.orchard));
    let (control, events) = FaultControl::new(1, rig.clock(), Some(row));
    let stream = control.stream("left", Medium::Tcp, Language::Cola);
    control.add_all(read(faults).expect(faults)).expect(faults);
    let config = EmulatorConfig { time_scale: scale, faults: Some(stream), ..EmulatorConfig::default() };
    let emulator = rig.scanner(device, view, config);
    Bench { emulator, control, events, _running: rig.run() }
}

async fn counters(client: &mut RawClient, count: usize) -> Vec<u16> {
    let mut counters = Vec::new();
    while counters.len() < count {
        counters.push(client.next_scan().await.telegram_counter);
    }
    counters
}

/// The telegrams missing between one and the next; -1 for one that came again.
fn missing(counters: &[u16]) -> Vec<i32> {
    let gap = |pair: &[u16]| i32::from(pair[1].wrapping_sub(pair[0])) - 1;
    counters.windows(2).map(gap).filter(|gap| *gap != 0).collect()
}

#[tokio::test(start_paused = true)]
async fn the_session_loses_exactly_what_the_faults_take_and_recovers_with_the_next_telegram() {
    for (fault, dialects, gaps, bad) in [
        ("name = \"drop\"\ntelegrams = 3", &[Dialect::A, Dialect::B][..], &[3][..], 0),
        ("name = \"truncate\"", &[Dialect::A, Dialect::B], &[1], 1),
        ("name = \"checksum\"", &[Dialect::B], &[1], 1),
        ("name = \"flip\"\nregion = \"payload\"", &[Dialect::B], &[1], 1),
        ("name = \"length\"\nby = -7", &[Dialect::B], &[1], 1),
        ("name = \"duplicate\"", &[Dialect::A, Dialect::B], &[-1], 0),
        ("name = \"inject\"\nkind = \"telegram\"", &[Dialect::A, Dialect::B], &[], 0),
        ("name = \"split\"\npieces = 7", &[Dialect::A, Dialect::B], &[], 0),
        ("name = \"coalesce\"\ntelegrams = 5", &[Dialect::A, Dialect::B], &[], 0),
        ("name = \"delay\"\nms = 90\nfor = { scans = 9 }", &[Dialect::A, Dialect::B], &[], 0),
    ] {
        for model in ["lms111", "lms511", "tim571"] {
            for &dialect in dialects {
                let text = format!("[[fault]]\n{fault}\nat = {{ scan = 10 }}\n");
                let mut with = faulty(model, TimeScale::Paced(1.0), &text);
                let mut client = raw_client(&mut with.emulator, dialect);
                let seen = counters(&mut client, 40).await;
                let counts = client.connection.session().counts();
                assert_eq!(
                    (missing(&seen).as_slice(), counts.bad),
                    (gaps, bad),
                    "{fault} of {model} in {dialect}"
                );
                assert!(with.control.list().iter().all(|status| status.state == "done" && status.acts > 0));
                // The same without the fault: nothing of it.
                let mut without = faulty(model, TimeScale::Paced(1.0), "");
                let mut client = raw_client(&mut without.emulator, dialect);
                let seen = counters(&mut client, 40).await;
                assert!(missing(&seen).is_empty() && client.connection.session().counts().bad == 0);
            }
        }
    }
}

#[tokio::test(start_paused = true)]
async fn a_stall_is_told_after_the_sessions_own_patience_and_the_loss_is_the_devices() {
    let faults = "[[fault]]\nname = \"stall\"\nat = { scan = 10 }\nfor = { s = 20 }\n";
    let mut bench = faulty("lms111", TimeScale::Paced(1.0), faults);
    let mut client = raw_client(&mut bench.emulator, Dialect::B);
    let before = counters(&mut client, 9).await;
    let (last, patience) = (Instant::now(), Duration::from_secs(5));
    match client.connection.next_event(Some(patience)).await.expect("the link holds") {
        ConnectionEvent::Stalled => {}
        other => panic!("no stall but {other:?}"),
    }
    assert!(last.elapsed().abs_diff(patience) <= Duration::from_millis(1), "{:?}", last.elapsed());
    let after = counters(&mut client, 400).await;
    // The next scan came when the stall was over: 20 s after scan 10, which was due 20 ms after scan 9.
    assert!(last.elapsed() >= Duration::from_secs(20));
    let lost: i32 = missing(&[&before[8..], &after].concat()).into_iter().sum();
    let dropped = bench.emulator.counts().scans_dropped;
    assert_eq!((lost as u64, dropped > 500), (dropped, true), "1000 scans came meanwhile");
}

#[tokio::test(start_paused = true)]
async fn a_fault_begins_at_its_row_metre() {
    let mut bench =
        faulty("lms111", TimeScale::Paced(1.0), "[[fault]]\nname = \"drop\"\nat = { row_m = 0.5 }\n");
    let mut client = raw_client(&mut bench.emulator, Dialect::B);
    let seen = counters(&mut client, 150).await;
    assert_eq!(missing(&seen), [1]);
    let begin = bench.events.take().expect("it began");
    let row_m = begin.row_m.expect("there is a row");
    // At most one scan further: 20 ms at the rig's speed.
    assert!((0.5..0.55).contains(&row_m), "{row_m}");
}

#[tokio::test(start_paused = true)]
async fn time_that_waits_for_its_clients_does_not_wait_for_faults() {
    for fault in [
        "name = \"stall\"\nfor = { s = 8 }",
        "name = \"delay\"\nms = 3000\nfor = { s = 5 }",
        "name = \"bandwidth\"\nbytes_s = 9600\nfor = { s = 3 }",
    ] {
        let text = format!("[[fault]]\n{fault}\nat = {{ scan = 10 }}\n");
        let mut bench = faulty("lms111", TimeScale::Max, &text);
        let mut client = raw_client(&mut bench.emulator, Dialect::B);
        let seen = counters(&mut client, 1000).await;
        assert!(missing(&seen).is_empty(), "{fault}");
        let told: Vec<What> = std::iter::from_fn(|| bench.events.take()).map(|event| event.what).collect();
        assert_eq!(told, [What::Begin, What::End], "{fault}");
    }
}

/// Before anybody takes scans time stands, but for what a fault holds back: a client is answered, and the drive waits for it.
#[tokio::test(start_paused = true)]
async fn a_client_is_answered_through_faults_that_were_there_before_it() {
    for fault in [
        "name = \"stall\"\nfor = { s = 8 }",
        "name = \"delay\"\nms = 3000",
        "name = \"delay\"\nms = 50\ndirection = \"to_device\"",
        "name = \"jitter\"\nmean_ms = 40\nsd_ms = 10",
        "name = \"bandwidth\"\nbytes_s = 960",
    ] {
        for model in ["lms111", "tim571"] {
            let mut bench = faulty(model, TimeScale::Max, &format!("[[fault]]\n{fault}\n"));
            let mut client = raw_client(&mut bench.emulator, Dialect::B);
            let seen = tokio::time::timeout(Duration::from_secs(3600), counters(&mut client, 50)).await;
            let seen = seen.unwrap_or_else(|_| panic!("{model}: no answer through {fault}"));
            assert!(missing(&seen).is_empty(), "{model}: {fault}");
        }
    }
}

#[tokio::test(start_paused = true)]
async fn a_serial_line_has_its_faults_too() {
    for (fault, bad) in
        [("name = \"checksum\"", 1), ("name = \"truncate\"\nbytes = 40", 1), ("name = \"drop\"", 0)]
    {
        let text = format!("[[fault]]\n{fault}\nat = {{ scan = 3 }}\n");
        let stage = Stage::grow(small_scene(), &|_, _| {}).expect("it grows");
        let model = lms2xx::model::MODELS[0];
        let (device, world) =
            stage.serial_scanner(0, model, lms2xx::device::Options::default()).expect("it fits");
        let mut rig = Rig::new(world.tractor().clone(), TimeScale::Paced(1.0));
        let (control, _events) = FaultControl::new(1, rig.clock(), None);
        let stream = control.stream("line", Medium::Wire, Language::Lms2xx);
        control.add_all(read(&text).expect("sound")).expect("fits");
        let (here, there) = tokio::io::duplex(64 * 1024);
        let config = SerialConfig::at(TimeScale::Paced(1.0));
        let wire = Box::new(stream.wrap(there, |_| ()));
        let emulator = rig.lms2xx(device, world, wire, config);
        let _running = rig.run();
        let mut connection = Connection::new(here, Lms2xxClient::new(Lms2xxConfig::default()));
        let mut scans = 0;
        while scans < 10 {
            match connection.next_event(Some(Duration::from_secs(60))).await.expect("the line holds") {
                ConnectionEvent::Session(HostEvent::Scan) => scans += 1,
                ConnectionEvent::Session(HostEvent::Ready(_)) => {}
                other => panic!("no scan but {other:?}"),
            }
        }
        // One is lost; one more may be on the line.
        let sent = emulator.counts().scans_sent;
        assert_eq!(connection.session().counts().bad, bad, "{fault}");
        assert!((11..=12).contains(&sent), "{fault}: {sent} sent, 10 read");
    }
}

#[test]
fn emulate_tells_its_faults_and_records_what_the_client_got() {
    let folder = tempfile::tempdir().expect("a folder");
    let (faults, recording) = (folder.path().join("faults.toml"), folder.path().join("run.mcap"));
    fs::write(&faults, "[[fault]]\nname = \"drop\"\ntelegrams = 2\non = \"scanner0\"\nat = { scan = 5 }\n")
        .expect("written");
    let arguments = ["--tcp", "127.0.0.1:0", "--faults", text(&faults), "--record", text(&recording)];
    let mut emulator = Telling::start("emulate", &arguments);
    let source = format!("tcp://{}", emulator.address());
    let out = folder.path().join("client.mcap");
    let ended = run(&["record", &source, "-o", text(&out), "--scans", "20"]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let told = emulator.end();
    let of_faults: Vec<&Value> = told.iter().filter(|line| line["event"] == "fault").collect();
    let whats: Vec<&str> = of_faults.iter().filter_map(|line| line["what"].as_str()).collect();
    assert_eq!(whats, ["begin", "act", "act", "end"], "each of the two is an act: {told:?}");
    assert_eq!((&of_faults[2]["scan"], &of_faults[3]["acts"]), (&6.into(), &2.into()));
    assert_eq!((&of_faults[1]["scan"], &of_faults[1]["on"]), (&5.into(), &"scanner0".into()));
    assert!(
        of_faults[1]["row_m"].is_number() && of_faults[1]["offset"].as_u64() > Some(0),
        "{}",
        of_faults[1]
    );
    for path in [&recording, &out] {
        let info = run(&["record", "--info", text(path), "--format", "json"]);
        let info: Value = serde_json::from_str(&info.stdout).expect("json");
        assert_eq!(info["streams"][0]["scans_lost"], 2, "{}: {info}", path.display());
    }
    // A recording is a source of faults like any other.
    fs::write(&faults, "[[fault]]\nname = \"drop\"\nat = { scan = 4 }\n").expect("written");
    let mut replay =
        Telling::start("replay", &[text(&out), "--tcp", "127.0.0.1:0", "--faults", text(&faults)]);
    let source = format!("tcp://{}", replay.address());
    let again = folder.path().join("again.mcap");
    let ended = run(&["record", &source, "-o", text(&again), "--scans", "10"]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let acts = replay.end().iter().filter(|line| line["what"] == "act").count();
    assert_eq!(acts, 1);
}

/// What faults hold back at the end leaves then, or is counted as dropped.
#[test]
fn what_is_told_as_sent_has_come_when_emulate_ends() {
    use std::io::{Read, Write};
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("faults.toml");
    for fault in [
        "name = \"bandwidth\"\nbytes_s = 5000",
        "name = \"bandwidth\"\nbytes_s = 10000\nat = { scan = 5 }",
        "name = \"delay\"\nms = 30000",
        "name = \"stall\"\nat = { scan = 20 }",
        "name = \"jitter\"\nmean_ms = 500\nsd_ms = 100",
        "name = \"drop\"\ntelegrams = 7\nat = { scan = 20 }",
        "name = \"half_open\"\nat = { scan = 20 }",
        "name = \"drop\"\ntelegrams = 30\nat = { scan = 20 }\n[[fault]]\nname = \"jitter\"\nmean_ms = 500\nsd_ms = 100",
    ] {
        fs::write(&file, format!("[[fault]]\n{fault}\n")).expect("written");
        // What queues before a slow line is sent by the host's clock alone: at `max` time waits for it.
        let scale = if fault.contains("10000") { "1" } else { "max" };
        let args = ["spindle", "--tcp", "127.0.0.1:0", "--time-scale", scale, "--seconds", "3", "--faults"];
        let mut telling = Telling::start("emulate", &[&args[..], &[text(&file)]].concat());
        let mut client = std::net::TcpStream::connect(telling.address()).expect("it listens");
        client.write_all(b"\x02sEN LMDscandata 1\x03").expect("asked");
        let mut bytes = Vec::new();
        // Of a dead connection there may be no end but a reset.
        let _ = client.read_to_end(&mut bytes);
        let came = bytes.windows(17).filter(|bytes| *bytes == b"\x02sSN LMDscandata ").count();
        let whole = bytes.iter().filter(|byte| **byte == 3).count();
        let mut ended = std::iter::from_fn(|| telling.next());
        let end = ended.find(|line| line.get("scans_sent").is_some()).expect("it counts scans");
        let told = [&end["scans_sent"], &end["scans_dropped"], &end["scans_kept_by_faults"]];
        let told = told.map(|count| count.as_u64().expect("a count"));
        // The answer to the subscription is a telegram, too.
        assert_eq!((came as u64, whole), (told[0] - told[2], came + 1), "{fault}: {end}");
        assert_eq!(told[2] > 0, fault.contains("drop") || fault.contains("half"), "{fault}: {end}");
        assert!(told[0] + told[1] >= 150, "{fault}: {end}");
    }
}

/// The same of a serial line: what it holds back at the end was not sent.
#[tokio::test(start_paused = true)]
async fn what_a_serial_line_holds_back_at_the_end_counts_as_dropped() {
    for (fault, is_held) in
        [("name = \"drop\"\nat = { scan = 3 }", false), ("name = \"stall\"\nat = { scan = 6 }", true)]
    {
        let stage = Stage::grow(small_scene(), &|_, _| {}).expect("it grows");
        let model = lms2xx::model::MODELS[0];
        let (device, world) =
            stage.serial_scanner(0, model, lms2xx::device::Options::default()).expect("it fits");
        let mut rig = Rig::new(world.tractor().clone(), TimeScale::Paced(1.0));
        let (control, _events) = FaultControl::new(1, rig.clock(), None);
        let stream = control.stream("line", Medium::Wire, Language::Lms2xx);
        control.add_all(read(&format!("[[fault]]\n{fault}\n")).expect("sound")).expect("fits");
        let (here, there) = tokio::io::duplex(64 * 1024);
        let config = SerialConfig { faults: Some(stream), ..SerialConfig::at(TimeScale::Paced(1.0)) };
        let emulator: Box<dyn VirtualScanner> = Box::new(rig.lms2xx(device, world, Box::new(there), config));
        let _running = rig.run();
        let mut connection = Connection::new(here, Lms2xxClient::new(Lms2xxConfig::default()));
        let mut scans = 0;
        while scans < 5 {
            let event = connection.next_event(Some(Duration::from_secs(60))).await.expect("the line holds");
            scans += u64::from(matches!(event, ConnectionEvent::Session(HostEvent::Scan)));
        }
        tokio::time::sleep(Duration::from_secs(5)).await;
        let before = emulator.scanner_counts();
        emulator.give_up_held();
        let ScannerCounts { scans_sent, scans_dropped, scans_kept_by_faults, .. } = emulator.scanner_counts();
        assert_eq!(scans_kept_by_faults, Some(u64::from(!is_held)), "{fault}");
        assert_eq!(Some(scans_sent + scans_dropped.expect("counted")), Some(before.scans_sent), "{fault}");
        let is_whole = scans_sent > scans + 2;
        assert_eq!(
            (is_whole, scans_dropped > Some(3)),
            (!is_held, is_held),
            "{fault}: {scans_sent} sent, {before:?}"
        );
    }
}

#[test]
fn emulate_refuses_a_stream_that_is_not_there_before_it_runs() {
    let folder = tempfile::tempdir().expect("a folder");
    let faults = folder.path().join("faults.toml");
    fs::write(&faults, "[[fault]]\nname = \"drop\"\non = \"scaner0\"\n").expect("written");
    let arguments = ["emulate", "--tcp", "127.0.0.1:0", "--faults", text(&faults)];
    assert_says(&refused(&arguments), &["faults.toml: fault `drop`", "did you mean `scanner0`?"]);
}
