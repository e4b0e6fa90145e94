//! `cargo xtask full`: what takes longer than `ci` may. A step that cannot run on a machine is skipped visibly.

mod demo;
mod fuzz;
mod lockstep;
mod publish;
mod wheel;

use std::process::ExitCode;

use crate::dist;
use crate::steps::{self, Outcome, Step};
use crate::workspace::Workspace;

/// Every step. A new one is a file beside these and a line here.
const STEPS: &[Step] = &[
    Step::new("release-build", |workspace| Outcome::from_result(workspace.build_binary())),
    Step::new("demo", demo::run),
    Step::new("lockstep", lockstep::run),
    Step::new("wheel", wheel::run),
    Step::new("dist", dist::run),
    Step::new("publish", publish::run),
    Step::new("fuzz", fuzz::run),
];

/// Runs every step, or those named in `arguments`.
pub fn command(workspace: &Workspace, arguments: &[String]) -> ExitCode {
    steps::run(workspace, STEPS, arguments)
}
