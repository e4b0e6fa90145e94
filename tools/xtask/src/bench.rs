//! `cargo xtask bench NAME`: ours beside a peer, both in one process, runs interleaved; one JSON object a line.

use std::process::ExitCode;

use crate::workspace::Workspace;

/// A bench: its name and what runs it.
type Bench = (&'static str, fn(&Workspace, &[String]) -> ExitCode);

/// Every bench. A new one is a file beside this one and a line here.
const BENCHES: &[Bench] = &[];

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
