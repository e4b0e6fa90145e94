//! A recording played as live devices over loopback TCP: how late its telegrams come against the recorded times.
//!
//! The recorded times are those of a scanner on a host that delays it: up to 3 ms beside the mirror's. The player has one thread, its clients
//! another; lateness is host time from the instant a telegram is due until its client has read all of it. A third thread sleeps to
//! the same deadlines meanwhile and does nothing else: what it is late by is the machine's doing.

use std::io::Cursor;
use std::path::Path;
use std::sync::{Arc, mpsc};
use std::thread;
use std::time::{Duration, Instant};

use rowscan_bus::nmea::{NmeaAddress, NmeaLine};
use rowscan_bus::{Bus, BusAddress};
use rowscan_emulator::clock::{SimClock, TimeScale, Timer};
use rowscan_emulator::offline::Offline;
use rowscan_emulator::replay::{Moment, Playback, Played, Playhead, Stamps, Survey, device_of};
use rowscan_emulator::stage::Stage;
use rowscan_emulator::{Emulator, EmulatorConfig, Outlet, Player};
use rowscan_protocol::device::scan_event;
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::model;
use rowscan_protocol::time::SimTime;
use rowscan_recording::{About, Decoded, McapWriter, Side, StreamKind, Taps};

use crate::loopback::{CONTROL, lateness, quantile_ms, runtime, sleep_to, subscribe};
use crate::measure::{Case, Report};

/// How long is recorded.
const LONG: Duration = Duration::from_secs(10);
const EPOCH_NS: u64 = 1_700_000_000_000_000_000;
const EPOCH_OF_NMEA: &[u8] =
    b"$GNGGA,101500.00,4136.0000000,N,00050.4000000,E,4,12,0.6,250.125,M,50.5,M,1.0,0000*4D\r\n";

