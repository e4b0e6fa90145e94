//! `cargo test` for the whole workspace, doc tests included, with honest counts: a test that says `SKIPPED:` did not pass.

use std::time::Duration;

use crate::counts::Counts;
use crate::shell::{self, Limit};
use crate::steps::Outcome;
use crate::workspace::{FULL, Workspace};

/// A hanging test fails the run and does not hang it. libtest says nothing while a test runs; the longest takes half a minute on an
/// idle machine, and a loaded one may take ten times as long.
const SILENCE: Limit = Limit::Silent(Duration::from_secs(5 * 60));

/// Builds every test of the workspace and the binary, then runs the tests. A build takes as long as it takes.
pub fn run(workspace: &Workspace) -> Outcome {
    if let Err(why) = workspace.build_binary() {
        return Outcome::failed(why);
    }
    let mut output = TestOutput::default();
    let mut command = workspace.cargo(&["test", "--workspace", "--no-fail-fast"]);
    command.args(FULL).args(["--", "--show-output"]);
    let exit = shell::run_lines(&mut command, SILENCE, |line| {
        if output.read(line) {
            println!("{line}");
        }
    });
    Outcome::from_tests(output.counts, exit)
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
