//! Recordings replayed as live devices: the bytes that come out are those that were recorded. On a frozen clock.

use crate::common;

use std::path::{Path, PathBuf};
use std::time::Duration;

use common::replayed::{
    Packets, Replayed, connect, next_scan, played, recorded, replay, sent_by, subscribed, ticking,
    ticking_in_clumps, write,
};
use common::{bench, facts, raw_client};
use rowscan_emulator::clock::TimeScale;
use rowscan_emulator::replay::{Part, Played, Survey, model_of};
use rowscan_emulator::{Emulator, EmulatorConfig};
use rowscan_ports::clock::wall_clock_ns;
use rowscan_protocol::device::{Device, DialectPolicy, Identity, MeasuredLine, Session, scan_event};
use rowscan_protocol::frame::{Accept, Dialect, FrameDecoder, encode};
use rowscan_protocol::host::{HostEvent, HostSession};
use rowscan_protocol::model::{self, MODELS};
use rowscan_protocol::time::SimTime;
use rowscan_recording::{About, Decoded, Recorder, RecorderOptions, Side, Taps, WallClock};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::time::{Instant, sleep_until, timeout};

/// Asks what the recorded host asked, when it did, and reads until the tape has ended.
async fn ask_again(replayed: &mut Replayed, packets: &Packets) -> Vec<u8> {
    let (mut reader, mut writer) = tokio::io::split(connect(&mut replayed.emulator));
    let began = Instant::now();
    let requests: Vec<(Duration, Vec<u8>)> = packets
        .iter()
        .filter(|(_, from, _)| *from == Side::Host)
        .map(|(at, _, bytes)| (*at, bytes.clone()))
        .collect();
    let asking = tokio::spawn(async move {
        for (at, bytes) in requests {
            sleep_until(began + at).await;
            writer.write_all(&bytes).await.expect("taken");
        }
        writer
    });
    let mut received = Vec::new();
    let wanted =
        packets.iter().filter(|(_, from, _)| *from == Side::Device).map(|(_, _, bytes)| bytes.len()).sum();
    let reading = async {
        let mut chunk = vec![0; 64 * 1024];
        while received.len() < wanted {
            let read = reader.read(&mut chunk).await.expect("it holds");
            assert_ne!(read, 0, "closed after {} of {wanted} bytes", received.len());
            received.extend_from_slice(&chunk[..read]);
        }
    };
    // What does not come is told by the comparison.
    let _ = timeout(Duration::from_secs(3600), reading).await;
    asking.abort();
    received
}

fn assert_same(name: &str, found: &[u8], expected: &[u8]) {
    let differs = found.iter().zip(expected).position(|(a, b)| a != b);
    if let Some(at) = differs.or((found.len() != expected.len()).then_some(found.len().min(expected.len()))) {
        let around = |bytes: &[u8]| {
            bytes[at.saturating_sub(40)..(at + 40).min(bytes.len())].escape_ascii().to_string()
        };
        panic!("{name} differs at {at} of {}:\n{}\n{}", expected.len(), around(found), around(expected));
    }
}

/// What the recorder keeps, for a test on a frozen clock.
fn recorder(path: &Path) -> Recorder {
    let options = RecorderOptions { decoded: Decoded::default(), waits: true, about: About::default() };
    Recorder::start(path, options, WallClock::new(wall_clock_ns()), |error| panic!("{error}"))
        .expect("it starts")
}

fn folder() -> (tempfile::TempDir, PathBuf, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let (x, y) = (folder.path().join("x.mcap"), folder.path().join("y.mcap"));
    (folder, x, y)
}

/// Without the replies that were captured twice, milliseconds apart: those go out once.
fn replies_once(packets: Packets) -> Packets {
    let mut last: Option<(Duration, Vec<u8>)> = None;
    let is_new = |(at, from, bytes): &(Duration, Side, Vec<u8>)| {
        let is_reply = *from == Side::Device && !bytes.windows(4).any(|four| four == b"sSN ");
        let known = last.as_ref().is_some_and(|(before, last)| {
            last == bytes && at.saturating_sub(*before) < Duration::from_millis(50)
        });
        if is_reply {
            last = Some((*at, bytes.clone()));
        }
        !(is_reply && known)
    };
    packets.into_iter().filter(is_new).collect()
}

