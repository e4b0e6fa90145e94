//! The demo of the release binary: it ends well, and the same seed prints the same numbers.

use std::process::Command;

use serde_json::Value;

use crate::counts::Counts;
use crate::shell;
use crate::steps::Outcome;
use crate::workspace::Workspace;

/// What depends on how quick the machine is: times, and scans on their way when the row ended.
const TIMES: &[&str] = &["wall_clock_s", "latency_p50_ms", "latency_p99_ms", "scans_sent"];

/// Runs the demo twice with one seed.
pub fn run(workspace: &Workspace) -> Outcome {
    let binary = match workspace.built_binary() {
        Ok(binary) => binary,
        Err(why) => return Outcome::Skipped(why),
    };
    let numbers = || {
        let text = shell::capture(Command::new(&binary).args(["demo", "--seed", "1", "--format", "json"]))?;
        let mut report: Value = serde_json::from_str(&text).map_err(|error| format!("demo: {error}"))?;
        untimed(&mut report);
        Ok::<Value, String>(report)
    };
    match numbers().and_then(|first| Ok((first, numbers()?))) {
        Err(why) => Outcome::failed(why),
        Ok((first, second)) if first == second => Outcome::Passed(Counts { passed: 1, ..Counts::default() }),
        Ok((first, second)) => Outcome::failed(format!("one seed, two demos:\n{first}\n{second}")),
    }
}

/// Takes out how long the run took on this machine.
fn untimed(report: &mut Value) {
    if let Some(report) = report.as_object_mut() {
        report.retain(|key, _| !TIMES.contains(&key.as_str()));
        report.values_mut().for_each(untimed);
    }
}