/// Runs all cases.
pub fn run(report: &mut Report, _: &[String]) {
    let folder = std::env::temp_dir().join(format!("rowscan-benches-replay-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    for (name, streams) in
        [("LMS111 at 50 Hz", &STREAMS[..1]), ("LMS111 and LMS511 with GNSS and CAN in step", &STREAMS[..])]
    {
        let path = folder.join("run.mcap");
        let deadlines = record(&path, streams);
        measure(report, name, &folder, &path, streams, deadlines);
    }
    let _ = std::fs::remove_dir_all(&folder);
}

/// A recorded stream: its name, which is its model's if it has one, and how often it speaks.
struct Stream {
    name: &'static str,
    kind: StreamKind,
    period: Duration,
}

const STREAMS: [Stream; 4] = [
    Stream { name: "lms111", kind: StreamKind::Cola, period: Duration::from_millis(20) },
    Stream { name: "lms511", kind: StreamKind::Cola, period: Duration::from_millis(40) },
    Stream { name: "gnss", kind: StreamKind::Nmea, period: Duration::from_millis(100) },
    Stream { name: "can", kind: StreamKind::Can, period: Duration::from_millis(14) },
];

/// Writes the recording; when the first stream spoke, since its beginning.
fn record(path: &Path, streams: &[Stream]) -> Vec<Duration> {
    let scene = rowscan_scenes::files::load_scene("spindle", |_| {}).expect("a built-in scene");
    let stage = Stage::grow(scene, &|_, _| {}).expect("it grows");
    let mut packets = Vec::new();
    for (number, stream) in streams.iter().enumerate() {
        let mut scanner = model::by_name(stream.name).map(|model| {
            let (device, world) = stage.scanner(0, model).expect("it fits");
            Offline::new(device, world)
        });
        let mut random = 12_345_u64;
        for turn in 1..LONG.div_duration_f64(stream.period) as u32 {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let delay = Duration::from_nanos((random >> 33) % 3_000_000);
            let mut bytes = Vec::new();
            match (&mut scanner, stream.kind) {
                (Some(scanner), _) => {
                    if let Some(scan) = scanner.telegram() {
                        scan_event(Dialect::B, scan, &mut bytes);
                    }
                }
                (None, StreamKind::Can) => bytes.extend_from_slice(b"0CFE4980#0011223344556677"),
                (None, _) => bytes.extend_from_slice(EPOCH_OF_NMEA),
            }
            packets.push((stream.period * turn + delay, number, bytes));
        }
    }
    packets.sort_by_key(|(at, ..)| *at);
    let mut writer =
        McapWriter::new(Cursor::new(Vec::new()), &About::default(), Decoded::default()).expect("begun");
    let ids: Vec<_> =
        streams.iter().map(|stream| writer.add_stream(stream.name, stream.kind).expect("added")).collect();
    for (at, number, bytes) in &packets {
        writer.write(ids[*number], Side::Device, EPOCH_NS + at.as_nanos() as u64, 0, bytes).expect("written");
    }
    writer.finish().expect("finished");
    std::fs::write(path, writer.into_inner().into_inner()).expect("kept");
    let first = packets.iter().find(|(_, number, _)| *number == 0).map(|(at, ..)| *at).expect("scans");
    packets.iter().filter(|(_, number, _)| *number == 0).map(|(at, ..)| *at - first).collect()
}

/// What the clients need: where the scanners listen, and when simulated time began.
struct Berth {
    addresses: Vec<String>,
    epoch: Instant,
}

fn measure(
    report: &mut Report,
    name: &str,
    folder: &Path,
    path: &Path,
    streams: &[Stream],
    deadlines: Vec<Duration>,
) {
    let (tell, told) = mpsc::channel::<Berth>();
    let scans = deadlines.len();
    thread::scope(|threads| {
        let player = threads.spawn(move || runtime().block_on(play(folder, path, streams, tell)));
        let berth = told.recv().expect("it plays");
        let control = threads.spawn(move || sleep_to(deadlines));
        let clients: Vec<_> = berth
            .addresses
            .into_iter()
            .map(|address| threads.spawn(move || runtime().block_on(take(&address, berth.epoch))))
            .collect();
        let lateness: Vec<Vec<Duration>> =
            clients.into_iter().map(|client| client.join().expect("a client ends well")).collect();
        let beside = player.join().expect("the player ends well");
        let control = control.join().expect("the control ends well");
        let case = |what: &str, unit, peer| Case {
            name: format!("{name}: {what}"),
            unit,
            peer,
            threads: 1,
            work: [0.0; 2],
        };
        let taken = lateness[0].len() as f64 / scans as f64;
        report.more_is_better(&case("scans taken", "of those recorded", "all"), taken, 1.0);
        for (stream, lateness) in streams.iter().zip(&lateness) {
            for (what, fraction) in [("lateness p50", 0.5), ("lateness p99", 0.99)] {
                let what = format!("{}, {what}", stream.name);
                let (ours, control) = (quantile_ms(lateness, fraction), quantile_ms(&control, fraction));
                report.less_is_better(&case(&what, "ms", CONTROL), ours, control);
            }
        }
        for (name, p50_p99) in beside {
            for (what, fraction, ours) in [("p50", 0.5, p50_p99[0]), ("p99", 0.99, p50_p99[1])] {
                let what = format!("{name}, lateness {what}");
                let (ours, control) = (ours.as_secs_f64() * 1e3, quantile_ms(&control, fraction));
                report.less_is_better(&case(&what, "ms", CONTROL), ours, control);
            }
        }
    });
}

/// Plays to the end; how late the streams beside the scanners went out (p50, p99).
async fn play(
    folder: &Path,
    path: &Path,
    streams: &[Stream],
    tell: mpsc::Sender<Berth>,
) -> Vec<(&'static str, [Duration; 2])> {
    let survey = Survey::read(path).expect("it reads");
    let names: Vec<String> = streams.iter().map(|stream| stream.name.to_owned()).collect();
    let parts = survey.choose(&names, names.len()).expect("all there");
    let scale = TimeScale::Paced(1.0);
    let clock = Arc::new(SimClock::start(scale));
    let begins_ns = parts[0].begins_ns.expect("scans");
    let played = Played {
        from: begins_ns.into(),
        until: Moment::END,
        every_ns: None,
        // So that every scan tells when it was due.
        stamps: Stamps::Now,
        verbatim: false,
    };
    let tape = Playback::open(path.to_owned(), &parts, played).expect("it opens");
    let (mut emulators, mut outlets, mut addresses) = (Vec::new(), Vec::new(), Vec::new());
    for part in &parts {
        outlets.push(match part.kind {
            StreamKind::Nmea => {
                let place = NmeaAddress::Tcp("127.0.0.1:0".to_owned());
                let line = NmeaLine::open(&place, 0.0).await.expect("a free port");
                Outlet::nmea(&part.name, vec![line], scale, &Taps::default())
            }
            StreamKind::Can => {
                let port = BusAddress::Candump(folder.join("bus.log"));
                let bus = Bus::open(&[port], &mut |_| {}).await.expect("a log");
                Outlet::can(&part.name, bus, scale, &Taps::default())
            }
            _ => {
                let device = device_of(part, model::by_name(&part.name).expect("a model"), None);
                let config = EmulatorConfig { time_scale: scale, ..EmulatorConfig::default() };
                let mut emulator = Emulator::replay(device, part, false, Arc::clone(&clock), config);
                addresses
                    .push(emulator.listen("127.0.0.1:0").await.expect("a free port").address.to_string());
                let outlet = Outlet::scanner(&emulator, true);
                emulators.push(emulator);
                outlet
            }
        });
    }
    let epoch = clock.due(SimTime::ZERO).expect("a paced clock");
    let playhead = Arc::new(Playhead::new(begins_ns));
    let player = Player::start(tape, outlets, playhead, clock, &Timer::system());
    tell.send(Berth { addresses, epoch }).expect("the clients wait");
    player.ended().await;
    let beside = streams.iter().enumerate().filter(|(_, stream)| stream.kind != StreamKind::Cola);
    let late = |number, fraction| player.lateness(number, fraction).unwrap_or_default();
    beside.map(|(number, stream)| (stream.name, [late(number, 0.5), late(number, 0.99)])).collect()
}

/// Subscribes and reads to the end; how late each scan came.
async fn take(address: &str, epoch: Instant) -> Vec<Duration> {
    lateness(subscribe(address).await, epoch, epoch..epoch + 10 * LONG, |scan| scan.transmit_time_us).await
}
