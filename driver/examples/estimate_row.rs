//! Leaf area of a row, tree by tree, from a scanner or a recording:
//! `cargo run -p rowscan-driver --example estimate_row -- tcp://192.168.0.1:2112 900`

#![allow(clippy::print_stdout, reason = "an example prints")]

use std::error::Error;

use rowscan_canopy::{Estimate, Pipeline};
use rowscan_driver::{DriverConfig, Scanner, Source};
use rowscan_protocol::rig::{Mount, Rig};

#[tokio::main]
async fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let source: Source = args.next().ok_or("usage: estimate_row SOURCE [SCANS]")?.parse()?;
    let scans: u64 = args.next().map_or(Ok(u64::MAX), |scans| scans.parse())?;
    for tree in estimate(&source, scans).await?.trees {
        println!("tree at {:5.2} m: impacted area {:5.2} m²", tree.y_m, tree.impacted_total_area_m2);
    }
    Ok(())
}

/// Feeds the estimator with so many scans, or all of a recording.
pub(crate) async fn estimate(source: &Source, scans: u64) -> Result<Estimate, Box<dyn Error>> {
    // One scanner at the tractor's side, 1.6 m high, 1.9 m from the row axis, at 1 m/s.
    let rig = Rig {
        speed_m_s: 1.0,
        tree_spacing_m: Some(1.5),
        row_spacing_m: Some(4.0),
        scanners: vec![Mount { height_m: 1.6, distance_m: 1.9, ..Mount::default() }],
        ..Rig::default()
    };
    let mut pipeline = Pipeline::new(Some(&rig), 0, None)?;
    let mut scanner = Scanner::open(source, DriverConfig::default()).await?;
    while pipeline.progress().scans < scans {
        let Some(record) = scanner.next().await? else { break };
        pipeline.push(record.scan);
    }
    Ok(pipeline.finish())
}
