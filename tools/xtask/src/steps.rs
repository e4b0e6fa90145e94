//! A list of steps, each named and timed, all run even if one fails; the last line says how many tests passed.

use std::process::ExitCode;
use std::time::{Duration, Instant};

use crate::counts::Counts;

/// How a step ended.
pub enum Outcome {
    /// It did what it should; with the tests it ran.
    Passed(Counts),
    /// It failed, and why; with the tests it ran.
    Failed(Counts, String),
    /// It could not run here, and why.
    Skipped(String),
}

impl Outcome {
    /// Passed without tests of its own.
    pub fn ok() -> Self {
        Self::Passed(Counts::default())
    }

    /// Failed before any test could.
    pub fn failed(why: impl Into<String>) -> Self {
        Self::Failed(Counts::default(), why.into())
    }

    /// Passed if `result` is good, failed with its message if not.
    pub fn from_result(result: Result<(), String>) -> Self {
        result.map_or_else(Self::failed, |()| Self::ok())
    }

    /// Judges a test run by its counts and the runner's exit.
    pub fn from_tests(counts: Counts, exit: Result<(), String>) -> Self {
        match exit {
            Ok(()) if counts.failed == 0 => Self::Passed(counts),
            Ok(()) => Self::Failed(counts, format!("{} tests failed", counts.failed)),
            Err(why) => Self::Failed(counts, why),
        }
    }
}

/// The steps run so far.
#[derive(Default)]
pub struct Steps {
    done: Vec<(String, Duration, Result<(), String>)>,
    skipped: Vec<(String, String)>,
    counts: Counts,
}

impl Steps {
    /// Runs a step and prints its name before and its time after.
    pub fn run(&mut self, name: &str, step: impl FnOnce() -> Outcome) {
        println!("==> {name}");
        let start = Instant::now();
        let outcome = step();
        let time = start.elapsed();
        match outcome {
            Outcome::Passed(counts) => {
                self.counts += counts;
                self.finish(name, time, Ok(()));
            }
            Outcome::Failed(counts, why) => {
                self.counts += counts;
                // A step that broke before its tests ran (a build, a lint) is one failure, or the sum would look clean.
                self.counts.failed += u32::from(counts.failed == 0);
                self.finish(name, time, Err(why));
            }
            Outcome::Skipped(why) => {
                self.counts.skipped += 1;
                println!("SKIPPED: {name}: {why}\n");
                self.skipped.push((name.to_owned(), why));
            }
        }
    }

    fn finish(&mut self, name: &str, time: Duration, result: Result<(), String>) {
        let verdict = if result.is_ok() { "ok" } else { "FAILED" };
        println!("    {verdict} in {:.1} s\n", time.as_secs_f64());
        self.done.push((name.to_owned(), time, result));
    }

    /// Prints the table of steps, then the counts alone on the last line.
    pub fn close(self) -> ExitCode {
        for (name, time, result) in &self.done {
            let verdict = if result.is_ok() { "ok    " } else { "FAILED" };
            println!("{verdict} {:>7.1} s  {name}", time.as_secs_f64());
            if let Err(why) = result {
                println!("                  {}", why.trim_end().replace('\n', "\n                  "));
            }
        }
        for (name, why) in &self.skipped {
            println!("SKIPPED: {name}: {why}");
        }
        println!("{}", self.counts);
        if self.counts.failed == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
    }
}
