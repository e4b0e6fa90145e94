//! A list of steps, each named and timed, all run even if one fails; the last line says how many tests passed.

use std::process::ExitCode;
use std::time::{Duration, Instant};

use crate::counts::Counts;
use crate::workspace::Workspace;

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

/// Something to run, by name.
pub struct Step {
    name: &'static str,
    run: fn(&Workspace) -> Outcome,
    /// How long it takes at most, on two cores that have compiled nothing yet.
    takes: Duration,
    /// Whether most of it is done already: then it takes a minute.
    begun: fn(&Workspace) -> bool,
}

impl Step {
    /// A step called `name`.
    pub const fn new(name: &'static str, run: fn(&Workspace) -> Outcome) -> Self {
        Self { name, run, takes: Duration::ZERO, begun: |_| false }
    }

    /// The same, taking so many minutes.
    pub const fn taking(self, minutes: u64) -> Self {
        Self { takes: Duration::from_secs(60 * minutes), ..self }
    }

    /// The same, taking a minute where most of it is done already.
    const fn unless(self, begun: fn(&Workspace) -> bool) -> Self {
        Self { begun, ..self }
    }

    fn takes(&self, workspace: &Workspace) -> Duration {
        if (self.begun)(workspace) { Duration::from_secs(60) } else { self.takes }
    }
}

/// The release binary, which the steps after it use.
pub const RELEASE_BUILD: Step =
    Step::new("release-build", |workspace| Outcome::from_result(workspace.build_binary()))
        .taking(8)
        .unless(|workspace| workspace.built_binary().is_ok());

/// What bounds a run: a step that would not end in time fails.
const WITHIN: &str = "--within=";

/// Runs all of `steps`, or only those in `arguments`, and prints each one's name before and its time after; at the end a table and,
/// alone on the last line, the counts. `--within=MINUTES` bounds the run: what would take longer than is left is not begun, and is a failure.
pub fn run(workspace: &Workspace, steps: &[Step], arguments: &[String]) -> ExitCode {
    let (bounds, names): (Vec<&String>, Vec<&String>) =
        arguments.iter().partition(|argument| argument.starts_with(WITHIN));
    let within = match bounds.last().map(|bound| bound[WITHIN.len()..].parse::<u64>()) {
        None => Duration::MAX,
        Some(Ok(minutes)) => Duration::from_secs(60 * minutes),
        Some(Err(_)) => {
            eprintln!("{WITHIN} expects a whole number of minutes");
            return ExitCode::from(2);
        }
    };
    let begun = Instant::now();
    if let Some(unknown) = names.iter().find(|name| steps.iter().all(|step| step.name != name.as_str())) {
        let known: Vec<&str> = steps.iter().map(|step| step.name).collect();
        eprintln!("there is no step `{unknown}`; there are: {}", known.join(", "));
        return ExitCode::from(2);
    }
    let mut summary = Summary::default();
    for step in steps.iter().filter(|step| names.is_empty() || names.iter().any(|name| *name == step.name)) {
        println!("==> {}", step.name);
        let start = Instant::now();
        let left = within.saturating_sub(begun.elapsed());
        let takes = step.takes(workspace);
        let outcome = match takes <= left {
            true => (step.run)(workspace),
            // It was asked for.
            false => Outcome::failed(format!(
                "out of time: takes up to {} min, and {} are left",
                takes.as_secs() / 60,
                left.as_secs() / 60
            )),
        };
        println!("{}\n", summary.add(step.name, start.elapsed(), outcome));
    }
    summary.close()
}

/// What the steps so far came to.
#[derive(Default)]
struct Summary {
    lines: Vec<String>,
    counts: Counts,
}

impl Summary {
    /// Takes a step's outcome and returns the line that tells it.
    fn add(&mut self, name: &str, time: Duration, outcome: Outcome) -> &str {
        let time = format!("{:>7.1} s", time.as_secs_f64());
        let line = match outcome {
            Outcome::Passed(counts) => {
                self.counts += counts;
                format!("ok     {time}  {name}")
            }
            Outcome::Failed(counts, why) => {
                self.counts += counts;
                // A step that broke before its tests ran (a build, a lint) is one failure, or the sum would look clean.
                self.counts.failed += u32::from(counts.failed == 0);
                let indented = why.trim_end().replace('\n', "\n                  ");
                format!("FAILED {time}  {name}\n                  {indented}")
            }
            Outcome::Skipped(why) => {
                self.counts.skipped += 1;
                format!("SKIPPED: {name}: {why}")
            }
        };
        self.lines.push(line);
        self.lines.last().map_or("", String::as_str)
    }

    fn close(self) -> ExitCode {
        for line in &self.lines {
            println!("{line}");
        }
        println!("{}", self.counts);
        if self.counts.failed == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_that_breaks_before_its_tests_is_one_failure() {
        let mut summary = Summary::default();
        let tests = Counts { passed: 5, failed: 2, skipped: 1 };
        summary.add("tests", Duration::ZERO, Outcome::Failed(tests, "2 tests failed".to_owned()));
        summary.add("build", Duration::ZERO, Outcome::failed("error[E0433]"));
        summary.add("python", Duration::ZERO, Outcome::Skipped("no python3".to_owned()));
        assert_eq!(summary.counts, Counts { passed: 5, failed: 3, skipped: 2 });
    }
}
