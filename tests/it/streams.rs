//! Two scanners, GNSS and CAN, recorded together and played together: one order, one time, whatever the playhead does. On a frozen clock.

use crate::common;

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use common::replayed::{connect, played};
use common::small_scene;
use rowscan_bus::nmea::{GnssEpochs, NmeaAddress, NmeaLine};
use rowscan_bus::tractor::TractorEcu;
use rowscan_bus::{Bus, BusAddress};
use rowscan_emulator::clock::{SimClock, TimeScale, Timer};
use rowscan_emulator::replay::{Playback, Played, Playhead, Survey, device_of, model_of};
use rowscan_emulator::stage::Stage;
use rowscan_emulator::{Emulator, EmulatorConfig, Outlet, Player, Rig};
use rowscan_ports::clock::wall_clock_ns;
use rowscan_protocol::frame::{Dialect, encode};
use rowscan_protocol::model;
use rowscan_protocol::rig::Mount;
use rowscan_protocol::telegram::Kind;
use rowscan_recording::{
    About, Decoded, FrameReader, Recorder, RecorderOptions, Recording, Side, StreamKind, Taps, WallClock,
};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::time::{Instant, sleep_until};

/// From the subscription, with which time begins, to the first scan.
const TURN: Duration = Duration::from_millis(20);
/// The runtime's timer turns in milliseconds, once when it was recorded and once when it is played.
const TICKS: Duration = Duration::from_millis(2);

fn recorder(path: &Path) -> Recorder {
    let options = RecorderOptions { decoded: Decoded::default(), waits: true, about: About::default() };
    Recorder::start(path, options, WallClock::new(wall_clock_ns()), |error| panic!("{error}"))
        .expect("it starts")
}

/// Subscribes, and takes whatever comes.
async fn take(emulator: &mut Emulator) {
    let mut stream = connect(emulator);
    let mut frame = Vec::new();
    encode(Dialect::B, b"sEN LMDscandata \x01", &mut frame);
    stream.write_all(&frame).await.expect("taken");
    tokio::spawn(async move {
        let mut chunk = vec![0; 64 * 1024];
        while matches!(stream.read(&mut chunk).await, Ok(1..)) {}
    });
}

async fn nmea_line() -> NmeaLine {
    NmeaLine::open(&NmeaAddress::Tcp("127.0.0.1:0".to_owned()), 10.0).await.expect("a free port")
}

async fn bus(folder: &Path, name: &str) -> (Bus, rowscan_bus::Inbox) {
    // A log is written anew only where none is.
    let _ = std::fs::remove_file(folder.join(name));
    Bus::open(&[BusAddress::Candump(folder.join(name))], &mut |_| {}).await.expect("a log")
}

/// A tractor with an LMS111 and an LMS511, its receiver and its bus, for so long.
async fn record(folder: &Path, path: &Path, long: Duration) {
    let mut scene = small_scene();
    scene.rig.scanners.push(Mount { model: "lms511".to_owned(), ..Mount::default() });
    scene.rig.scanners[0].model = "lms111".to_owned();
    let stage = Stage::grow(scene, &|_, _| {}).expect("it grows");
    let tractor = stage.tractor();
    let recorder = recorder(path);
    let bus = bus(folder, "recorded.log").await;
    let mut rig = Rig::new(tractor.clone(), TimeScale::Paced(1.0));
    rig.gnss(GnssEpochs::new(tractor.clone(), stage.receiver()), vec![nmea_line().await], &recorder.taps());
    rig.bus("can0", TractorEcu::new(tractor.clone(), stage.receiver()), bus, None, &recorder.taps());
    let mut emulators = Vec::new();
    for (number, name) in ["lms111", "lms511"].into_iter().enumerate() {
        let model = model::by_name(name).expect("known");
        let (device, world) = stage.scanner_on(&tractor, number, model).expect("it fits");
        let config = EmulatorConfig { taps: recorder.taps(), ..EmulatorConfig::default() };
        let mut emulator = rig.scanner(device, world, config);
        take(&mut emulator).await;
        emulators.push(emulator);
    }
    let running = rig.run();
    tokio::time::sleep(long).await;
    drop((emulators, running));
    recorder.finish().expect("kept");
}

