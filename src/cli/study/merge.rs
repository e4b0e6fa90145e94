//! `rowscan study merge`: shards become the whole, and the whole is reported.

use std::path::PathBuf;

use serde::Deserialize;
use serde::de::IgnoredAny;

use super::shards::{read_json, whole};
use super::tell::TellArgs;
use super::{areas, confirmed, coverage, resolution, run as sweep, search, transfer};
use crate::cli::{Failure, Outcome};
use rowscan_study::Study;
use rowscan_study::areas::AreasStudy;
use rowscan_study::coverage::CoverageStudy;
use rowscan_study::resolution::ResolutionStudy;
use rowscan_study::search::{ConfirmStudy, SearchStudy};
use rowscan_study::sweep::SweepStudy;
use rowscan_study::transfer::TransferStudy;

#[derive(Debug, clap::Args)]
pub(in crate::cli) struct Args {
    /// The files of all shards of one study
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    /// Write a calibration for `estimate`; areas studies only
    #[arg(long, value_name = "FILE.toml")]
    calibration: Option<PathBuf>,
    #[command(flatten)]
    transfer: transfer::ReportArgs,
    #[command(flatten)]
    tell: TellArgs,
}

/// As much of a shard's file as tells whose it is.
#[derive(Deserialize)]
struct Peek {
    header: PeekHeader,
    #[serde(rename = "units")]
    _units: IgnoredAny,
}

#[derive(Deserialize)]
struct PeekHeader {
    study: String,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let names: Vec<String> = args
        .files
        .iter()
        .map(|path| read_json::<Peek>(path).map(|peek| peek.header.study))
        .collect::<Result<_, _>>()?;
    let first = names.first().map(String::as_str).unwrap_or_default();
    if let Some((path, other)) = args.files.iter().zip(&names).find(|(_, name)| *name != first) {
        let cause = format!("is a shard of study {other}, the files before it of study {first}");
        return Err(Failure::StudyFile { path: path.display().to_string(), cause });
    }
    match first {
        AreasStudy::NAME => {
            areas::tell(&args.tell, args.calibration.as_deref(), whole::<AreasStudy>(&args.files)?)
        }
        other if args.calibration.is_some() => {
            Err(Failure::Usage(format!("a study {other} gives no calibration")))
        }
        ResolutionStudy::NAME => resolution::tell(&args.tell, whole::<ResolutionStudy>(&args.files)?),
        SweepStudy::NAME => sweep::tell(&args.tell, whole::<SweepStudy>(&args.files)?),
        SearchStudy::NAME => search::tell(&args.tell, search::BEST, whole::<SearchStudy>(&args.files)?),
        ConfirmStudy::NAME => confirmed::tell(&args.tell, false, whole::<ConfirmStudy>(&args.files)?),
        TransferStudy::NAME => {
            transfer::tell(&args.tell, &args.transfer, whole::<TransferStudy>(&args.files)?)
        }
        CoverageStudy::NAME => coverage::tell(&args.tell, whole::<CoverageStudy>(&args.files)?),
        unknown => Err(Failure::Usage(format!("this version knows no study `{unknown}`"))),
    }
}
