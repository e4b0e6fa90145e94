//! A list of steps, each named and timed, all run even if one fails; the last line says how many tests passed.

use std::env;
use std::fs::{self, File};
use std::path::PathBuf;
use std::process::{Child, Command, ExitCode, Stdio};
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
    /// It runs beside the steps that are not so.
    is_beside: bool,
    /// It begins when the steps beside have ended.
    is_behind: bool,
}

impl Step {
    /// A step called `name`.
    pub const fn new(name: &'static str, run: fn(&Workspace) -> Outcome) -> Self {
        Self { name, run, takes: Duration::ZERO, begun: |_| false, is_beside: false, is_behind: false }
    }

    /// The same, taking so many minutes.
    pub const fn taking(self, minutes: u64) -> Self {
        Self { takes: Duration::from_secs(60 * minutes), ..self }
    }

    /// The same, begun when all steps beside have ended: one of them writes to the same folder.
    pub const fn behind(self) -> Self {
        Self { is_behind: true, ..self }
    }

    /// The same, run in a process of its own beside the steps behind it, with the others that are so, one after the other. It gives way to them.
    pub const fn beside(self) -> Self {
        Self { is_beside: true, ..self }
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
    let mut beside = None;
    for step in steps.iter().filter(|step| names.is_empty() || names.iter().any(|name| *name == step.name)) {
        // Asked for by name, each runs here.
        if step.is_beside && names.is_empty() {
            if beside.is_none() {
                beside = Some(Beside::start(workspace, steps));
            }
            continue;
        }
        if step.is_behind
            && let Some(beside) = beside.take()
        {
            Beside::close(beside, &mut summary);
        }
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
    if let Some(beside) = beside {
        Beside::close(beside, &mut summary);
    }
    summary.close()
}

/// Steps that run in a process of their own.
struct Beside {
    child: Child,
    log: PathBuf,
}

impl Beside {
    /// Starts this command again, for the steps that run beside others, at the lowest priority.
    fn start(workspace: &Workspace, steps: &[Step]) -> Result<Self, String> {
        let names: Vec<&str> = steps.iter().filter(|step| step.is_beside).map(|step| step.name).collect();
        println!("==> beside: {}\n", names.join(", "));
        let log = workspace.scratch("beside")?.join("log");
        let tell = |error: std::io::Error| format!("cannot run steps beside others: {error}");
        let file = File::create(&log).map_err(tell)?;
        let child = Command::new("nice")
            .args(["-n", "19"])
            .arg(env::current_exe().map_err(tell)?)
            .args(env::args().nth(1))
            .args(names)
            .stdin(Stdio::null())
            .stderr(file.try_clone().map_err(tell)?)
            .stdout(file)
            .spawn()
            .map_err(tell)?;
        Ok(Self { child, log })
    }

    /// Waits for their end, and adds what came of them.
    fn close(beside: Result<Self, String>, summary: &mut Summary) {
        let start = Instant::now();
        let outcome = beside.and_then(Self::end).unwrap_or_else(Outcome::failed);
        println!("{}\n", summary.add("beside", start.elapsed(), outcome));
    }

    /// Waits for their end, and tells what they said.
    fn end(mut self) -> Result<Outcome, String> {
        println!("==> beside");
        let status =
            self.child.wait().map_err(|error| format!("cannot wait for the steps beside: {error}"))?;
        let said = fs::read(&self.log).map_err(|error| format!("{}: {error}", self.log.display()))?;
        let said = String::from_utf8_lossy(&said);
        let (before, counts) = said.trim_end().rsplit_once('\n').unwrap_or_default();
        println!("{before}");
        let counts = Counts::from_total(counts).ok_or("the steps beside ended without their counts")?;
        let exit = if status.success() { Ok(()) } else { Err("steps beside failed: see above".to_owned()) };
        Ok(Outcome::from_tests(counts, exit))
    }
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
