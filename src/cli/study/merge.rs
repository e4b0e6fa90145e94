//! `rowscan study merge`: shards become the whole, and the whole is reported.

use std::fmt::Display;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde::de::IgnoredAny;

use super::shards::{read_json, read_shard};
use super::{areas, resolution};
use crate::cli::{Failure, Format, Outcome};
use crate::study::areas::AreasStudy;
use crate::study::resolution::ResolutionStudy;
use crate::study::{Study, merge};

#[derive(Debug, clap::Args)]
pub(in crate::cli) struct Args {
    /// The files of all shards of one study
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    /// Draw the study's figure
    #[arg(long, value_name = "FILE.svg")]
    figure: Option<PathBuf>,
    /// Write a calibration for `estimate`; areas studies only
    #[arg(long, value_name = "FILE.toml")]
    calibration: Option<PathBuf>,
    /// How to write the report
    #[arg(long, value_enum, default_value_t)]
    format: Format,
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
            areas::ReportArgs::new(args.format, args.figure.clone(), args.calibration.clone())
                .tell(merge(read_all::<AreasStudy>(&args.files)?)?)
        }
        ResolutionStudy::NAME if args.calibration.is_some() => {
            Err(Failure::Usage("a resolution study gives no calibration".to_owned()))
        }
        ResolutionStudy::NAME => resolution::ReportArgs::new(args.format, args.figure.clone())
            .tell(merge(read_all::<ResolutionStudy>(&args.files)?)?),
        unknown => Err(Failure::Usage(format!("this version knows no study `{unknown}`"))),
    }
}

type Named<S> = (String, crate::study::ShardFile<S, <S as Study>::Result>);

fn read_all<S: Study>(files: &[PathBuf]) -> Result<Vec<Named<S>>, Failure> {
    files.iter().map(|path| read_shard(path)).collect()
}

/// A figure that could not be drawn.
pub(super) fn drawing_failure(path: &Path, cause: impl Display) -> Failure {
    Failure::Write { what: path.display().to_string(), cause: std::io::Error::other(cause.to_string()) }
}
