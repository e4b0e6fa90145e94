//! The option of every study that tries rows: a folder in which finished rows stand for the next one.

use std::path::PathBuf;

use crate::cli::Failure;
use crate::cli::output::say;
use rowscan_study::archive::{Archive, MOST_BYTES};
use rowscan_study::fingerprint;

/// Largest program that a fingerprint is taken of.
const MOST_BYTES_PROGRAM: u64 = 1024 * 1024 * 1024;

/// Where finished rows are kept.
#[derive(Clone, Debug, clap::Args)]
pub(in crate::cli) struct KeepArgs {
    /// Keep every finished row in this folder, and take rows from it that an earlier study has done: of the same scene, seed, settings, calibration and program
    #[arg(long, value_name = "DIR")]
    keep: Option<PathBuf>,
}

/// The rows of a run: those that are kept, and those that it does.
#[derive(Debug)]
pub(in crate::cli) struct KeptRows {
    pub(super) archive: Archive,
    folder: Option<PathBuf>,
}

impl KeepArgs {
    /// Opens the folder, if one was named.
    pub(super) fn open(&self) -> Result<KeptRows, Failure> {
        let archive = match &self.keep {
            Some(folder) => Archive::open(folder, build()?, MOST_BYTES)?,
            None => Archive::none(),
        };
        Ok(KeptRows { archive, folder: self.keep.clone() })
    }
}

impl KeptRows {
    /// Says what the estimates of the rows withhold and warn of, and how many rows were there and how many were done.
    pub(super) fn tell(&self) {
        let tally = self.archive.tally();
        let notes = tally.notes.to_string();
        if !notes.is_empty() {
            say(notes);
        }
        let Some(folder) = &self.folder else { return };
        if let Some(first) = &tally.first_spoilt {
            say(format_args!(
                "kept rows that could not be used, done anew: {}, the first: {first}",
                tally.spoilt
            ));
        }
        if let Some(first) = &tally.first_lost {
            say(format_args!("rows that could not be kept: {}, the first: {first}", tally.lost));
        }
        say(format_args!("rows: {} kept in {}, {} done", tally.found, folder.display(), tally.done));
    }
}

/// This very program: its version, and a fingerprint of its file, for any change of it may change a result.
fn build() -> Result<String, Failure> {
    let system = |cause| Failure::System { what: "read this program's file", cause };
    let file = std::env::current_exe().map_err(system)?;
    let bytes = rowscan_files::read(&file, MOST_BYTES_PROGRAM).map_err(system)?;
    Ok(format!("{} {}", env!("CARGO_PKG_VERSION"), fingerprint::of_content(&bytes)))
}
