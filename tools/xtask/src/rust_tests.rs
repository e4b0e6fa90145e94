//! The tests of the whole workspace, with honest counts: a test that says `SKIPPED:` did not pass.
//!
//! Cargo builds them, and they are run from here: while they run, cargo is free for the steps beside them.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use serde_json::Value;

use crate::counts::Counts;
use crate::shell::{self, Limit};
use crate::steps::Outcome;
use crate::workspace::{CHILD_CLOCK, FULL, Workspace};

/// A hanging test fails the run and does not hang it. libtest says nothing while a test runs; the longest takes half a minute on an
/// idle machine, and a loaded one may take ten times as long.
const SILENCE: Limit = Limit::Silent(Duration::from_secs(5 * 60));

/// Tests of one program at a time, for each processor: most of their time they wait for peers, clocks and processes.
const TESTS_A_PROCESSOR: usize = 2;

/// A program of tests, and the folder of its package, where it runs.
pub struct Program {
    pub path: PathBuf,
    pub folder: PathBuf,
}

/// Builds every test of the workspace, and with them the binary and the library that it starts children with.
pub fn build(workspace: &Workspace) -> Outcome {
    let library = || match cfg!(target_os = "linux") {
        true => shell::run(&mut workspace.cargo(&["build", "-p", CHILD_CLOCK])),
        false => Ok(()),
    };
    Outcome::from_result(
        workspace.build_binary().and_then(|()| library()).and_then(|()| programs(workspace).map(drop)),
    )
}

/// Programs that run at a time: the longest alone takes most of the time, and some have a single test.
const AT_A_TIME: usize = 2;

/// Runs what [`build`] built, two programs at a time; what each prints is shown when it ends.
pub fn run(workspace: &Workspace) -> Outcome {
    let mut programs = match programs(workspace) {
        Ok(programs) => programs,
        Err(why) => return Outcome::failed(why),
    };
    // The end-to-end tests are most of it, and begin at once.
    programs.sort_by_key(|program| program.folder != workspace.root);
    let waiting = Mutex::new(programs.into_iter());
    let next = || waiting.lock().unwrap_or_else(PoisonError::into_inner).next();
    let all = Mutex::new((Counts::default(), Vec::new()));
    thread::scope(|scope| {
        for _ in 0..AT_A_TIME {
            scope.spawn(|| {
                while let Some(program) = next() {
                    let (shown, counts, exit) = run_program(workspace, &program);
                    let (all, failures) = &mut *all.lock().unwrap_or_else(PoisonError::into_inner);
                    println!("{shown}");
                    *all += counts;
                    failures.extend(exit.err());
                }
            });
        }
    });
    let (counts, failures) = all.into_inner().unwrap_or_else(PoisonError::into_inner);
    Outcome::from_tests(counts, if failures.is_empty() { Ok(()) } else { Err(failures.join("\n")) })
}

/// Runs one program: what is worth showing of it, its counts, and how it ended.
fn run_program(workspace: &Workspace, program: &Program) -> (String, Counts, Result<(), String>) {
    let processors = thread::available_parallelism().map_or(1, usize::from);
    let threads = (TESTS_A_PROCESSOR * processors).to_string();
    let mut output = TestOutput::default();
    let mut command = Command::new(&program.path);
    command.args(["--show-output", "--test-threads", &threads]).current_dir(&program.folder);
    let name = program.path.strip_prefix(&workspace.target).unwrap_or(&program.path);
    let mut shown = vec![format!("     Running {}", name.display())];
    let exit = shell::run_lines(&mut command, SILENCE, |line| shown.extend(output.read(line)));
    (shown.join("\n"), output.counts, exit)
}

/// Examples in the documentation of libraries, which cargo compiles and runs.
pub fn run_examples(workspace: &Workspace) -> Outcome {
    let mut output = TestOutput::default();
    let mut command = workspace.cargo(&["test", "--workspace", "--doc", "--no-fail-fast", "--quiet"]);
    command.args(FULL).args(["--", "--show-output"]);
    let exit = shell::run_lines(&mut command, SILENCE, |line| {
        if let Some(shown) = output.read(line) {
            println!("{shown}");
        }
    });
    Outcome::from_tests(output.counts, exit)
}

