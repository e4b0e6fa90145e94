//! The emulated device as its clients see it, with the host's clock frozen: events, restarts, saved settings, the field's times.

use crate::common;

use std::time::Duration;

use common::bench;
use rowscan_emulator::clock::TimeScale;
use rowscan_emulator::{Emulator, EmulatorConfig, LineChange, StateFile};
use rowscan_protocol::device::{Options, Profile, Start};
use rowscan_protocol::frame::{Accept, Dialect, FrameDecoder, encode};
use rowscan_protocol::telegram::{LmdScandata, Telegram};
use rowscan_protocol::time::SimTime;
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream};
use tokio::time::Instant;

/// A client that asks in text.
struct TextClient {
    stream: DuplexStream,
    decoder: FrameDecoder,
}

fn attach(emulator: &mut Emulator) -> TextClient {
    let (stream, there) = tokio::io::duplex(64 * 1024);
    emulator.attach(there);
    TextClient { stream, decoder: FrameDecoder::new(Accept::Only(Dialect::A), 64 * 1024) }
}

impl TextClient {
    async fn send(&mut self, text: &str) {
        let mut frame = Vec::new();
        encode(Dialect::A, text.as_bytes(), &mut frame);
        self.stream.write_all(&frame).await.expect("the link holds");
    }

    /// The next telegram; `None` when the device has dropped the link.
    async fn next(&mut self) -> Option<String> {
        loop {
            if let Some(frame) = self.decoder.next_frame() {
                return Some(String::from_utf8_lossy(frame.payload).into_owned());
            }
            let mut chunk = [0; 4096];
            match self.stream.read(&mut chunk).await {
                Ok(0) | Err(_) => return None,
                Ok(read) => self.decoder.push(&chunk[..read]),
            }
        }
    }

    /// The next telegram that begins like this.
    async fn expect(&mut self, beginning: &str) -> String {
        loop {
            let telegram = self.next().await.unwrap_or_else(|| panic!("dropped before {beginning}"));
            if telegram.starts_with(beginning) {
                return telegram;
            }
        }
    }

    async fn ask(&mut self, text: &str, beginning: &str) -> String {
        self.send(text).await;
        self.expect(beginning).await
    }

    async fn log_in(&mut self) {
        self.ask("sMN SetAccessMode 3 F4724744", "sAN SetAccessMode 1").await;
    }
}

fn scan(text: &str) -> LmdScandata {
    let telegram = Telegram::parse(Dialect::A, text.as_bytes()).expect("a telegram");
    telegram.args.decode().expect("a scan")
}

