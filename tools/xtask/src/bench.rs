//! `cargo xtask bench NAME`: ours beside a peer, both in one process, runs interleaved; one JSON object a line.

mod latency;
mod page;

use std::process::ExitCode;

use crate::workspace::Workspace;

/// A bench: its name and what runs it.
type Bench = (&'static str, fn(&Workspace, &[String]) -> ExitCode);

/// Every bench. A new one is a file beside this one and a line here.
const BENCHES: &[Bench] = &[
    ("caster", |workspace, arguments| beside_peers(workspace, "caster", arguments)),
    ("codec", |workspace, arguments| beside_peers(workspace, "codec", arguments)),
    ("fleet", |workspace, arguments| beside_peers(workspace, "fleet", arguments)),
    ("hectare", |workspace, arguments| beside_peers(workspace, "hectare", arguments)),
    ("latency", latency::run),
    ("lockstep", |workspace, arguments| beside_peers(workspace, "lockstep", arguments)),
    ("optics", |workspace, arguments| beside_peers(workspace, "optics", arguments)),
    ("page", page::run),
    ("proxy", |workspace, arguments| beside_peers(workspace, "proxy", arguments)),
    ("replay", |workspace, arguments| beside_peers(workspace, "replay", arguments)),
    ("shady", |workspace, arguments| beside_peers(workspace, "shady", arguments)),
    ("sprayer", |workspace, arguments| beside_peers(workspace, "sprayer", arguments)),
    ("web", |workspace, arguments| beside_peers(workspace, "web", arguments)),
];

/// Builds and runs a bench of `tools/bench`.
fn beside_peers(workspace: &Workspace, name: &str, arguments: &[String]) -> ExitCode {
    let mut cargo = workspace.cargo(&["run", "--release", "--quiet", "-p", "rowscan-benches", "--", name]);
    match cargo.args(arguments).status() {
        Ok(status) if status.success() => ExitCode::SUCCESS,
        Ok(_) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("xtask bench: cannot run cargo: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Runs the bench named first in `arguments`.
pub fn command(workspace: &Workspace, arguments: &[String]) -> ExitCode {
    let wanted = arguments.first().map(String::as_str);
    if let Some((_, run)) = BENCHES.iter().find(|(name, _)| Some(*name) == wanted) {
        return run(workspace, &arguments[1..]);
    }
    let names: Vec<&str> = BENCHES.iter().map(|(name, _)| *name).collect();
    match wanted {
        Some(name) => eprintln!("xtask bench: there is no bench `{name}`"),
        None => eprintln!("usage: cargo xtask bench NAME [--format json]"),
    }
    eprintln!("benches: {}", if names.is_empty() { "none yet".to_owned() } else { names.join(", ") });
    ExitCode::from(2)
}
