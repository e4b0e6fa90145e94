//! `cargo xtask full`: what takes longer than `ci` may. A step that cannot run on a machine is skipped visibly.

mod calibrations;
mod demo;
mod fuzz;
mod lockstep;
mod profiles;
mod publish;
mod sprayer;
mod survey;
mod wheel;

use std::process::ExitCode;

use crate::dist;
use crate::steps::{self, RELEASE_BUILD, Step};
use crate::workspace::Workspace;

/// Every step. A new one is a file beside these and a line here.
const STEPS: &[Step] = &[
    RELEASE_BUILD,
    Step::new("demo", demo::run).taking(1),
    Step::new("calibrations", calibrations::run).taking(30),
    Step::new("lockstep", lockstep::run).taking(8),
    Step::new("profiles", profiles::run).taking(5),
    Step::new("sprayer", sprayer::run).taking(3),
    Step::new("survey", survey::run).taking(10),
    Step::new("wheel", wheel::run).taking(6),
    Step::new("dist", dist::run).taking(20),
    Step::new("publish", publish::run).taking(14),
    Step::new("fuzz", fuzz::run).taking(12),
];

/// Runs every step, or those named in `arguments`.
pub fn command(workspace: &Workspace, arguments: &[String]) -> ExitCode {
    steps::run(workspace, STEPS, arguments)
}