/// Every program of tests, as cargo tells of it; built, if it is not.
pub fn programs(workspace: &Workspace) -> Result<Vec<Program>, String> {
    let mut command = workspace.cargo(&["test", "--workspace", "--no-run", "--quiet"]);
    command.args(FULL).arg("--message-format=json-render-diagnostics");
    let told = shell::capture(&mut command)?;
    let programs: Vec<Program> = told.lines().filter_map(program).collect();
    if programs.is_empty() { Err("cargo built no test".to_owned()) } else { Ok(programs) }
}

/// The program of tests that a message of cargo is about.
fn program(message: &str) -> Option<Program> {
    let message: Value = serde_json::from_str(message).ok()?;
    let is_test = message["profile"]["test"].as_bool()?;
    let path = message["executable"].as_str().filter(|_| is_test)?;
    let folder = Path::new(message["manifest_path"].as_str()?).parent()?;
    Some(Program { path: path.into(), folder: folder.into() })
}

/// What libtest prints, read line by line.
///
/// Tests whose data is missing print `SKIPPED: why` and return; libtest calls that passed and hides the line. So the run asks
/// for the output of passing tests too, shows only those lines of it and counts their tests as skipped.
#[derive(Default)]
struct TestOutput {
    counts: Counts,
    /// Tests of the current binary that said so; its closing line is yet to come.
    said_skipped: u32,
    in_successes: bool,
    test: Option<String>,
}

impl TestOutput {
    /// Takes a line; what is worth showing of it.
    fn read(&mut self, line: &str) -> Option<String> {
        if let Some(mut counts) = Counts::from_libtest(line) {
            let skipped = std::mem::take(&mut self.said_skipped);
            counts.passed = counts.passed.saturating_sub(skipped);
            counts.skipped += skipped;
            self.counts += counts;
            self.in_successes = false;
            return Some(line.to_owned());
        }
        match line {
            "successes:" => self.in_successes = true,
            "failures:" => self.in_successes = false,
            _ => {}
        }
        if !self.in_successes {
            return (!line.ends_with(" ... ok") && !line.is_empty()).then(|| line.to_owned());
        }
        if let Some(name) = line.strip_prefix("---- ").and_then(|rest| rest.strip_suffix(" stdout ----")) {
            self.test = Some(name.to_owned());
        }
        if !line.starts_with("SKIPPED:") {
            return None;
        }
        Some(match self.test.take() {
            Some(test) => {
                self.said_skipped += 1;
                format!("{test}:\n{line}")
            }
            None => line.to_owned(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn programs_of_tests_are_those_that_cargo_built_as_tests() {
        let message = |test: bool, executable: &str| {
            format!(
                r#"{{"reason":"compiler-artifact","manifest_path":"/w/bus/Cargo.toml","profile":{{"test":{test}}},"executable":{executable}}}"#
            )
        };
        let found = program(&message(true, r#""/w/target/debug/deps/bus-1""#)).expect("a program of tests");
        assert_eq!(
            (found.path.to_str(), found.folder.to_str()),
            (Some("/w/target/debug/deps/bus-1"), Some("/w/bus"))
        );
        assert!(program(&message(false, r#""/w/target/debug/rowscan""#)).is_none());
        assert!(program(&message(true, "null")).is_none());
        assert!(program(r#"{"reason":"build-finished","success":true}"#).is_none());
    }

    fn read(text: &str) -> Counts {
        let mut output = TestOutput::default();
        for line in text.lines() {
            output.read(line);
        }
        output.counts
    }

    #[test]
    fn a_test_that_says_skipped_did_not_pass() {
        let text = "running 3 tests\ntest a ... ok\ntest b ... ok\ntest c ... ok\n\nsuccesses:\n\n---- a stdout ----\n\
                    SKIPPED: no recordings\nSKIPPED: none at all\n\n---- b stdout ----\nmeasured 4\n\n\nsuccesses:\n    a\n    b\n    c\n\n\
                    test result: ok. 3 passed; 0 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.00s\n";
        assert_eq!(read(text), Counts { passed: 2, failed: 0, skipped: 1 });
    }

    #[test]
    fn several_runs_add_up_and_failures_count() {
        let text = "test result: ok. 3 passed; 0 failed; 1 ignored; 0 measured; 0 filtered out; finished in 0.00s\n\
                    failures:\n\n---- x stdout ----\nSKIPPED: not in a success\n\
                    test result: FAILED. 1 passed; 1 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.00s\n";
        assert_eq!(read(text), Counts { passed: 4, failed: 1, skipped: 1 });
    }
}
