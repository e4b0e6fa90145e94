//! `cargo xtask foreign`: programs nobody here wrote, from Debian packages, against the binary of the tests.
//!
//! A part that cannot run here (no root, no network, no Debian) is skipped visibly; a part that runs and fails is a failure.

mod browser;
mod capture;
mod debian;
mod maps;
mod mrpt;
mod socat;
mod vcan;

pub use browser::page_script;

use std::process::ExitCode;

use crate::steps::{self, Outcome, Step};
use crate::workspace::{Profile, Workspace};

/// Every part, after the binary they talk to. A new one is a file beside this one and a line here.
const PARTS: &[Step] = &[
    BUILD,
    Step::new("socat", socat::run).taking(2),
    Step::new("mrpt", mrpt::run).taking(4),
    Step::new("capture", capture::run).taking(2),
    Step::new("maps", maps::run).taking(1),
    Step::new("browser", browser::run).taking(4),
    VCAN,
];

/// The binary, as the tests are built with it: after `ci` it is there.
const BUILD: Step = Step::new("build", |workspace| Outcome::from_result(workspace.build_binary()));

/// SocketCAN in a virtual machine.
const VCAN: Step = Step::new("vcan", vcan::run).taking(4);

/// `cargo xtask vcan`: that part alone, with the binary as it stands.
pub fn vcan(workspace: &Workspace, _: &[String]) -> ExitCode {
    command(workspace, &["build", "vcan"].map(str::to_owned))
}

/// Runs every part, or those named in `arguments`.
pub fn command(workspace: &Workspace, arguments: &[String]) -> ExitCode {
    steps::run(&Workspace { profile: Profile::Dev, ..workspace.clone() }, PARTS, arguments)
}

/// Runs `part` once its programs are there, which come in Debian `packages`; skips it where they cannot be had.
fn with_programs(
    workspace: &Workspace,
    programs: &[&str],
    packages: &[&str],
    part: impl FnOnce(&Workspace) -> Outcome,
) -> Outcome {
    if let Err(why) = workspace.built_binary() {
        return Outcome::Skipped(why);
    }
    match debian::provide(programs, packages) {
        Ok(()) => part(workspace),
        Err(why) => Outcome::Skipped(why),
    }
}
