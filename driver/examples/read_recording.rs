//! What a recording holds, and the scans of one of its streams:
//! `cargo run -p rowscan-driver --features recordings --example read_recording -- run.mcap`

#![allow(clippy::print_stdout, reason = "an example prints")]

use std::error::Error;
use std::path::{Path, PathBuf};

use rowscan_driver::rowscan_recording::Recording;
use rowscan_driver::{DriverConfig, Scanner, Source};

#[tokio::main]
async fn main() -> Result<(), Box<dyn Error>> {
    let path = PathBuf::from(std::env::args().nth(1).ok_or("usage: read_recording FILE")?);
    let bytes: usize = bytes_of_streams(&path)?.iter().sum();
    let ranges_m = ranges(&path).await?;
    println!("{bytes} bytes, {} scans", ranges_m.len());
    Ok(())
}

/// Bytes of each stream, as they went over the wire in both directions; the format is known by the file's content.
pub(crate) fn bytes_of_streams(path: &Path) -> Result<Vec<usize>, Box<dyn Error>> {
    let mut recording = Recording::open(path)?;
    let mut bytes = Vec::new();
    while let Some(packet) = recording.next_packet()? {
        bytes.resize(bytes.len().max(packet.stream + 1), 0);
        bytes[packet.stream] += packet.bytes.len();
    }
    Ok(bytes)
}

/// The first echoes of every scan, metres, infinite where a beam met nothing. A recording is a source like a live scanner.
pub(crate) async fn ranges(path: &Path) -> Result<Vec<Vec<f64>>, Box<dyn Error>> {
    let source = Source::Recording { path: path.to_owned(), stream: None };
    let mut scanner = Scanner::open(&source, DriverConfig::default()).await?;
    let mut ranges_m = Vec::new();
    while let Some(record) = scanner.next().await? {
        ranges_m.push(record.scan.echoes.first().map(|echo| echo.range_m.clone()).unwrap_or_default());
    }
    Ok(ranges_m)
}
