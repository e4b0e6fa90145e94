//! Emulated runs of every model on every line it has, recorded, replayed on the same kind of line and recorded again: the same bytes from
//! the device. As fast as the client takes them.
#![cfg(target_os = "linux")]

use crate::common;

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use common::replayed::{played, replay, sent_by};
use common::small_scene;
use rowscan_driver::{Connection, ConnectionEvent, DriverConfig, Scanner, Source};
use rowscan_emulator::clock::{SimClock, TimeScale, Timer};
use rowscan_emulator::replay::{Playback, Playhead, Survey, lms2xx_device_of, lms2xx_model_of};
use rowscan_emulator::stage::Stage;
use rowscan_emulator::{Emulator, EmulatorConfig, Outlet, Player, SerialConfig, SerialEmulator};
use rowscan_ports::clock::wall_clock_ns;
use rowscan_ports::{NetLine, Port, Pty, Wire};
use rowscan_protocol::client::{ColaClient, ColaConfig};
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::host::{HostEvent, HostSession, Transmit};
use rowscan_protocol::lms2xx::client::{Lms2xxClient, Lms2xxConfig};
use rowscan_protocol::lms2xx::device::Options;
use rowscan_protocol::lms2xx::{Rate, model as lms2xx_model};
use rowscan_protocol::model::MODELS;
use rowscan_recording::{About, Decoded, Recorder, RecorderOptions, Side, WallClock};
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::task::JoinSet;
use tokio::time::{Instant, timeout};

/// Scans a run must hold.
const SCANS: usize = 8;

#[derive(Clone, Copy, Debug)]
enum Line {
    Tcp,
    Pty,
}

const LINES: [Line; 2] = [Line::Tcp, Line::Pty];

trait Stream: AsyncRead + AsyncWrite + Unpin + Send {}
impl<S: AsyncRead + AsyncWrite + Unpin + Send> Stream for S {}

fn recorder(path: &Path) -> Recorder {
    let options = RecorderOptions { decoded: Decoded::default(), waits: true, about: About::default() };
    Recorder::start(path, options, WallClock::new(wall_clock_ns()), |error| panic!("{error}"))
        .expect("it starts")
}

/// Both files' device bytes, as far as both go: either may hold scans that were on their way when its client left.
fn assert_same(name: &str, x: &Path, y: &Path) {
    let (expected, found) = (sent_by(Side::Device, x), sent_by(Side::Device, y));
    let both = found.len().min(expected.len());
    assert!(both > SCANS * 300, "{name}: {} and {} bytes", expected.len(), found.len());
    let differs = found.iter().zip(&expected).position(|(a, b)| a != b);
    if let Some(at) = differs {
        let around =
            |bytes: &[u8]| bytes[at.saturating_sub(40)..(at + 40).min(both)].escape_ascii().to_string();
        panic!("{name} differs at {at} of {both}:\n{}\n{}", around(&found), around(&expected));
    }
}

/// Sets a CoLa scanner up on a line of its own and takes its scans.
async fn take(emulator: &mut Emulator, line: Line, link: &Path) {
    let stream: Box<dyn Stream> = match line {
        Line::Tcp => {
            let bound = emulator.listen("127.0.0.1:0").await.expect("a free port");
            Box::new(TcpStream::connect(bound.address).await.expect("it listens"))
        }
        Line::Pty => {
            emulator.attach(Pty::open(link).expect("a pseudo-terminal"));
            Box::new(Port::open(link, 57_600).expect("it opens"))
        }
    };
    let mut connection = Connection::new(stream, ColaClient::new(ColaConfig::default(), Dialect::B));
    let mut scans = 0;
    while scans < SCANS {
        match connection.next_event(None).await.expect("the link holds") {
            ConnectionEvent::Session(HostEvent::Scan) => scans += 1,
            ConnectionEvent::Session(HostEvent::Ready(_)) => {}
            other => panic!("{line:?}: {other:?}"),
        }
    }
}

#[tokio::test]
async fn every_cola_model_on_tcp_and_on_a_pseudo_terminal() {
    let stage = Arc::new(Stage::grow(small_scene(), &|_, _| {}).expect("it grows"));
    let mut runs = JoinSet::new();
    for (model, line) in MODELS.iter().flat_map(|model| LINES.map(|line| (*model, line))) {
        let stage = Arc::clone(&stage);
        runs.spawn(async move {
            let folder = tempfile::tempdir().expect("a folder");
            let (x, y) = (folder.path().join("x.mcap"), folder.path().join("y.mcap"));
            let first = recorder(&x);
            let (device, world) = stage.scanner(0, model).expect("it fits");
            let config = EmulatorConfig {
                taps: first.taps(),
                time_scale: TimeScale::Max,
                ..EmulatorConfig::default()
            };
            let mut emulator = Emulator::start(device, world, config);
            take(&mut emulator, line, &folder.path().join("first")).await;
            drop(emulator);
            first.finish().expect("kept");
            let second = recorder(&y);
            let mut replayed = replay(&x, None, TimeScale::Max, played(), second.taps());
            take(&mut replayed.emulator, line, &folder.path().join("second")).await;
            drop(replayed);
            second.finish().expect("kept");
            assert_same(&format!("{} on {line:?}", model.name), &x, &y);
        });
    }
    let mut done = 0;
    while let Some(ended) = runs.join_next().await {
        ended.expect("the same bytes");
        done += 1;
    }
    assert_eq!(done, 2 * MODELS.len());
}

