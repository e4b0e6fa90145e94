//! `rowscan check`

use std::path::PathBuf;

use rowscan_check::{Options, Tried, Verdict, report, worst};
use tokio::sync::watch;

use super::interrupt::Interrupt;
use super::output::{print, printable, say, write_file};
use super::{Failure, Outcome};

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
    /// Keep each run's folder (the children's logs and files) in this one
    #[arg(long, value_name = "DIR")]
    keep: Option<PathBuf>,
    /// Only this seed, in place of the scenario's
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// List what can be expected, as docs/bench.md has it, and do nothing else
    #[arg(long)]
    markdown: bool,
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
}

pub(super) async fn run(args: Args) -> Result<Outcome, Failure> {
    if args.markdown {
        print(&rowscan_check::what::markdown())?;
        return Ok(Outcome::Done);
    }
    let mut interrupt = Interrupt::watch()?;
    let (cancel, cancelled) = watch::channel(false);
    let options = Options {
        seed: args.seed,
        fail_fast: args.fail_fast,
        keep: args.keep.clone(),
        program: std::env::current_exe().ok(),
    };
    let (scenarios, format) = (args.scenarios.clone(), args.format);
    // A thread of its own, for as long as it takes: children die with it.
    let mut work = tokio::task::spawn_blocking(move || {
        let mut told = Ok(());
        let mut tell = |tried: &Tried| {
            let text = match format {
                CheckFormat::Table => printable(&report::text(tried)).into_owned(),
                CheckFormat::Jsonl => report::jsonl(tried),
                CheckFormat::Tap => return,
            };
            if told.is_ok() {
                told = print(&text);
            }
        };
        let tried = rowscan_check::check(&scenarios, &options, cancelled, &mut tell);
        (tried, told)
    });
    let mut interrupted = false;
    let ended = tokio::select! {
        ended = &mut work => ended,
        () = interrupt.wait() => {
            interrupted = true;
            // Its children end with it.
            let _ = cancel.send(true);
            work.await
        }
    };
    let (tried, told) =
        ended.map_err(|cause| Failure::System { what: "run the scenarios", cause: cause.into() })?;
    told?;
    let tried = tried?;
    args.write(&tried)?;
    if interrupted {
        return Ok(Outcome::Interrupted(2));
    }
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
    /// Writes the documents that need all verdicts.
    fn write(&self, tried: &[Tried]) -> Result<(), Failure> {
        if self.format == CheckFormat::Tap {
            print(&report::tap(tried))?;
        }
        let Some(path) = &self.junit else { return Ok(()) };
        let what = path.display().to_string();
        let failed = |error| Failure::Write { what, cause: std::io::Error::other(error) };
        write_file(path, &report::junit(tried).map_err(failed)?)
    }
}