#[tokio::test(start_paused = true)]
async fn the_monitor_sends_the_same_scans_under_its_own_name() {
    let (device, world) = bench("lms111");
    let mut emulator = Emulator::start(device, world, EmulatorConfig::default());
    let mut client = attach(&mut emulator);
    client.ask("sEN LMDscandatamon 1", "sEA LMDscandatamon 1").await;
    let first = scan(&client.expect("sSN LMDscandatamon ").await);
    client.ask("sEN LMDscandata 1", "sEA LMDscandata 1").await;
    let plain = scan(&client.expect("sSN LMDscandata ").await);
    assert!(plain.telegram_counter > first.telegram_counter);
    let monitored = scan(&client.expect("sSN LMDscandatamon ").await);
    assert_eq!(plain, monitored);
    client.ask("sEN LMDscandatamon 0", "sEA LMDscandatamon 0").await;
    for _ in 0..10 {
        let telegram = client.next().await.expect("scans go on");
        assert!(telegram.starts_with("sSN LMDscandata "), "{telegram}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_line_switched_on_the_way_is_told_to_every_subscriber_and_the_poll_knows_it() {
    let (device, world) = bench("tim781");
    let at = SimTime::ZERO + Duration::from_secs(3);
    let line_changes = vec![LineChange { at, output: false, number: 2, on: true }];
    let config = EmulatorConfig { line_changes, ..EmulatorConfig::default() };
    let mut emulator = Emulator::start(device, world, config);
    let start = Instant::now();
    let mut clients = [attach(&mut emulator), attach(&mut emulator)];
    for client in &mut clients {
        client.ask("sEN LIDinputstate 1", "sEA LIDinputstate 1").await;
    }
    for client in &mut clients {
        assert_eq!(client.expect("sSN").await, "sSN LIDinputstate 0 0 0 1 0 0 0");
        // The first turn after it, at 15 Hz.
        assert!(start.elapsed().abs_diff(Duration::from_secs(3)) <= Duration::from_millis(68));
    }
    let polled = scan(&clients[0].ask("sRN LMDscandata", "sRA LMDscandata").await);
    assert_eq!(polled.inputs, [2, 0]);
}

#[tokio::test(start_paused = true)]
async fn the_encoder_counts_the_way_along_the_row() {
    let (device, world) = bench("lms111");
    let mut emulator = Emulator::start(device, world, EmulatorConfig::default());
    let mut client = attach(&mut emulator);
    client.log_in().await;
    for write in ["LICsrc 1", "LICencset 1", "LICencres +1.0", "LMDscandatacfg 01 00 0 0 0 01 00 0 0 0 0 +1"]
    {
        client.ask(&format!("sWN {write}"), "sWA").await;
    }
    client.ask("sEN LMDscandata 1", "sEA").await;
    let first = scan(&client.expect("sSN").await);
    assert_eq!(first.encoders[0].position, 0);
    let mut last = first;
    for _ in 0..100 {
        last = scan(&client.expect("sSN").await);
    }
    // 1 m/s for two seconds, counted in millimetres.
    assert_eq!(last.encoders[0].position, 2000);
    assert_eq!(last.encoders[0].speed, 1);
}

#[tokio::test(start_paused = true)]
async fn a_restart_drops_every_client_and_comes_back_with_what_was_saved() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scanner.txt");
    let options = Options { profile: Profile::Field, start: Start::Streaming, ..Options::default() };
    let (device, world) = bench("lms111");
    let mut device = device.with_options(options);
    let state = StateFile::open(&path, |text| device.restore(text)).expect("it need not exist");
    let config = EmulatorConfig { state: Some(state), ..EmulatorConfig::default() };
    let mut emulator = Emulator::start(device, world, config);
    let mut bystander = attach(&mut emulator);
    bystander.ask("sRN DeviceIdent", "sRA DeviceIdent 10 LMS10x_FieldEval").await;
    let mut client = attach(&mut emulator);
    client.log_in().await;
    client.ask("sWN LocationName 5 saved", "sWA").await;
    let start = Instant::now();
    client.ask("sMN mEEwriteall", "sAN mEEwriteall 1").await;
    assert!(start.elapsed() >= Duration::from_secs(1), "saving takes its time in the field");
    assert!(std::fs::read_to_string(&path).expect("written").contains("sWN LocationName 5 saved\n"));
    client.ask("sWN LocationName 4 lost", "sWA").await;
    client.ask("sMN mSCreboot", "sAN mSCreboot").await;
    assert_eq!(client.next().await, None);
    assert_eq!(bystander.next().await, None);

    let mut client = attach(&mut emulator);
    client.send("sRN LocationName").await;
    let silence = tokio::time::timeout(Duration::from_secs(10), client.next()).await;
    assert!(silence.is_err(), "it answered while it boots: {silence:?}");
    tokio::time::sleep(Duration::from_secs(10)).await;
    client.ask("sRN LocationName", "sRA LocationName 5 saved").await;
    client.ask("sRN STlms", "sRA STlms 1").await;
    client.ask("sEN LMDscandata 1", "sEA").await;
    let first = scan(&client.expect("sSN").await);
    assert_eq!(first.scan_counter, 4);

    let (mut other, _) = bench("lms111");
    // The emulator keeps it: another one may not.
    let taken = StateFile::open(&path, |text| other.restore(text)).expect_err("it is in use");
    assert!(taken.to_string().contains("another running scanner's"), "{taken}");
    let saved = std::fs::read_to_string(&path).expect("saved");
    other.restore(&saved).expect("settings");
    assert!(other.saved_settings().contains("sWN LocationName 5 saved\n"));
}

#[tokio::test(start_paused = true)]
async fn in_the_field_the_mirror_turns_as_slowly_as_the_recorded_one() {
    let (device, world) = bench("lms111");
    let options = Options { profile: Profile::Field, start: Start::Streaming, ..Options::default() };
    let mut emulator = Emulator::start(device.with_options(options), world, EmulatorConfig::default());
    let mut client = attach(&mut emulator);
    client.ask("sEN LMDscandata 1", "sEA").await;
    let first = scan(&client.expect("sSN").await);
    let start = Instant::now();
    let mut last = first.clone();
    for _ in 0..500 {
        last = scan(&client.expect("sSN").await);
    }
    let expected = Duration::from_nanos(500 * 20_131_500);
    assert!(start.elapsed().abs_diff(expected) <= Duration::from_millis(1), "{:?}", start.elapsed());
    let device_us = last.scan_time_us - first.scan_time_us;
    // Two stamps are off, and not five hundred periods: their standard deviation together is 0.23 ms.
    assert!(device_us.abs_diff(500 * 20_131) <= 1250, "{device_us}");
    assert_eq!(last.scan_frequency, 5000);
}

#[tokio::test(start_paused = true)]
async fn as_fast_as_it_goes_a_boot_does_not_wait_for_clients() {
    let (device, world) = bench("lms111");
    let options = Options { profile: Profile::Field, start: Start::PowerUp, ..Options::default() };
    let config = EmulatorConfig { time_scale: TimeScale::Max, ..EmulatorConfig::default() };
    let mut emulator = Emulator::start(device.with_options(options), world, config);
    let mut client = attach(&mut emulator);
    loop {
        client.send("sRN STlms").await;
        if let Ok(Some(status)) = tokio::time::timeout(Duration::from_secs(1), client.next()).await
            && status.starts_with("sRA STlms 7")
        {
            break;
        }
    }
    client.ask("sEN LMDscandata 1", "sEA").await;
    client.expect("sSN LMDscandata ").await;
}
