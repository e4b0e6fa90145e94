//! Reads files that were changed at random, of every format, in one process: `cargo run --release --example mutations --features compressed -- COUNT SEED`, under a
//! limit of memory such as `ulimit -v 1000000`. It ends with a line a format: how many were read, torn, refused, and the longest time one took.
#![allow(clippy::print_stdout, reason = "an example prints")]

use std::collections::BTreeMap;
use std::io::{Cursor, Write};
use std::time::{Duration, Instant};

use rowscan_protocol::frame::{Dialect, encode};
use rowscan_protocol::lms2xx::frame::FROM_DEVICE;
use rowscan_recording::{About, Decoded, FrameReader, McapWriter, Recording, Side, StreamKind};

/// The same numbers in every run (PCG's multiplier and increment).
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, bound: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % bound.max(1)
    }
}

fn scan(counter: u32) -> Vec<u8> {
    let body = format!(
        "sSN LMDscandata 1 1 16F4C7A 0 0 {counter:X} {counter:X} {0:X} {0:X} 0 0 4 0 0 1388 168 0 1 DIST1 3F800000 00000000 FFF92230 1388 3 3E8 0 7D0 0 0 0 0 0 0",
        counter * 20_000
    );
    let mut bytes = Vec::new();
    encode(Dialect::A, body.as_bytes(), &mut bytes);
    bytes
}

/// A file's format, and what it holds.
type File = (&'static str, Vec<u8>);

/// A small file of each format.
fn files() -> Result<Vec<File>, Box<dyn std::error::Error>> {
    let raw: Vec<u8> = (0..20).flat_map(scan).collect();
    let mut writer = McapWriter::new(Cursor::new(Vec::new()), &About::default(), Decoded::default())?;
    let stream = writer.add_stream("scanner", StreamKind::Cola)?;
    for counter in 0..20 {
        writer.write(stream, Side::Device, u64::from(counter) * 20_000_000, 0, &scan(counter))?;
    }
    writer.finish()?;
    let mut archive = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    archive.write_all(&raw)?;
    let mut serial = Vec::new();
    for _ in 0..10 {
        let body = [&[0xB0, 181, 0][..], &[0x10; 362], &[0x10]].concat();
        rowscan_protocol::lms2xx::frame::encode(FROM_DEVICE, &body, &mut serial);
    }
    // The head of a capture of Ethernet, then packets of TCP without a checksum, a telegram each.
    let mut capture =
        vec![0xD4, 0xC3, 0xB2, 0xA1, 2, 0, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xFF, 0xFF, 0, 0, 1, 0, 0, 0];
    for counter in 0..20 {
        let packet = [&[0; 12][..], &[8, 0, 0x45, 0], &[0; 40], &scan(counter)].concat();
        let length = (packet.len() as u32).to_le_bytes();
        capture.extend([&[0; 8][..], &length, &length, &packet].concat());
    }
    let hex: String = raw.iter().map(|byte| format!("{byte:02X} ")).collect();
    let ranges = "# rowscan ranges 1; frequency_hz 50; start_deg 0; step_deg 1; unit mm\n\
                  time_s,telegram_counter,scan_time_us,range_0\n0,1,0,1000\n0.02,2,20000,2000\n";
    Ok(vec![
        ("mcap", writer.into_inner().into_inner()),
        ("gzip", archive.finish()?),
        ("CoLa", raw),
        ("LMS2xx", serial),
        ("capture", capture),
        ("hex", hex.into_bytes()),
        ("text", b"sRN DeviceIdent\nsRA DeviceIdent 6 LMS111 5 V1.30\n".to_vec()),
        ("ranges", ranges.into()),
        ("candump", b"(1700000000.000001) can0 18FEF100#0102\n".repeat(20)),
        ("CARMEN", b"FLASER 3 1.0 2.0 3.0 0 0 0 0 0 0 1.0 host 1.0\n".repeat(20)),
    ])
}

fn changed(whole: &[u8], numbers: &mut Numbers) -> Vec<u8> {
    let mut bytes = whole.to_vec();
    for _ in 0..=numbers.below(4) {
        let at = numbers.below(bytes.len());
        match numbers.below(5) {
            0 => bytes.truncate(at),
            1 => bytes.get_mut(at).into_iter().for_each(|byte| *byte ^= 1 << numbers.below(8)),
            // A length of 32 bits.
            2 => bytes.iter_mut().skip(at).take(4).for_each(|byte| *byte = 0xFF),
            3 => {
                let noise: Vec<u8> = (0..numbers.below(200)).map(|_| numbers.below(256) as u8).collect();
                bytes.splice(at..at, noise);
            }
            _ => {
                let end = (at + numbers.below(4000)).min(bytes.len());
                let piece = bytes.get(at..end).unwrap_or_default().to_vec();
                bytes.extend(piece);
            }
        }
    }
    bytes.truncate(64 * 1024);
    bytes
}

#[derive(Default)]
struct Counts {
    read: u64,
    torn: u64,
    refused: u64,
    longest: Duration,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let count: usize = arguments.next().as_deref().unwrap_or("10000").parse()?;
    let mut numbers = Numbers(arguments.next().as_deref().unwrap_or("1").parse()?);
    let files = files()?;
    let mut all: BTreeMap<&str, Counts> = BTreeMap::new();
    for (name, whole) in files.iter().cycle().take(count) {
        let bytes = changed(whole, &mut numbers);
        let start = Instant::now();
        let outcome = read(bytes);
        let counts = all.entry(name).or_default();
        counts.longest = counts.longest.max(start.elapsed());
        match outcome {
            Some(false) => counts.read += 1,
            Some(true) => counts.torn += 1,
            None => counts.refused += 1,
        }
    }
    for (name, Counts { read, torn, refused, longest }) in all {
        println!(
            "{name}: {read} read, {torn} torn, {refused} refused, longest {:.0} ms",
            1e3 * longest.as_secs_f64()
        );
    }
    Ok(())
}

/// Reads all frames: whether the file is torn; none if it is refused.
fn read(bytes: Vec<u8>) -> Option<bool> {
    let mut frames = FrameReader::new(Recording::read(Box::new(Cursor::new(bytes))).ok()?);
    while frames.next_frame().ok()?.is_some() {}
    Some(frames.recording().torn().is_some())
}
