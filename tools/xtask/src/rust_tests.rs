//! The tests of the whole workspace, with honest counts: a test that says `SKIPPED:` did not pass.
//!
//! Cargo builds them, and they are run from here: while they run, cargo is free for the steps beside them.

use std::path::{Path, PathBuf};
use std::process::Command;
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

/// Runs what [`build`] built, one program after the other.
pub fn run(workspace: &Workspace) -> Outcome {
    let programs = match programs(workspace) {
        Ok(programs) => programs,
        Err(why) => return Outcome::failed(why),
    };
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = (TESTS_A_PROCESSOR * processors).to_string();
    let (mut counts, mut failures) = (Counts::default(), Vec::new());
    for program in &programs {
        let mut output = TestOutput::default();
        let mut command = Command::new(&program.path);
        command.args(["--show-output", "--test-threads", &threads]).current_dir(&program.folder);
        println!(
            "     Running {}",
            program.path.strip_prefix(&workspace.target).unwrap_or(&program.path).display()
        );
        let exit = shell::run_lines(&mut command, SILENCE, |line| {
            if output.read(line) {
                println!("{line}");
            }
        });
        counts += output.counts;
        failures.extend(exit.err());
    }
    Outcome::from_tests(counts, if failures.is_empty() { Ok(()) } else { Err(failures.join("\n")) })
}

/// Examples in the documentation of libraries, which cargo compiles and runs.
pub fn run_examples(workspace: &Workspace) -> Outcome {
    let mut output = TestOutput::default();
    let mut command = workspace.cargo(&["test", "--workspace", "--doc", "--no-fail-fast", "--quiet"]);
    command.args(FULL).args(["--", "--show-output"]);
    let exit = shell::run_lines(&mut command, SILENCE, |line| {
        if output.read(line) {
            println!("{line}");
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
    /// Takes a line; true if it is worth showing.
    fn read(&mut self, line: &str) -> bool {
        if let Some(mut counts) = Counts::from_libtest(line) {
            let skipped = std::mem::take(&mut self.said_skipped);
            counts.passed = counts.passed.saturating_sub(skipped);
            counts.skipped += skipped;
            self.counts += counts;
            self.in_successes = false;
            return true;
        }
        match line {
            "successes:" => self.in_successes = true,
            "failures:" => self.in_successes = false,
            _ => {}
        }
        if !self.in_successes {
            return !line.ends_with(" ... ok") && !line.is_empty();
        }
        if let Some(name) = line.strip_prefix("---- ").and_then(|rest| rest.strip_suffix(" stdout ----")) {
            self.test = Some(name.to_owned());
        }
        if !line.starts_with("SKIPPED:") {
            return false;
        }
        if let Some(test) = self.test.take() {
            self.said_skipped += 1;
            println!("{test}:");
        }
        true
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
