//! Prints the scans of a scanner or a recording: `cargo run -p rowscan-driver --example print_scans -- tcp://192.168.0.1:2112`
//!
//! With `--features serial` also `serial:/dev/ttyUSB0`, with `--features recordings` also a file.

#![allow(clippy::print_stdout, reason = "an example prints")]

use std::error::Error;

use rowscan_driver::{DriverConfig, DriverError, Scanner, Source};

#[tokio::main]
async fn main() -> Result<(), Box<dyn Error>> {
    let source: Source =
        std::env::args().nth(1).ok_or("usage: print_scans tcp://HOST:PORT | FILE")?.parse()?;
    for_scans(&source, u64::MAX, |line| println!("{line}")).await?;
    Ok(())
}

/// Subscribes, and hands out a line a scan: `most` of them, or until a recording ends.
pub(crate) async fn for_scans(
    source: &Source,
    most: u64,
    mut print: impl FnMut(String),
) -> Result<(), DriverError> {
    let mut scanner = Scanner::open(source, DriverConfig::default()).await?;
    for _ in 0..most {
        let Some(record) = scanner.next().await? else { break };
        let scan = record.scan;
        let ranges = scan.echoes.first().map(|echo| echo.range_m.as_slice()).unwrap_or_default();
        let returns = ranges.iter().filter(|range| range.is_finite()).count();
        print(format!(
            "telegram {:5}  {:10} µs  {} beams from {:.1}° by {:.4}°  {returns} returns",
            scan.telegram_counter,
            scan.scan_time_us,
            scan.beams.count,
            scan.beams.angle_deg(0),
            scan.beams.step_deg(),
        ));
    }
    Ok(())
}
