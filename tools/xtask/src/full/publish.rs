//! What a registry would be sent: every crate that is published, packed and built from its package alone.

use std::process::Stdio;

use crate::counts::Counts;
use crate::steps::Outcome;
use crate::workspace::Workspace;

/// What cargo says where it reaches no registry.
const UNREACHABLE: &[&str] =
    &["failed to query replaced source", "failed to update registry", "network", "resolve host"];

/// A dry run of `cargo publish`; the work tree may hold changes.
pub fn run(workspace: &Workspace) -> Outcome {
    let mut cargo = workspace.cargo(&["publish", "--workspace", "--dry-run", "--allow-dirty"]);
    let output = match cargo.stdin(Stdio::null()).output() {
        Ok(output) => output,
        Err(error) => return Outcome::failed(format!("cannot run cargo: {error}")),
    };
    let text = String::from_utf8_lossy(&output.stderr);
    if output.status.success() {
        let packed = text.lines().filter(|line| line.trim_start().starts_with("Uploading ")).count();
        println!("    {packed} crates packed and built");
        return Outcome::Passed(Counts {
            passed: u32::try_from(packed).unwrap_or(u32::MAX),
            ..Counts::default()
        });
    }
    match text.lines().find(|line| UNREACHABLE.iter().any(|said| line.contains(said))) {
        Some(line) => Outcome::Skipped(format!("no registry: {}", line.trim())),
        None => Outcome::failed(text.into_owned()),
    }
}
