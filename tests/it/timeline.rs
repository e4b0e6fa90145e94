//! One timeline for a whole rig: several scanners, GNSS and CAN at full speed, what starts the drive, and who polls.

use crate::common;

use std::path::Path;
use std::time::Duration;

use common::small_scene;
use rowscan_bus::nmea::{GnssEpochs, NmeaAddress, NmeaLine, NmeaPlace};
use rowscan_bus::tractor::TractorEcu;
use rowscan_bus::{Bus, BusAddress};
use rowscan_emulator::clock::TimeScale;
use rowscan_emulator::stage::Stage;
use rowscan_emulator::{Emulator, EmulatorConfig, Rig, SerialConfig, StartWhen};
use rowscan_ports::NetLine;
use rowscan_protocol::device::{Options, Profile};
use rowscan_protocol::frame::{Accept, Dialect, FrameDecoder, encode};
use rowscan_protocol::lms2xx;
use rowscan_protocol::model;
use rowscan_protocol::rig::Mount;
use rowscan_protocol::telegram::{LmdScandata, Telegram};
use rowscan_recording::Taps;
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream};
use tokio::net::TcpStream;

/// Scans of the faster scanner in a run.
const SCANS: usize = 150;

fn attach(emulator: &mut Emulator) -> DuplexStream {
    let (here, there) = tokio::io::duplex(16 * 1024);
    emulator.attach(there);
    here
}

async fn request(stream: &mut DuplexStream, payload: &[u8]) {
    let mut frame = Vec::new();
    encode(Dialect::B, payload, &mut frame);
    stream.write_all(&frame).await.expect("taken");
}

/// The next telegram's payload, replies too.
async fn next(stream: &mut DuplexStream, decoder: &mut FrameDecoder) -> Vec<u8> {
    let mut chunk = [0; 4096];
    loop {
        if let Some(frame) = decoder.next_frame() {
            return frame.payload.to_vec();
        }
        let read = stream.read(&mut chunk).await.expect("the link holds");
        assert!(read > 0, "the link holds");
        decoder.push(&chunk[..read]);
    }
}

/// So many scan telegrams, byte for byte.
async fn scans(mut stream: DuplexStream, count: usize) -> Vec<Vec<u8>> {
    request(&mut stream, b"sEN LMDscandata \x01").await;
    let mut decoder = FrameDecoder::new(Accept::Either, 64 * 1024);
    let mut scans = Vec::new();
    while scans.len() < count {
        let payload = next(&mut stream, &mut decoder).await;
        if payload.starts_with(b"sSN LMDscandata") {
            scans.push(payload);
        }
    }
    scans
}

