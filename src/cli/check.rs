//! `rowscan check`

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;

use rowscan_check::{Onlooker, Options, Tried, Verdict, report, worst};
use tokio::sync::watch;

use super::check_jobs::Jobs;
use super::check_page::CheckPage;
use super::interrupt::Interrupt;
use super::output::{can_be_written, if_read, print, printable, say, write_file};
use super::web::WebArgs;
use super::{Failure, Format, Outcome};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Scenario files; docs/bench.md describes them
    #[arg(required_unless_present = "markdown", value_name = "SCENARIO")]
    scenarios: Vec<PathBuf>,
    /// Write the verdicts as JUnit to this file too
    #[arg(long, value_name = "FILE")]
    junit: Option<PathBuf>,
    /// How to tell verdicts: for people, every event and verdict as JSON lines, or TAP 14
    #[arg(long, value_enum, default_value_t)]
    format: CheckFormat,
    /// Stop after the first expectation that does not hold or cannot be judged
    #[arg(long)]
    fail_fast: bool,
    /// Write the golden files anew that `bytes_of` compares with, from this run
    #[arg(long)]
    bless: bool,
    /// Keep each run's folder (the children's logs and files) in this one
    #[arg(long, value_name = "DIR")]
    keep: Option<PathBuf>,
    /// Try so many scenarios side by side, each in a process of its own
    #[arg(short, long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=256))]
    jobs: u16,
    /// Scenarios that other processes try before these
    #[arg(long, hide = true, value_name = "N", default_value_t = 0)]
    before: usize,
    /// Only this seed, in place of the scenario's
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// List what can be expected, as docs/bench.md has it, and do nothing else
    #[arg(long)]
    markdown: bool,
    #[command(flatten)]
    web: WebArgs,
}

/// How verdicts are written to standard output.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
enum CheckFormat {
    /// For people
    #[default]
    Table,
    /// One JSON object a line: events, then verdicts
    Jsonl,
    /// Test Anything Protocol, version 14
    Tap,
    /// For the process that asked for it: all that is known, one scenario and seed a line
    #[value(hide = true)]
    Record,
}

/// Largest file of verdicts that another one takes the place of, bytes.
const MOST_OF_VERDICTS: u64 = 1 << 28;

pub(super) async fn run(args: Args, mut interrupt: Interrupt) -> Result<Outcome, Failure> {
    if args.markdown {
        print(&rowscan_check::what::markdown())?;
        return Ok(Outcome::Done);
    }
    args.check_junit()?;
    let onlooker = args.onlooker().await?;
    let (cancel, cancelled) = watch::channel(false);
    if args.format == CheckFormat::Record {
        // Who asked for it has gone: it ends, its children with it.
        let cancel = cancel.clone();
        std::thread::spawn(move || {
            let _ = std::io::copy(&mut std::io::stdin(), &mut std::io::sink());
            let _ = cancel.send(true);
        });
    }
    let trying = args.try_all(cancelled, onlooker);
    tokio::pin!(trying);
    let (tried, signal) = tokio::select! {
        tried = &mut trying => (tried, None),
        signal = interrupt.signal() => {
            // What is being tried ends, its children with it.
            let _ = cancel.send(true);
            (trying.await, Some(signal))
        }
    };
    let tried = tried?;
    args.write(&tried)?;
    if let Some(signal) = signal {
        return Ok(Outcome::Interrupted(signal));
    }
    if args.format == CheckFormat::Record {
        return Ok(Outcome::Done);
    }
    // The same scene warns with every seed.
    let is_alone = tried.windows(2).all(|pair| pair[0].scenario == pair[1].scenario);
    let named = |of: &Tried, warning: &str| match is_alone {
        true => warning.to_owned(),
        false => format!("{}: {warning}", of.name),
    };
    let warnings = tried.iter().flat_map(|of| of.warnings().map(|warning| named(of, warning)));
    warnings.collect::<BTreeSet<_>>().into_iter().for_each(say);
    let cases = tried.iter().flat_map(|tried| &tried.cases);
    let count = |verdict| cases.clone().filter(|case| case.verdict == verdict).count();
    let (passed, failed) = (count(Verdict::Passed), count(Verdict::Failed));
    let (errors, skipped) = (count(Verdict::Error), count(Verdict::Skipped));
    say(format_args!("{passed} passed, {failed} failed, {errors} not judged, {skipped} skipped"));
    match worst(&tried) {
        Verdict::Passed | Verdict::Skipped => Ok(Outcome::Done),
        Verdict::Failed => Ok(Outcome::Finding),
        Verdict::Error => Err(Failure::Unjudged { errors }),
    }
}