#[tokio::test(start_paused = true)]
async fn a_replayed_recording_recorded_again_has_the_same_bytes() {
    let Some(facts) = facts("replaying real recordings") else { return };
    for (name, model) in [
        ("lms111_startup_first88", None),
        ("lms511_20210302", None),
        ("tim781s_20210125", None),
        ("mrs1104_20210722", None),
    ] {
        let packets = recorded(&facts.join("protocol/recordings"), name);
        let (_folder, x, y) = folder();
        write(&x, &packets);
        let packets = replies_once(packets);
        let recorder = recorder(&y);
        let mut replayed = replay(&x, model, TimeScale::Paced(1.0), played(), recorder.taps());
        let received = ask_again(&mut replayed, &packets).await;
        replayed.player.ended().await;
        drop(replayed);
        recorder.finish().expect("kept");
        let expected: Vec<u8> = packets
            .iter()
            .filter(|(_, from, _)| *from == Side::Device)
            .flat_map(|(.., bytes)| bytes.clone())
            .collect();
        assert_same(name, &received, &expected);
        assert_same(name, &sent_by(Side::Device, &y), &expected);
        assert_same(name, &sent_by(Side::Host, &y), &sent_by(Side::Host, &x));
        eprintln!("{name}: {} bytes", expected.len());
    }
}

#[tokio::test(start_paused = true)]
async fn a_recording_without_requests_comes_out_verbatim() {
    let Some(facts) = facts("replaying real recordings") else { return };
    for name in ["tim781s_fieldset_events", "lms511_20210302"] {
        let packets: Packets = recorded(&facts.join("protocol/recordings"), name);
        let packets: Packets = packets.into_iter().filter(|(_, from, _)| *from == Side::Device).collect();
        let (_folder, x, y) = folder();
        write(&x, &packets);
        let survey = Survey::read(&x).expect("it can be played");
        let Part { scans, monitor_scans, .. } = &survey.parts[0];
        // Which telegrams a client must ask for to get any.
        let of_monitor = if name == "tim781s_fieldset_events" { *scans } else { 0 };
        assert!(*scans > 0 && *monitor_scans == of_monitor, "{name}: {monitor_scans} of {scans}");
        let recorder = recorder(&y);
        let verbatim = Played { verbatim: true, ..played() };
        let mut replayed = replay(&x, Some("tim781s"), TimeScale::Paced(1.0), verbatim, recorder.taps());
        let received = ask_again(&mut replayed, &packets).await;
        drop(replayed);
        recorder.finish().expect("kept");
        assert_same(name, &received, &sent_by(Side::Device, &x));
        assert_same(name, &sent_by(Side::Device, &y), &sent_by(Side::Device, &x));
    }
}

#[tokio::test(start_paused = true)]
async fn emulated_runs_of_every_model_replay_to_the_byte() {
    for model in MODELS {
        let (_folder, x, y) = folder();
        let first = recorder(&x);
        let (device, world) = bench(model.name);
        let config = EmulatorConfig { taps: first.taps(), ..EmulatorConfig::default() };
        let mut emulator = Emulator::start(device, world, config);
        let mut client = raw_client(&mut emulator, Dialect::B);
        for _ in 0..10 {
            client.next_scan().await;
        }
        drop((client, emulator));
        first.finish().expect("kept");

        let second = recorder(&y);
        let mut replayed = replay(&x, None, TimeScale::Paced(1.0), played(), second.taps());
        let mut client = raw_client(&mut replayed.emulator, Dialect::B);
        let mut scans = Vec::new();
        while scans.len() < 10 {
            match client.next_event().await {
                HostEvent::Scan => scans.push(client.connection.session().scan().clone()),
                HostEvent::Ready(_) => {}
                other => panic!("{}: {other:?}", model.name),
            }
        }
        drop((client, replayed));
        second.finish().expect("kept");
        let (found, expected) = (sent_by(Side::Device, &y), sent_by(Side::Device, &x));
        // The first recording may hold scans that were on their way when its client left.
        assert_same(
            model.name,
            &found[..found.len().min(expected.len())],
            &expected[..found.len().min(expected.len())],
        );
        assert!(found.len() > 10 * 500, "{}: {} bytes", model.name, found.len());
    }
}