/// When since the first scan, and the bytes.
type Event = (Duration, Vec<u8>);

/// What was sent unasked, by stream.
#[derive(Debug, Default)]
struct PortEvent(Vec<(String, Vec<Event>)>);

impl PortEvent {
    fn read(path: &Path) -> Self {
        let mut frames = FrameReader::new(Recording::open(path).expect("it opens"));
        let mut all = Vec::new();
        while let Some(frame) = frames.next_frame().expect("it reads") {
            let unasked = match frame.kind {
                StreamKind::Cola => frame.telegram().is_some_and(|telegram| telegram.kind == Kind::Sn),
                _ => true,
            };
            if frame.from == Side::Device && unasked {
                all.push((frame.stream, frame.kind, Duration::from_nanos(frame.at_ns), frame.bytes));
            }
        }
        let first =
            all.iter().filter(|(_, kind, ..)| *kind == StreamKind::Cola).map(|(_, _, at, _)| *at).min();
        let first = first.expect("a scan");
        let streams = frames.recording().streams().iter().enumerate();
        Self(
            streams
                .map(|(number, stream)| {
                    let of = all.iter().filter(|(of, _, at, _)| *of == number && *at >= first);
                    (stream.name.clone(), of.map(|(_, _, at, bytes)| (*at - first, bytes.clone())).collect())
                })
                .collect(),
        )
    }

    fn of(&self, name: &str) -> &[Event] {
        self.0.iter().find(|(known, _)| known == name).map(|(_, events)| events.as_slice()).expect(name)
    }
}

/// The streams, by their names in the file.
const STREAMS: [&str; 4] = ["lms111", "lms511", "gnss", "can"];

/// Plays all of it, recording it again, with `steer` at the playhead; what was heard.
async fn play<S: Future<Output = ()>>(
    folder: &Path,
    path: &Path,
    (scale, played): (TimeScale, Played),
    steer: impl FnOnce(Arc<Playhead>, Arc<SimClock>, u64) -> S,
) -> PortEvent {
    let again = folder.join("again.mcap");
    let _ = std::fs::remove_file(&again);
    let recorder = recorder(&again);
    let taps: Taps = recorder.taps();
    let survey = Survey::read(path).expect("it can be played");
    let parts = survey.choose(&STREAMS.map(str::to_owned), 0).expect("all there");
    let clock = Arc::new(SimClock::start(scale));
    let begins_ns = parts.iter().filter(|part| part.is_scanner()).filter_map(|part| part.begins_ns).min();
    let begins_ns = begins_ns.expect("scans");
    let playhead = Arc::new(Playhead::new(begins_ns));
    let played = Played { from: begins_ns.into(), ..played };
    let tape = Playback::open(path.to_owned(), &parts, played).expect("it opens");
    let (mut emulators, mut outlets) = (Vec::new(), Vec::new());
    for part in &parts {
        outlets.push(match part.kind {
            StreamKind::Nmea => Outlet::nmea(&part.name, vec![nmea_line().await], scale, &taps),
            StreamKind::Can => Outlet::can(&part.name, bus(folder, "again.log").await, scale, &taps),
            _ => {
                let model = model_of(&survey, part, None).expect("told by its beams");
                let config =
                    EmulatorConfig { time_scale: scale, taps: taps.clone(), ..EmulatorConfig::default() };
                let device = device_of(part, model, None);
                let mut emulator = Emulator::replay(device, part, false, Arc::clone(&clock), config);
                let outlet = Outlet::scanner(&emulator, true);
                take(&mut emulator).await;
                emulators.push(emulator);
                outlet
            }
        });
    }
    let player = Player::start(tape, outlets, Arc::clone(&playhead), Arc::clone(&clock), &Timer::default());
    steer(playhead, clock, parts[0].first_scan_ns.expect("a scan")).await;
    if played.every_ns.is_none() {
        player.ended().await;
    }
    drop((player, emulators));
    recorder.finish().expect("kept");
    PortEvent::read(&again)
}