impl Args {
    /// Refuses a file of verdicts that could not be written, or that would take the place of a scenario, which other processes may read, or of anything else
    /// than earlier verdicts.
    fn check_junit(&self) -> Result<(), Failure> {
        let Some(path) = &self.junit else { return Ok(()) };
        self.scenarios.iter().for_each(|scenario| rowscan_files::will_be_read(scenario));
        can_be_written(path)?;
        let is_of_verdicts = |held: Vec<u8>| held.is_empty() || held.trim_ascii_start().starts_with(b"<?xml");
        // What cannot be read, or is larger than verdicts are, is something else.
        if !path.is_file() || rowscan_files::read_own(path, MOST_OF_VERDICTS).is_ok_and(is_of_verdicts) {
            return Ok(());
        }
        Err(Failure::Usage(format!(
            "--junit {}: expected a new file, or one of earlier verdicts (XML), found a file of something else: name another file, or remove that one",
            path.display()
        )))
    }

    /// Who looks at the runs, if the page is asked for and can be had.
    async fn onlooker(&self) -> Result<Option<Arc<dyn Onlooker>>, Failure> {
        if !self.web.is_given() {
            return Ok(None);
        }
        if self.jobs > 1 {
            return Err(Failure::Usage(format!(
                "--web shows one run at a time: expected -j 1, found -j {}",
                self.jobs
            )));
        }
        let web = self.web.clone().settled().await?;
        let format = if self.format == CheckFormat::Jsonl { Format::Jsonl } else { Format::Table };
        Ok(Some(Arc::new(CheckPage::new(web, format))))
    }

    /// Tries all scenarios, and tells each that is done; what was done when it was cancelled.
    async fn try_all(
        &self,
        cancelled: watch::Receiver<bool>,
        onlooker: Option<Arc<dyn Onlooker>>,
    ) -> Result<Vec<Tried>, Failure> {
        let format = self.format;
        let mut told = Ok(());
        let mut tell = move |tried: &Tried| {
            let text = match format {
                CheckFormat::Table => printable(&report::text(tried)).into_owned(),
                CheckFormat::Jsonl => report::jsonl(tried),
                CheckFormat::Record => record(tried),
                CheckFormat::Tap => return Ok(()),
            };
            if told.is_ok() {
                told = if_read(print(&text));
            }
            std::mem::replace(&mut told, Ok(()))
        };
        if self.jobs > 1 && self.scenarios.len() > 1 {
            return self.jobs().run(cancelled, &mut tell).await;
        }
        let options = Options {
            seed: self.seed,
            fail_fast: self.fail_fast,
            bless: self.bless,
            keep: self.keep.clone(),
            before: self.before,
            program: std::env::current_exe().ok(),
            child_clock: std::env::var_os("ROWSCAN_CHILD_CLOCK").map(PathBuf::from),
            onlooker,
        };
        let scenarios = self.scenarios.clone();
        // A thread of its own, for as long as it takes: children die with it.
        let work = tokio::task::spawn_blocking(move || {
            let mut failed = None;
            let mut tell = |tried: &Tried| failed = failed.take().or(tell(tried).err());
            let tried = rowscan_check::check(&scenarios, &options, cancelled, &mut tell);
            (tried, failed)
        });
        let ended = work.await;
        let (tried, failed) =
            ended.map_err(|cause| Failure::System { what: "run the scenarios", cause: cause.into() })?;
        failed.map_or(Ok(()), Err)?;
        Ok(tried?)
    }

    /// The same command for one scenario at a time.
    fn jobs(&self) -> Jobs {
        let mut flags = vec!["--format".to_owned(), "record".to_owned()];
        flags.extend(self.seed.iter().flat_map(|seed| ["--seed".to_owned(), seed.to_string()]));
        flags.extend(self.fail_fast.then(|| "--fail-fast".to_owned()));
        flags.extend(self.bless.then(|| "--bless".to_owned()));
        let keep = self.keep.iter().flat_map(|keep| ["--keep".to_owned(), keep.display().to_string()]);
        flags.extend(keep);
        let (at_once, fail_fast) = (self.jobs.into(), self.fail_fast);
        Jobs { scenarios: self.scenarios.clone(), flags, at_once, fail_fast }
    }

    /// Writes the documents that need all verdicts.
    fn write(&self, tried: &[Tried]) -> Result<(), Failure> {
        if self.format == CheckFormat::Tap {
            if_read(print(&report::tap(tried)))?;
        }
        let Some(path) = &self.junit else { return Ok(()) };
        write_file(path, &report::junit(tried))
    }
}

/// All that is known of a scenario that was tried, on one line.
fn record(tried: &Tried) -> String {
    serde_json::to_string(tried).map_or(String::new(), |line| line + "\n")
}
