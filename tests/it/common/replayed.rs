//! Recordings made for tests, and the devices they become again.

use std::io::Cursor;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use rowscan_emulator::clock::{SimClock, TimeScale, Timer};
use rowscan_emulator::replay::{Moment, Playback, Played, Playhead, Stamps, Survey, device_of, model_of};
use rowscan_emulator::{Emulator, EmulatorConfig, Outlet, Player};
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::model;
use rowscan_recording::{About, Decoded, McapWriter, Recording, Side, StreamKind, Taps};
use serde_json::Value;
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream};

/// A packet: when, since the recording began, who sent it, what.
pub type Packets = Vec<(Duration, Side, Vec<u8>)>;

/// A recording of the facts, packet by packet as its index has them.
pub fn recorded(folder: &Path, name: &str) -> Packets {
    let read = |suffix: &str| std::fs::read(folder.join(format!("{name}{suffix}"))).expect("recorded");
    let about: Value = serde_json::from_slice(&read(".json")).expect("json");
    let (to_device, to_host) = (read(".h2d.bin"), read(".d2h.bin"));
    let place = |value: &Value| usize::try_from(value.as_u64().expect("a place")).expect("small");
    let packet = |at: &Value| {
        let (from, bytes) = if at[1] == "d2h" { (Side::Device, &to_host) } else { (Side::Host, &to_device) };
        let (offset, len) = (place(&at[2]), place(&at[3]));
        (Duration::from_secs_f64(at[0].as_f64().expect("a time")), from, bytes[offset..offset + len].to_vec())
    };
    about["index"].as_array().expect("listed").iter().map(packet).collect()
}

pub fn write(path: &Path, packets: &Packets) {
    let mut writer =
        McapWriter::new(Cursor::new(Vec::new()), &About::default(), Decoded::default()).expect("begun");
    let stream = writer.add_stream("scanner", StreamKind::Cola).expect("added");
    for (at, from, bytes) in packets {
        let at_ns = 1_700_000_000_000_000_000 + at.as_nanos() as u64;
        writer.write(stream, *from, at_ns, 0, bytes).expect("written");
    }
    writer.finish().expect("finished");
    std::fs::write(path, writer.into_inner().into_inner()).expect("kept");
}

pub fn sent_by(from: Side, path: &Path) -> Vec<u8> {
    let mut recording = Recording::open(path).expect("it opens");
    let mut bytes = Vec::new();
    while let Some(packet) = recording.next_packet().expect("it reads") {
        if packet.from == Some(from) {
            bytes.extend(packet.bytes);
        }
    }
    assert_eq!(recording.torn(), None);
    bytes
}

/// A recording being replayed.
pub struct Replayed {
    pub emulator: Emulator,
    pub player: Player,
    pub clock: Arc<SimClock>,
    pub playhead: Arc<Playhead>,
}

pub fn played() -> Played {
    Played {
        from: Moment::default(),
        until: Moment::END,
        every_ns: None,
        stamps: Stamps::Keep,
        verbatim: false,
    }
}

pub fn replay(path: &Path, model: Option<&str>, scale: TimeScale, played: Played, taps: Taps) -> Replayed {
    let clock = Arc::new(SimClock::start(scale));
    replay_through(path, model, clock, played, EmulatorConfig { taps, ..EmulatorConfig::default() })
}

/// The same on this clock, and through what else the scanner is set up with.
pub fn replay_through(
    path: &Path,
    model: Option<&str>,
    clock: Arc<SimClock>,
    played: Played,
    config: EmulatorConfig,
) -> Replayed {
    let survey = Survey::read(path).expect("it can be played");
    let parts = survey.choose(&[], 1).expect("there is something");
    let part = parts[0];
    let model =
        model_of(&survey, part, model.map(|name| model::by_name(name).expect("known"))).expect("a model");
    let playhead = Arc::new(Playhead::new(part.begins_ns.expect("events").max(played.from.at_ns)));
    let tape = Playback::open(path.to_owned(), &parts, played).expect("it opens");
    let config = EmulatorConfig { time_scale: clock.scale(), ..config };
    let faults = config.faults.clone();
    let emulator =
        Emulator::replay(device_of(part, model, None), part, played.verbatim, Arc::clone(&clock), config);
    let outlets = vec![Outlet::scanner(&emulator, part.scans > 0).through(faults)];
    let player = Player::start(tape, outlets, Arc::clone(&playhead), Arc::clone(&clock), &Timer::default());
    Replayed { emulator, player, clock, playhead }
}

pub fn connect(emulator: &mut Emulator) -> DuplexStream {
    let (here, there) = tokio::io::duplex(64 * 1024);
    emulator.attach(there);
    here
}

/// A recording of events that are a second apart.
pub fn ticking(path: &Path, seconds: u64) {
    ticking_in_clumps(path, seconds, 1);
}

/// The same; so many of them came at once.
pub fn ticking_in_clumps(path: &Path, seconds: u64, clump: u64) {
    let scan = |counter: u16| {
        let mut bytes = Vec::new();
        let body = format!(
            "sSN LMDscandata 1 1 16F4C7A 0 0 {counter:X} {counter:X} {:X} {:X} 0 0 4 0 0 1388 168 0 1 DIST1 3F800000 00000000 FFF92230 1388 3 \
             3E8 0 7D0 0 0 0 0 0 0",
            u32::from(counter) * 1_000_000,
            u32::from(counter) * 1_000_000 + 250
        );
        rowscan_protocol::frame::encode(Dialect::A, body.as_bytes(), &mut bytes);
        bytes
    };
    let packets = (0..seconds)
        .map(|s| (Duration::from_secs(s / clump * clump), Side::Device, scan(s as u16)))
        .collect();
    write(path, &packets);
}

pub async fn subscribed(replayed: &mut Replayed) -> DuplexStream {
    let mut client = connect(&mut replayed.emulator);
    client.write_all(b"\x02sEN LMDscandata 1\x03").await.expect("taken");
    let mut reply = [0; 19];
    client.read_exact(&mut reply).await.expect("answered");
    assert_eq!(&reply, b"\x02sEA LMDscandata 1\x03");
    client
}

/// The next scan's telegram counter and device time.
pub async fn next_scan(client: &mut DuplexStream) -> (u16, u32) {
    let mut frame = Vec::new();
    while client.read_u8().await.expect("a byte") != 2 {}
    loop {
        match client.read_u8().await.expect("a byte") {
            3 => break,
            byte => frame.push(byte),
        }
    }
    let text = String::from_utf8(frame).expect("text");
    let number = |i: usize| u32::from_str_radix(text.split(' ').nth(i).expect("there"), 16).expect("hex");
    (number(7) as u16, number(9))
}