fn assert_close(found: Duration, expected: Duration, what: &str) {
    let apart = found.abs_diff(expected);
    assert!(apart <= TICKS, "{what}: at {found:?} instead of {expected:?}");
}

#[tokio::test(start_paused = true)]
async fn streams_recorded_together_are_played_together() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    record(folder.path(), &path, Duration::from_millis(1510)).await;
    let recorded = PortEvent::read(&path);
    // 50 Hz, 25 Hz, 10 Hz; seven kinds of frames.
    let counts = STREAMS.map(|name| recorded.of(name).len());
    assert!(counts[0] > 70 && counts[1] > 35 && counts[2] >= 14 && counts[3] > 60, "{counts:?}");

    for speed in [1.0, 4.0] {
        let heard = play(folder.path(), &path, (TimeScale::Paced(speed), played()), async |_, _, _| {}).await;
        for name in STREAMS {
            assert_eq!(heard.of(name).len(), recorded.of(name).len(), "{name} at x{speed}");
            for ((at, bytes), (recorded_at, sent)) in heard.of(name).iter().zip(recorded.of(name)) {
                assert_eq!(bytes, sent, "{name} at {at:?}");
                assert_close(*at, recorded_at.div_f64(speed), name);
            }
        }
    }

    // Half a second, a pause of ten, the rest.
    let (half, long) = (Duration::from_millis(510), Duration::from_secs(10));
    let paused = async |head: Arc<Playhead>, clock: Arc<SimClock>, _| {
        let began = Instant::now();
        sleep_until(began + half).await;
        head.pause(true, clock.now());
        sleep_until(began + half + long).await;
        head.pause(false, clock.now());
    };
    let heard = play(folder.path(), &path, (TimeScale::Paced(1.0), played()), paused).await;
    for name in STREAMS {
        assert_eq!(heard.of(name).len(), recorded.of(name).len(), "{name} over a pause");
        for ((at, bytes), (recorded_at, sent)) in heard.of(name).iter().zip(recorded.of(name)) {
            assert_eq!(bytes, sent, "{name} over a pause");
            let late = if *at < half + TICKS { Duration::ZERO } else { long };
            assert_close(*at, *recorded_at + late, name);
        }
        assert!(heard.of(name).last().is_some_and(|(at, _)| *at > long), "{name}");
    }

    // Half a second, then once more from 0.21 s on: every stream goes back, and to the same place.
    let back = Duration::from_millis(210);
    let sought = async |head: Arc<Playhead>, clock: Arc<SimClock>, first_scan_ns: u64| {
        sleep_until(Instant::now() + half).await;
        head.seek((first_scan_ns + back.as_nanos() as u64).into(), clock.now());
    };
    let heard = play(folder.path(), &path, (TimeScale::Paced(1.0), played()), sought).await;
    for name in STREAMS {
        let (all, events) = (recorded.of(name), heard.of(name));
        let rest: Vec<_> = all.iter().filter(|(at, _)| *at >= back).collect();
        let before = events.len() - rest.len();
        assert!(before > 0 && before < all.len(), "{name}: {before} of {} before it went back", all.len());
        for ((at, bytes), (recorded_at, sent)) in events[before..].iter().zip(rest) {
            assert_eq!(bytes, sent, "{name} after a seek");
            assert_close(*at, *recorded_at + half - TURN - back, name);
        }
    }

    // Over and over: the second round is as the first, in every stream, and begins for all of them at once.
    let every = Duration::from_millis(1600);
    let looped = Played { every_ns: Some(every.as_nanos() as u64), ..played() };
    let until = async |_, _, _| sleep_until(Instant::now() + every * 2 - TURN).await;
    let heard = play(folder.path(), &path, (TimeScale::Paced(1.0), looped), until).await;
    for name in STREAMS {
        let (all, events) = (recorded.of(name), heard.of(name));
        let second: Vec<_> = events.iter().filter(|(at, _)| *at + TICKS >= every).collect();
        assert_eq!(second.len(), all.len(), "{name}, played twice");
        for ((at, bytes), (recorded_at, sent)) in second.into_iter().zip(all) {
            assert_eq!(bytes, sent, "{name} in the second round");
            assert_close(*at, *recorded_at + every, name);
        }
    }
}
