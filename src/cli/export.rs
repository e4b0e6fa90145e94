//! `rowscan export`

use std::path::PathBuf;

use rowscan_canopy::{Placing, Warning};
use rowscan_driver::{DriverConfig, Scanner, Source};
use rowscan_protocol::counting::Counting;
use rowscan_protocol::model::AnyModel;
use rowscan_scenes::files;

use super::interrupt::Interrupt;
use super::output::{name_of, say};
use super::table_file::TableFile;
use super::{Failure, Outcome};
use crate::export::{PointRows, RowError, Rows, ScanRows, ShotRows, TableFormat};
use rowscan_emulator::ViewError;
use rowscan_emulator::stage::StageError;

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
    /// The rig's scanner this is, from 0; otherwise the one that the recording says, else the first
    #[arg(long, value_name = "N", requires = "rig")]
    scanner: Option<usize>,
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
    /// Text of shots, as AMAPVox reads it
    Amapvox,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
enum What {
    /// One return a row
    #[default]
    Points,
    /// One scan a row, one beam a column
    Scans,
    /// One beam a row, with an echo or without: origin, unit direction, range of each echo
    Shots,
}

impl To {
    /// Refuses what a format has no place for.
    fn holds(self, what: What) -> Result<(), Failure> {
        let refused = |why: &str| Err(Failure::Usage(why.to_owned()));
        match (self, what) {
            (Self::Ply, What::Scans | What::Shots) => {
                refused("PLY holds points: expected `--what points`, or another format for scans and shots")
            }
            (Self::Las, What::Scans) => refused(
                "LAS holds points and shots: expected `--what points`, `--what shots`, or another format for scans",
            ),
            (Self::Amapvox, What::Points | What::Scans) => {
                refused("AMAPVox's text holds shots: expected `--what shots`")
            }
            _ => Ok(()),
        }
    }
}

impl From<To> for TableFormat {
    fn from(to: To) -> Self {
        match to {
            To::Csv => Self::Csv,
            To::Ply => Self::Ply,
            To::Las => Self::Las,
            To::Npy => Self::Npy,
            To::Parquet => Self::Parquet,
            To::Amapvox => Self::AmapVox,
        }
    }
}

pub(super) async fn run(args: Args, mut interrupt: Interrupt) -> Result<Outcome, Failure> {
    args.to.holds(args.what)?;
    if args.file.file().is_none() {
        return Err(Failure::Usage(format!("{} is live: `rowscan record` it first", args.file)));
    }
    TableFormat::from(args.to).check()?;
    interrupt.finite(export(&args)).await
}

/// Writes scan after scan, as they are read.
async fn export(args: &Args) -> Result<Outcome, Failure> {
    let (rig, scene) = match &args.rig {
        Some(name) => files::load_rig(name, say).map(|(rig, scene)| (Some(rig), scene))?,
        None => (None, None),
    };
    let alley = scene.and_then(|scene| scene.drive.alley);
    let recorded = || args.file.mount_on(rig.as_ref()?);
    let index = args.scanner.or_else(recorded).unwrap_or_default();
    if let Some(found) = rig.as_ref().map(|rig| rig.scanners.len()).filter(|found| index >= *found) {
        return Err(StageError::from(ViewError::NoSuchScanner { index, found }).into());
    }
    let mount = rig.as_ref().and_then(|rig| rig.scanners.get(index));
    let taken_for = mount.and_then(|mount| AnyModel::by_name(&mount.model));
    let mut rows: Box<dyn Rows> = match args.what {
        What::Points => Box::new(PointRows::new(Placing::new(rig, index, alley))),
        What::Shots => Box::new(ShotRows::new(Placing::new(rig, index, alley))),
        What::Scans => Box::new(ScanRows::new(args.file.recorded_model())),
    };
    let mut scanner = Scanner::open(&args.file, DriverConfig::default()).await?;
    let mut file: Option<TableFile> = None;
    let mut scans: u64 = 0;
    let (mut has_encoder, mut counting) = (false, Counting::default());
    while let Some(record) = scanner.next().await? {
        has_encoder |= !record.scan.encoders.is_empty();
        counting.observe(record.scan);
        let file = match &mut file {
            Some(file) => file,
            // Only now: a recording without a scan leaves no file.
            none => none.insert(TableFile::create(&args.output, args.to.into(), &rows.table(record.scan))?),
        };
        let (scan, received_s) = (record.scan, record.received_s());
        rows.push(scan, received_s, &mut |row| file.row(row)).map_err(|error| match error {
            RowError::OtherBeams(error) => Failure::Usage(error.to_string()),
            RowError::OtherLayer(error) => Failure::Usage(error.to_string()),
            RowError::MoreEchoes(error) => Failure::Usage(error.to_string()),
            RowError::Write(cause) => file.failure(cause),
        })?;
        scans += 1;
        // A recording never waits by itself, and the user may want to end this.
        tokio::task::coop::consume_budget().await;
    }
    let Some(file) = file else { return Ok(Outcome::Finding) };
    let rows = file.commit()?;
    say(format_args!("{}: {rows} rows of {scans} scans", name_of(&args.output)));
    if let Some(taken_for) = taken_for
        && let Some(Warning::OtherModel { found, .. }) = Warning::other_model(&scanner.models(), taken_for)
    {
        let found: Vec<&str> = found.iter().map(|model| model.name()).collect();
        say(format_args!(
            "{}: it is a recording of {}, and the rig's scanner is {}: correct the rig's `model`",
            args.file,
            found.join(" or "),
            taken_for.name()
        ));
    }
    if args.what == What::Scans && !counting.counts() {
        say(format_args!(
            "{}: the scanner tells no counters and no times: the columns hold the order of the scans and the host's clock, and what was lost is not known, \
             whatever is made of the table",
            name_of(&args.output)
        ));
    }
    if counting.repeated > 0 {
        say(format_args!(
            "{}: {} scans came again, and stand there again; an estimate counts each once",
            args.file, counting.repeated
        ));
    }
    if counting.late > 0 {
        say(format_args!(
            "{}: {} scans came behind later ones, and stand there where they came; an estimate leaves them out",
            args.file, counting.late
        ));
    }
    if counting.lost > 0 {
        say(format_args!("{}: {} scans are missing by their counters", args.file, counting.lost));
    }
    if counting.restarts > 0 {
        say(format_args!(
            "{}: the scanner began to count anew {} times: counters and device times before and behind that do not go together",
            args.file, counting.restarts
        ));
    }
    let unreadable = scanner.faults().total();
    if unreadable > 0 {
        say(format_args!(
            "{}: {unreadable} scan telegrams came and gave no scan; where the scanner counts they are among the missing ones",
            args.file
        ));
    }
    if args.what == What::Scans && (has_encoder || scanner.counts().readings.wheel > 0) {
        say(format_args!(
            "{} has no place for the encoder's readings that the recording holds: an estimate of it goes by the rig's constant speed",
            name_of(&args.output)
        ));
    }
    // A part looks like the whole of another recording; where it breaks off, and what it lacks, is told already.
    let is_part = scanner.broken_off().is_some() || scanner.lacks_bytes();
    Ok(if is_part { Outcome::Finding } else { Outcome::Done })
}
