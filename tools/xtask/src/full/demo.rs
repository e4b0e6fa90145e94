//! The demo of the release binary, which has the default parts alone: it ends well, the same seed prints the same numbers, and a part that is left out
//! is refused with the command that builds it.

use std::path::Path;
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
        Ok((first, second)) if first != second => {
            Outcome::failed(format!("one seed, two demos:\n{first}\n{second}"))
        }
        Ok(_) => match refuses_a_picture(&binary) {
            Err(why) => Outcome::failed(why),
            Ok(()) => Outcome::Passed(Counts { passed: 2, ..Counts::default() }),
        },
    }
}

/// A picture as PNG is no default part.
fn refuses_a_picture(binary: &Path) -> Result<(), String> {
    let mut demo = Command::new(binary);
    let ended = demo.args(["demo", "--picture", "demo.png"]).output().map_err(|error| error.to_string())?;
    let said = String::from_utf8_lossy(&ended.stderr);
    match ended.status.code() == Some(2) && said.contains("cargo build --release --features figures") {
        true => Ok(()),
        false => Err(format!("demo --picture demo.png: {}: {said}", ended.status)),
    }
}

/// Takes out how long the run took on this machine.
fn untimed(report: &mut Value) {
    if let Some(report) = report.as_object_mut() {
        report.retain(|key, _| !TIMES.contains(&key.as_str()));
        report.values_mut().for_each(untimed);
    }
}