async fn gnss() -> (NmeaLine, TcpStream) {
    let line = NmeaLine::open(&NmeaAddress::Tcp("127.0.0.1:0".to_owned()), 10.0).await.expect("a free port");
    let NmeaPlace::Address(address) = line.place() else { panic!("a network address") };
    let client = TcpStream::connect(address).await.expect("it listens");
    while !line.has_taker() {
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
    (line, client)
}

async fn log(path: &Path) -> (Bus, rowscan_bus::Inbox) {
    Bus::open(&[BusAddress::Candump(path.to_owned())], &mut |_| {}).await.expect("a log")
}

/// Sentences until the connection ends.
fn sentences(mut client: TcpStream) -> tokio::task::JoinHandle<Vec<u8>> {
    tokio::spawn(async move {
        let mut bytes = Vec::new();
        client.read_to_end(&mut bytes).await.expect("read");
        bytes
    })
}

/// Two scanners, GNSS and CAN as fast as they go; the second client comes `late`, host time. All four streams.
async fn run(folder: &Path, name: &str, late: Duration) -> [Vec<u8>; 4] {
    let mut scene = small_scene();
    scene.rig.scanners.push(Mount { model: "lms511".to_owned(), ..Mount::default() });
    scene.rig.scanners[0].model = "lms111".to_owned();
    let stage = Stage::grow(scene, &|_, _| {}).expect("it grows");
    let tractor = stage.tractor();
    let mut rig = Rig::new(tractor.clone(), TimeScale::Max);
    let (line, client) = gnss().await;
    let heard = sentences(client);
    let log_path = folder.join(name);
    rig.gnss(GnssEpochs::new(tractor.clone(), stage.receiver()), vec![line], &Taps::default());
    let ecu = TractorEcu::new(tractor.clone(), stage.receiver());
    rig.bus("can0", ecu, log(&log_path).await, None, &Taps::default());
    let mut clients = Vec::new();
    let mut emulators = Vec::new();
    for (number, model) in ["lms111", "lms511"].into_iter().enumerate() {
        let model = model::by_name(model).expect("known");
        let (device, world) = stage.scanner_on(&tractor, number, model).expect("it fits");
        let scanner = number as u32;
        let options = Options { profile: Profile::Field, seed: 1, scanner, ..Options::default() };
        let mut emulator = rig.scanner(device.with_options(options), world, EmulatorConfig::default());
        clients.push(attach(&mut emulator));
        emulators.push(emulator);
    }
    let running = rig.run();
    let (second, first) = (clients.pop().expect("two"), clients.pop().expect("two"));
    // The slower scanner's client goes on until the faster one's has all: neither loses any.
    let second = tokio::spawn(async move {
        tokio::time::sleep(late).await;
        scans(second, SCANS / 2 - 10).await
    });
    let first = scans(first, SCANS).await;
    let second = second.await.expect("it ends");
    drop((running, emulators));
    let heard = heard.await.expect("it ends");
    let log = std::fs::read(log_path).expect("written");
    [first.concat(), second.concat(), heard, log]
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn two_scanners_gnss_and_can_at_full_speed_give_the_same_bytes_whatever_the_host_did() {
    let folder = tempfile::tempdir().expect("a folder");
    let one = run(folder.path(), "one.log", Duration::ZERO).await;
    let two = run(folder.path(), "two.log", Duration::from_millis(150)).await;
    for (stream, (one, two)) in one.iter().zip(&two).enumerate() {
        let both = one.len().min(two.len());
        // Two seconds and more of each; how far time has run beyond the last scan read is the host's.
        assert!(both > 4000, "stream {stream}: {both} bytes");
        let differs = one[..both].iter().zip(&two[..both]).position(|(a, b)| a != b);
        assert_eq!(differs, None, "stream {stream} of {both} bytes");
    }
}

#[tokio::test]
async fn at_full_speed_nothing_is_sent_before_every_scanner_has_a_client() {
    let mut scene = small_scene();
    scene.rig.scanners.push(scene.rig.scanners[0].clone());
    let stage = Stage::grow(scene, &|_, _| {}).expect("it grows");
    let tractor = stage.tractor();
    let mut rig = Rig::new(tractor.clone(), TimeScale::Max);
    let (line, mut client) = gnss().await;
    rig.gnss(GnssEpochs::new(tractor.clone(), stage.receiver()), vec![line], &Taps::default());
    let model = model::by_name("lms111").expect("known");
    let mut emulators: Vec<Emulator> = (0..2)
        .map(|number| {
            let (device, world) = stage.scanner_on(&tractor, number, model).expect("it fits");
            rig.scanner(device, world, EmulatorConfig::default())
        })
        .collect();
    let _running = rig.run();
    let first = tokio::spawn(scans(attach(&mut emulators[0]), 20));
    let mut sentence = [0; 64];
    let early = tokio::time::timeout(Duration::from_millis(200), client.read(&mut sentence)).await;
    assert!(early.is_err(), "no sentence before the start");
    assert!(!first.is_finished(), "no scan before the start");
    assert_eq!(tractor.began(), None);
    let second = scans(attach(&mut emulators[1]), 20).await;
    assert_eq!((first.await.expect("it ends").len(), second.len()), (20, 20));
    assert!(client.read(&mut sentence).await.expect("sentences") > 0);
}

/// `polls` scans, one request each: their counters, and how many of them differ from the one before in their ranges.
async fn poll(emulator: &mut Emulator, polls: usize) -> (Vec<u16>, usize) {
    let mut stream = attach(emulator);
    let mut decoder = FrameDecoder::new(Accept::Either, 64 * 1024);
    let mut found: Vec<LmdScandata> = Vec::new();
    for _ in 0..polls {
        request(&mut stream, b"sRN LMDscandata").await;
        let payload = next(&mut stream, &mut decoder).await;
        let telegram = Telegram::parse(Dialect::B, &payload).expect("a telegram");
        found.push(telegram.args.decode().expect("a scan"));
    }
    let differ = found.windows(2).filter(|two| two[0].channels16 != two[1].channels16).count();
    (found.iter().map(|scan| scan.telegram_counter).collect(), differ)
}

#[tokio::test]
async fn each_poll_at_full_speed_takes_the_next_scan_and_drives_on() {
    let (device, world) = common::bench("lms111");
    let config = EmulatorConfig { time_scale: TimeScale::Max, ..EmulatorConfig::default() };
    let mut emulator = Emulator::start(device, world, config);
    // The device has a scan to tell from its first turn on.
    tokio::time::sleep(Duration::from_millis(10)).await;
    let (counters, differ) = poll(&mut emulator, 60).await;
    assert!(counters.windows(2).all(|two| two[1] == two[0].wrapping_add(1)), "{counters:?}");
    assert!(differ > 20, "the tractor drives: {differ} of 59 scans differ from the one before");
}

#[tokio::test(start_paused = true)]
async fn a_client_that_only_polls_moves_the_tractor_on_a_paced_clock() {
    let (device, world) = common::bench("lms111");
    let tractor = world.tractor().clone();
    let mut emulator = Emulator::start(device, world, EmulatorConfig::default());
    tokio::time::sleep(Duration::from_secs(1)).await;
    assert_eq!(tractor.began(), None, "nobody has polled yet");
    let mut stream = attach(&mut emulator);
    let mut decoder = FrameDecoder::new(Accept::Either, 64 * 1024);
    let mut seen = Vec::new();
    for _ in 0..20 {
        request(&mut stream, b"sRN LMDscandata").await;
        seen.push(next(&mut stream, &mut decoder).await);
        tokio::time::sleep(Duration::from_millis(200)).await;
    }
    assert!(tractor.began().is_some());
    let ranges = |payload: &Vec<u8>| {
        let telegram = Telegram::parse(Dialect::B, payload).expect("a telegram");
        telegram.args.decode::<LmdScandata>().expect("a scan").channels16
    };
    let first = ranges(&seen[0]);
    assert!(seen.iter().skip(5).all(|payload| ranges(payload) != first), "the row passes by");
}

/// The tractor has been on its bus for long, whatever the clock: who judges a controller by the first metres gives it the speed of them.
#[tokio::test(start_paused = true)]
async fn speeds_are_on_the_bus_from_the_start_of_the_drive_on() {
    for scale in [TimeScale::Max, TimeScale::Paced(1.0), TimeScale::Paced(4.0)] {
        let stage = Stage::grow(small_scene(), &|_, _| {}).expect("it grows");
        let tractor = stage.tractor();
        let mut rig = Rig::new(tractor.clone(), scale);
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("can");
        let ecu = TractorEcu::new(tractor.clone(), stage.receiver());
        rig.bus("can0", ecu, log(&path).await, None, &Taps::default());
        let (device, world) =
            stage.scanner_on(&tractor, 0, model::by_name("lms111").expect("known")).expect("fits");
        let mut emulator = rig.scanner(device, world, EmulatorConfig::default());
        let client = attach(&mut emulator);
        let running = rig.run();
        scans(client, 50).await;
        drop((running, emulator));
        let told = std::fs::read_to_string(&path).expect("written");
        let first_s = |pgn: &str| {
            let line =
                told.lines().find(|line| line.contains(pgn)).unwrap_or_else(|| panic!("no {pgn}: {told}"));
            line[1..].split(')').next().and_then(|time| time.parse::<f64>().ok()).expect("a time")
        };
        let (claimed_s, speed_s) = (first_s("EEFFF0#"), first_s("FE48F0#"));
        assert!((0.0..=0.1).contains(&(speed_s - claimed_s)), "{scale:?}: {claimed_s} {speed_s}");
    }
}

#[tokio::test]
async fn a_rig_without_a_scanner_starts_with_its_first_client() {
    let stage = Stage::grow(small_scene(), &|_, _| {}).expect("it grows");
    let tractor = stage.tractor();
    let mut rig = Rig::new(tractor.clone(), TimeScale::Max);
    let line = NmeaLine::open(&NmeaAddress::Tcp("127.0.0.1:0".to_owned()), 10.0).await.expect("a free port");
    let NmeaPlace::Address(address) = *line.place() else { panic!("a network address") };
    rig.gnss(GnssEpochs::new(tractor.clone(), stage.receiver()), vec![line], &Taps::default());
    let _running = rig.run();
    tokio::time::sleep(Duration::from_millis(50)).await;
    assert_eq!(tractor.began(), None);
    let mut client = TcpStream::connect(address).await.expect("it listens");
    let mut bytes = vec![0; 20_000];
    client.read_exact(&mut bytes).await.expect("sentences");
    assert!(tractor.began().is_some());
    let text = String::from_utf8(bytes).expect("text");
    let speeds: Vec<&str> = text.lines().filter(|line| line.starts_with("$GNVTG")).collect();
    assert!(
        speeds.len() > 20 && speeds.iter().skip(2).all(|line| line.contains(",3.6")),
        "{:?}",
        speeds.get(3)
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn gnss_beside_an_lms2xx_at_full_speed_waits_for_the_lines_client() {
    let stage = Stage::grow(small_scene(), &|_, _| {}).expect("it grows");
    let tractor = stage.tractor();
    let mut rig = Rig::new(tractor.clone(), TimeScale::Max);
    let (line, mut client) = gnss().await;
    rig.gnss(GnssEpochs::new(tractor.clone(), stage.receiver()), vec![line], &Taps::default());
    let options = lms2xx::device::Options { pause_slack: Duration::from_secs(3600), ..Default::default() };
    let model = lms2xx::model::MODELS.iter().copied().find(|model| model.name == "lms291").expect("known");
    let (device, world) = stage.serial_scanner_on(&tractor, 0, model, options).expect("it fits");
    let wire = NetLine::bare("127.0.0.1:0").await.expect("a free port");
    let address = wire.address();
    let config = SerialConfig::at(TimeScale::Max);
    let scanner = rig.lms2xx(device, world, Box::new(wire), config);
    let _running = rig.run();
    let mut sentence = [0; 4096];
    let early = tokio::time::timeout(Duration::from_millis(100), client.read(&mut sentence)).await;
    assert!(early.is_err(), "no sentence before the start");
    // Continuous output: 02 00 02 00 20 24 and its checksum.
    let mut host = TcpStream::connect(address).await.expect("it listens");
    host.write_all(&[0x02, 0x00, 0x02, 0x00, 0x20, 0x24, 0x34, 0x08]).await.expect("taken");
    let mut bytes = vec![0; 100_000];
    let reader = tokio::spawn(async move { host.read_exact(&mut bytes).await.map(|_| host) });
    assert!(client.read(&mut sentence).await.expect("sentences") > 0);
    reader.await.expect("it ends").expect("scans");
    assert!(scanner.counts().scans_sent > 50);
    assert!(tractor.began().is_some());
}

#[test]
fn a_start_is_one_of_three_words() {
    for (name, start) in StartWhen::CHOICES {
        assert_eq!(name.parse(), Ok(start));
        assert_eq!(start.to_string(), name);
    }
    let message = "later".parse::<StartWhen>().expect_err("no start").to_string();
    assert_eq!(message, "expected `first`, `all` or `now`, found `later`");
}