/// The scanner's end of a line, and how it is reached.
async fn open(line: Line, link: &Path) -> (Box<dyn Wire>, String) {
    match line {
        Line::Tcp => {
            let line = NetLine::bare("127.0.0.1:0").await.expect("a free port");
            let address = line.address().to_string();
            (Box::new(line), address)
        }
        Line::Pty => {
            let path = link.display().to_string();
            (Box::new(Pty::open(link).expect("a pseudo-terminal")), path)
        }
    }
}

/// Sets an LMS2xx up and takes its scans: by the driver on a serial port, by the bare session over TCP.
async fn take_lms2xx(line: Line, place: &str) {
    match line {
        Line::Pty => {
            let source = Source::Serial { path: place.into(), rate: Rate::R38400 };
            let mut scanner = Scanner::open(&source, DriverConfig::default()).await.expect("it streams");
            for _ in 0..SCANS {
                scanner.next().await.expect("it goes on").expect("a scan");
            }
        }
        Line::Tcp => {
            let mut stream = TcpStream::connect(place).await.expect("it listens");
            let mut client = Lms2xxClient::new(Lms2xxConfig::default());
            let (began, mut scans, mut chunk) = (Instant::now(), 0, vec![0; 4096]);
            client.handle_bytes(Duration::ZERO, b"");
            while scans < SCANS {
                while let Some(event) = client.poll_event() {
                    match event {
                        HostEvent::Scan => scans += 1,
                        HostEvent::Ready(_) => {}
                        other => panic!("{other:?}"),
                    }
                }
                while let Some(transmit) = client.poll_transmit() {
                    if let Transmit::Frame(frame) = transmit {
                        stream.write_all(&frame).await.expect("taken");
                    }
                }
                let patience = client.poll_timeout().map(|due| due.saturating_sub(began.elapsed()));
                match timeout(patience.unwrap_or(Duration::from_secs(30)), stream.read(&mut chunk)).await {
                    Ok(read) => client.handle_bytes(began.elapsed(), &chunk[..read.expect("it holds")]),
                    Err(_) => client.handle_timeout(began.elapsed()),
                }
            }
        }
    }
}

#[tokio::test]
async fn every_lms2xx_on_a_bare_line_and_on_a_pseudo_terminal() {
    let stage = Arc::new(Stage::grow(small_scene(), &|_, _| {}).expect("it grows"));
    let mut runs = JoinSet::new();
    for (model, line) in lms2xx_model::MODELS.iter().flat_map(|model| LINES.map(|line| (*model, line))) {
        let stage = Arc::clone(&stage);
        runs.spawn(async move {
            let folder = tempfile::tempdir().expect("a folder");
            let (x, y) = (folder.path().join("x.mcap"), folder.path().join("y.mcap"));
            // Time stands still between requests: any pause is no pause.
            let options = Options { pause_slack: Duration::MAX / 4, ..Options::default() };
            let first = recorder(&x);
            let (device, world) = stage.serial_scanner(0, model, options).expect("it fits");
            let config = SerialConfig { taps: first.taps(), ..SerialConfig::at(TimeScale::Max) };
            let (wire, place) = open(line, &folder.path().join("first")).await;
            let emulator = SerialEmulator::start(device, world, wire, config);
            take_lms2xx(line, &place).await;
            drop(emulator);
            first.finish().expect("kept");

            let second = recorder(&y);
            let survey = Survey::read(&x).expect("it can be played");
            let parts = survey.choose(&[], 1).expect("there is something");
            let found = lms2xx_model_of(&survey, parts[0], None).expect("told");
            assert_eq!(found.name, model.name);
            let clock = Arc::new(SimClock::start(TimeScale::Max));
            let playhead = Arc::new(Playhead::new(parts[0].begins_ns.expect("scans")));
            let tape = Playback::open(x.clone(), &parts, played()).expect("it opens");
            let config = SerialConfig { taps: second.taps(), ..SerialConfig::at(TimeScale::Max) };
            let (wire, place) = open(line, &folder.path().join("second")).await;
            let device = lms2xx_device_of(parts[0], found, options);
            let emulator = SerialEmulator::replay(device, &parts[0].name, wire, Arc::clone(&clock), config);
            let outlets = vec![Outlet::lms2xx(&emulator, parts[0]).expect("replayed")];
            let player = Player::start(tape, outlets, playhead, clock, &Timer::default());
            take_lms2xx(line, &place).await;
            drop((player, emulator));
            second.finish().expect("kept");
            assert_same(&format!("{} on {line:?}", model.name), &x, &y);
        });
    }
    while let Some(ended) = runs.join_next().await {
        ended.expect("the same bytes");
    }
}