/// So many scans, in the other dialect than the recorded one.
#[tokio::test(start_paused = true)]
async fn the_driver_reads_a_replayed_scanner_in_either_dialect_and_keeps_what_is_recorded() {
    let Some(facts) = facts("replaying real recordings") else { return };
    // Our driver wants neither remission nor time, which are left out: nothing of it is refused.
    for (name, points) in [("lms111_startup_first88", 541), ("lms511_20210302", 1141)] {
        let packets = recorded(&facts.join("protocol/recordings"), name);
        let (_folder, x, _) = folder();
        write(&x, &packets);
        let mut both = Vec::new();
        for dialect in [Dialect::A, Dialect::B] {
            let mut replayed = replay(&x, None, TimeScale::Max, played(), Taps::default());
            let mut client = raw_client(&mut replayed.emulator, dialect);
            let (mut scans, mut refused) = (Vec::new(), Vec::new());
            while scans.len() < 80 {
                match client.next_event().await {
                    HostEvent::Scan => scans.push(client.connection.session().scan().clone()),
                    HostEvent::Refused { command, .. } => refused.push(command),
                    HostEvent::Ready(_) => {}
                    other => panic!("{name}: {other:?}"),
                }
            }
            // Nothing tells which echo the recorded LMS511 sent: nobody is told that it was the first.
            let unknown: &[&str] = if name.starts_with("lms511") { &["FREchoFilter"] } else { &[] };
            assert_eq!(refused, unknown, "{name}");
            assert!(scans.iter().all(|scan| scan.beams.len() == points), "{name}");
            assert!(scans.iter().all(|scan| scan.echoes[0].remission.is_empty()), "{name}");
            both.push(scans);
        }
        assert_eq!(both[0], both[1], "{name}: the dialects tell different scans");
    }
}

#[tokio::test(start_paused = true)]
async fn a_replay_pauses_seeks_and_ends() {
    let (_folder, x, _) = folder();
    ticking(&x, 30);
    let mut replayed = replay(&x, Some("lms111"), TimeScale::Paced(1.0), played(), Taps::default());
    let mut client = subscribed(&mut replayed).await;
    assert_eq!(next_scan(&mut client).await.0, 0);
    assert_eq!(next_scan(&mut client).await.0, 1);
    replayed.playhead.pause(true, replayed.clock.now());
    let waited = timeout(Duration::from_secs(100), next_scan(&mut client)).await;
    assert!(waited.is_err(), "it plays on while it is paused");
    let resumed = Instant::now();
    replayed.playhead.pause(false, replayed.clock.now());
    assert_eq!(next_scan(&mut client).await.0, 2);
    assert!(resumed.elapsed() <= Duration::from_millis(1001), "{:?}", resumed.elapsed());
    replayed.playhead.seek(1_700_000_020_000_000_000.into(), replayed.clock.now());
    for expected in 20..30 {
        assert_eq!(next_scan(&mut client).await.0, expected);
    }
    replayed.player.ended().await;
}

/// Scans that came in one piece have one time: which of them a place is, their order tells.
#[tokio::test(start_paused = true)]
async fn a_replay_begins_and_ends_at_its_scans_where_many_have_one_time() {
    let (_folder, path, _) = folder();
    ticking_in_clumps(&path, 300, 40);
    let survey = Survey::read(&path).expect("it can be played");
    let part = survey.choose(&[], 1).expect("a scanner")[0];
    let at = |number| survey.scan_at(part, number).expect("it reads").expect("it is there");
    for (from, until) in [(0, 40), (45, 95), (39, 41), (80, 120), (250, 299), (100, 101)] {
        let cut = Played { from: at(from), until: at(until), ..played() };
        let mut replayed = replay(&path, Some("lms111"), TimeScale::Max, cut, Taps::default());
        let mut client = subscribed(&mut replayed).await;
        let mut bytes = Vec::new();
        replayed.player.ended().await;
        drop(replayed);
        client.read_to_end(&mut bytes).await.expect("read");
        let text = String::from_utf8(bytes).expect("text");
        let counters: Vec<u64> = text
            .split('\u{3}')
            .filter_map(|telegram| u64::from_str_radix(telegram.split(' ').nth(7)?, 16).ok())
            .collect();
        assert_eq!(counters, (from..until).collect::<Vec<_>>(), "{from}..{until}");
    }
}

