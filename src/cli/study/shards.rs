//! Running a study or a part of it, from the command line: shards, journals, resuming.

use std::fs::{File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use serde::de::DeserializeOwned;

use super::keep::KeepArgs;
use crate::cli::blocking::off_runtime;
use crate::cli::output::{self, say};
use crate::cli::{Failure, progress};
use rowscan_files::is_standard_output;
use rowscan_study::journal::{self, Journal};
use rowscan_study::{Header, Shard, ShardFile, Study, Unit, Whole, merge};

/// Longest file of a study that is read.
const MOST_BYTES: u64 = 512 * 1024 * 1024;

/// The flags of every study that can be cut in parts.
#[derive(Clone, Debug, clap::Args)]
pub(in crate::cli) struct ShardArgs {
    /// Do only this part of the study: the I-th of N, written to --output; `rowscan study merge` joins the parts
    #[arg(long, value_name = "I/N", default_value = "1/1")]
    shard: Shard,
    /// Write the results orchard by orchard to this file, whole or not at all; until then they are kept in FILE.journal
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Go on where an interrupted run of the same command line ended
    #[arg(long, requires = "output")]
    resume: bool,
    #[command(flatten)]
    keep: KeepArgs,
}

impl ShardArgs {
    /// Where unfinished work is kept, if anywhere.
    pub(super) fn journal(&self) -> Option<PathBuf> {
        self.output.as_deref().map(journal_of)
    }

    /// Runs the study or its part. None if it was a part, or all that was asked for is the file.
    /// `further`: files that its report is written to.
    pub(super) async fn run<'a, S: Study + Send + 'static>(
        &self,
        study: S,
        further: impl IntoIterator<Item = &'a Path>,
    ) -> Result<Option<Whole<S>>, Failure> {
        if self.shard != Shard::WHOLE && self.output.is_none() {
            return Err(Failure::Usage(
                "a shard needs a file to go to: add --output FILE, and join the files with `rowscan study merge`"
                    .to_owned(),
            ));
        }
        // Before hours of work, not behind them.
        self.output.as_deref().map_or(Ok(()), output::can_be_written)?;
        further.into_iter().try_for_each(output::can_be_written)?;
        let args = self.clone();
        let work = move || args.work(&study).map(|units| (study, units));
        let (study, units) = off_runtime("run the study", work).await?;
        if self.shard == Shard::WHOLE {
            return Ok(Some((Header::of(&study), units)));
        }
        if let Some(path) = &self.output {
            say(format_args!("wrote {}; join all shards with `rowscan study merge`", path.display()));
        }
        Ok(None)
    }

    fn work<S: Study>(&self, study: &S) -> Result<Vec<Unit<S::Result>>, Failure> {
        let Some(path) = &self.output else { return self.work_unkept(study) };
        if is_special(path) {
            let units = self.work_unkept(study)?;
            return self.write(study, path, units);
        }
        if self.resume && path.exists() {
            let (name, file) = read_shard::<S>(path)?;
            if file.shard == self.shard && file.header.difference(&Header::of(study)).is_none() {
                say(format_args!("{name} is finished already"));
                return Ok(file.units);
            }
            let cause = "is finished and belongs to another run; choose another --output".to_owned();
            return Err(Failure::StudyFile { path: name, cause });
        }
        let journal_path = journal_of(path);
        let (journal, kept) = self.open_journal(study, &journal_path)?;
        let bar = Bar::new(study, self.shard, &kept);
        let journal = Mutex::new(journal);
        let rows = self.keep.open()?;
        let units = rowscan_study::run(study, self.shard, kept, &rows.archive, &|unit| {
            journal.lock().map_err(|_| io::Error::other("the journal is gone"))?.keep(unit)?;
            bar.done(study, unit.index);
            Ok(())
        })?;
        bar.0.finish_and_clear();
        rows.tell();
        let units = self.write(study, path, units)?;
        std::fs::remove_file(&journal_path).map_err(|cause| write_failure(&journal_path, cause))?;
        Ok(units)
    }

    /// Without a journal: nothing can be gone on with.
    fn work_unkept<S: Study>(&self, study: &S) -> Result<Vec<Unit<S::Result>>, Failure> {
        let bar = Bar::new(study, self.shard, &[]);
        let rows = self.keep.open()?;
        let units = rowscan_study::run(study, self.shard, Vec::new(), &rows.archive, &|unit| {
            bar.done(study, unit.index);
            Ok(())
        })?;
        bar.0.finish_and_clear();
        rows.tell();
        Ok(units)
    }

    /// Writes the finished file; gives the units back.
    fn write<S: Study>(
        &self,
        study: &S,
        path: &Path,
        units: Vec<Unit<S::Result>>,
    ) -> Result<Vec<Unit<S::Result>>, Failure> {
        let file = ShardFile { header: Header::of(study), shard: self.shard, units };
        let written = serde_json::to_string(&file as &dyn erased_serde::Serialize);
        let text = written.map_err(|cause| write_failure(path, cause.into()))?;
        output::write_file(path, &(text + "\n"))?;
        Ok(file.units)
    }

    /// The journal, ready to be added to, and what it held.
    fn open_journal<S: Study>(&self, study: &S, path: &Path) -> Result<Opened<S>, Failure> {
        let trouble = |cause: String| Failure::StudyFile { path: path.display().to_string(), cause };
        if path.exists() && !self.resume {
            return Err(trouble(
                "holds an unfinished run: go on with --resume, or remove it to begin anew".to_owned(),
            ));
        }
        let bytes = match rowscan_files::read_own(path, MOST_BYTES) {
            Ok(bytes) => bytes,
            Err(cause) if cause.kind() == io::ErrorKind::NotFound => Vec::new(),
            Err(cause) => return Err(trouble(format!("cannot be read: {cause}"))),
        };
        let found = journal::read(&bytes, study, self.shard).map_err(|cause| trouble(cause.to_string()))?;
        let whole_bytes = found.as_ref().map_or(0, |kept| kept.whole_bytes);
        let open = || -> io::Result<File> {
            // Not truncated here: a torn last line is cut off below, what is whole stays.
            let file = OpenOptions::new().create(true).append(true).open(path)?;
            file.set_len(whole_bytes)?;
            Ok(file)
        };
        let file = open().map_err(|cause| write_failure(path, cause))?;
        match found {
            Some(kept) => Ok((Journal::resume(file), kept.units)),
            None => {
                let journal = Journal::begin(file, study, self.shard);
                Ok((journal.map_err(|cause| write_failure(path, cause))?, Vec::new()))
            }
        }
    }
}

/// A journal to add to, and what it held.
type Opened<S> = (Journal<File>, Vec<Unit<<S as Study>::Result>>);

/// A bar that moves by effort, so that its remaining time is honest where orchards differ.
struct Bar(indicatif::ProgressBar);

impl Bar {
    fn new<S: Study>(study: &S, shard: Shard, kept: &[Unit<S::Result>]) -> Self {
        let efforts = shard.units(study.units()).map(|index| effort(study, index));
        let bar = progress::efforts("orchards", efforts.sum());
        bar.set_position(kept.iter().map(|unit| effort(study, unit.index)).sum());
        // What an earlier run did says nothing about how fast this one goes.
        bar.reset_eta();
        Self(bar)
    }

    fn done<S: Study>(&self, study: &S, index: usize) {
        self.0.inc(effort(study, index));
    }
}

fn effort<S: Study>(study: &S, index: usize) -> u64 {
    (study.effort(index) * 1000.0) as u64
}

/// True of standard output, devices and pipes: no journal stands beside them.
fn is_special(path: &Path) -> bool {
    is_standard_output(path) || std::fs::metadata(path).is_ok_and(|found| !found.is_file())
}

/// `FILE.journal` beside `FILE`.
fn journal_of(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".journal");
    path.with_file_name(name)
}

/// A study that is whole, from the files of its shards.
pub(super) fn whole<S: Study>(files: &[PathBuf]) -> Result<Whole<S>, Failure> {
    let shards: Result<Vec<_>, Failure> = files.iter().map(|path| read_shard::<S>(path)).collect();
    Ok(merge(shards?)?)
}

/// A shard's file with its name.
pub(super) fn read_shard<S: Study>(path: &Path) -> Result<(String, ShardFile<S, S::Result>), Failure> {
    read_json(path).map(|file| (path.display().to_string(), file))
}

/// Any file a study writes.
pub(super) fn read_json<T: DeserializeOwned>(path: &Path) -> Result<T, Failure> {
    let trouble = |cause: String| Failure::StudyFile { path: path.display().to_string(), cause };
    let bytes =
        rowscan_files::read(path, MOST_BYTES).map_err(|cause| trouble(format!("cannot be read: {cause}")))?;
    serde_json::from_slice(&bytes).map_err(|cause| trouble(format!("is no shard of a study: {cause}")))
}

fn write_failure(path: &Path, cause: io::Error) -> Failure {
    Failure::Write { what: path.display().to_string(), cause }
}
