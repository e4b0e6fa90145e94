//! `rowscan export`

use std::path::PathBuf;

use rowscan_driver::{DriverConfig, Scanner, Source};
use rowscan_protocol::rig::Rig;
use rowscan_scenes::files;

use super::output::{name_of, say, write_file};
use super::{Failure, Outcome};
use crate::export::{Placing, ScanTable, TableFormat, encode, points};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A recording of any kind, with `#STREAM` behind it where it holds several
    file: Source,
    /// The file to write; `-` is standard output
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Its format
    #[arg(long, value_enum)]
    to: To,
    /// What is written
    #[arg(long, value_enum, default_value_t)]
    what: What,
    /// The rig that places the points in the row; without it they lie in the scanner's plane
    #[arg(long, value_name = "RIG")]
    rig: Option<String>,
    /// The rig's scanner this is, from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    scanner: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum To {
    /// Comma-separated values; of scans, the self-describing form that every command reads again
    Csv,
    /// Binary PLY
    Ply,
    /// LAS 1.4
    Las,
    /// One structured NumPy array
    Npy,
    /// Parquet
    Parquet,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
enum What {
    /// One return a row
    #[default]
    Points,
    /// One scan a row, one beam a column
    Scans,
}

pub(super) async fn run(args: Args) -> Result<Outcome, Failure> {
    if args.what == What::Scans && matches!(args.to, To::Ply | To::Las) {
        return Err(Failure::Usage(
            "PLY and LAS hold points: expected `--what points`, or another format for scans".to_owned(),
        ));
    }
    if matches!(args.file, Source::Tcp { .. }) {
        return Err(Failure::Usage(format!("{} is live: `rowscan record` it first", args.file)));
    }
    let rig: Option<Rig> =
        args.rig.as_deref().map(|name| files::load_rig(name).map(|(rig, _)| rig)).transpose()?;
    let mut scanner = Scanner::open(&args.file, DriverConfig::default()).await?;
    let mut table = ScanTable::default();
    while let Some(record) = scanner.next().await? {
        let time_s = record.received.0.as_secs_f64();
        table.push(record.scan, time_s).map_err(|error| Failure::Usage(error.to_string()))?;
    }
    let (columns, title) = match args.what {
        What::Points => (points(table.scans(), Placing::new(rig, args.scanner)), String::new()),
        What::Scans => (table.columns(), if args.to == To::Csv { table.title() } else { String::new() }),
    };
    let format = match args.to {
        To::Csv => TableFormat::Csv,
        To::Ply => TableFormat::Ply,
        To::Las => TableFormat::Las,
        To::Npy => TableFormat::Npy,
        To::Parquet => TableFormat::Parquet,
    };
    let what = name_of(&args.output);
    let bytes = encode(&columns, format)
        .map_err(|cause| Failure::Write { what: what.clone(), cause: std::io::Error::other(cause) })?;
    write_file(&args.output, &[title.into_bytes(), bytes].concat())?;
    say(format_args!("{what}: {} rows of {} scans", columns.rows(), table.scans().len()));
    Ok(Outcome::Done)
}