#[tokio::test(start_paused = true)]
async fn times_ten_takes_a_tenth_and_kept_stamps_stay() {
    let (_folder, x, _) = folder();
    ticking(&x, 30);
    let mut replayed = replay(&x, Some("lms111"), TimeScale::Paced(10.0), played(), Taps::default());
    let mut client = subscribed(&mut replayed).await;
    let began = Instant::now();
    for second in 0..30 {
        assert_eq!(next_scan(&mut client).await, (second, u32::from(second) * 1_000_000));
    }
    assert!(began.elapsed().abs_diff(Duration::from_millis(2900)) <= Duration::from_millis(2));
}

/// What a scanner sent, and nothing of its host: answers to `requests`, then a scan.
fn heard_alone(model: &str, requests: &[String]) -> Packets {
    let mut device = Device::new(model::by_name(model).expect("known"), Identity::default());
    let mut session = Session::new(DialectPolicy::Auto);
    let (mut packets, mut replies) = (Packets::new(), Vec::new());
    for request in requests {
        let mut frame = Vec::new();
        encode(Dialect::A, request.as_bytes(), &mut frame);
        session.handle_bytes(&mut device, SimTime::ZERO, &frame, &mut replies);
    }
    packets.extend(replies.into_iter().map(|reply| (Duration::ZERO, Side::Device, reply.bytes)));
    let grid = device.mirror().beams;
    let scan = device.measure(SimTime::ZERO, &MeasuredLine { grid, echoes: &[] }).expect("it measures");
    let mut bytes = Vec::new();
    scan_event(Dialect::A, scan, &mut bytes);
    packets.push((Duration::from_secs(1), Side::Device, bytes));
    packets
}

#[tokio::test(start_paused = true)]
async fn a_scanner_without_a_name_is_known_by_its_answers() {
    let fields = |count: u16| (0..count).map(|slot| format!("sRN field{slot:03}")).collect::<Vec<_>>();
    let read = |name: &str| vec![format!("sRN {name}")];
    for (model, requests, expected, login) in [
        ("tim781s", Vec::new(), "tim561", "F4724744"),
        ("tim781s", fields(48), "tim781", "6FD62C05"),
        ("tim781s", read("LFErec"), "tim781", "F4724744"),
        ("tim571", read("LFErec"), "tim561", "F4724744"),
    ] {
        let (_folder, x, _) = folder();
        write(&x, &heard_alone(model, &requests));
        let mut replayed = replay(&x, None, TimeScale::Paced(1.0), played(), Taps::default());
        let survey = Survey::read(&x).expect("it can be played");
        let found = model_of(&survey, &survey.parts[0], None).expect("told by its answers");
        assert_eq!(found.name, expected, "{model}: {requests:?}");
        let mut client = connect(&mut replayed.emulator);
        let login = format!("\x02sMN SetAccessMode 3 {login}\x03");
        client.write_all(login.as_bytes()).await.expect("taken");
        let mut reply = [0; 21];
        client.read_exact(&mut reply).await.expect("answered");
        assert_eq!(&reply, b"\x02sAN SetAccessMode 1\x03", "{model}");
    }
}

/// The device's side of the recorded TiM781S takes the host's side of the same recording.
#[tokio::test(start_paused = true)]
async fn a_recording_of_the_device_alone_takes_its_own_client() {
    let Some(facts) = facts("replaying real recordings") else { return };
    let packets = recorded(&facts.join("protocol/recordings"), "tim781s_20210125");
    let (_folder, x, _) = folder();
    write(&x, &packets.iter().filter(|(_, from, _)| *from == Side::Device).cloned().collect());
    let mut replayed = replay(&x, None, TimeScale::Max, played(), Taps::default());
    let mut client = connect(&mut replayed.emulator);
    let asked = packets.iter().filter(|(_, from, _)| *from == Side::Host);
    let mut answers = FrameDecoder::new(Accept::Only(Dialect::B), 64 * 1024);
    for (_, _, request) in asked {
        client.write_all(request).await.expect("taken");
        let (mut chunk, mut answered) = (vec![0; 64 * 1024], false);
        while !answered {
            let read = client.read(&mut chunk).await.expect("it holds");
            answers.push(&chunk[..read]);
            while let Some(frame) = answers.next_frame() {
                let told = frame.payload.escape_ascii().to_string();
                assert!(!told.starts_with("sFA") && told != "sAN SetAccessMode \\x00", "{told}");
                answered |= !told.starts_with("sSN ");
            }
        }
    }
}
