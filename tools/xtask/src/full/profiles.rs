//! Ten minutes of simulated time of a picoScan's fastest and finest profile: no segment and no number is missing; `ci` tries four seconds.

use crate::shell;
use crate::steps::Outcome;
use crate::workspace::Workspace;

/// Runs the test of both, optimised: together 83 million beams.
pub fn run(workspace: &Workspace) -> Outcome {
    let test = ["test", "--release", "-p", "rowscan-protocol", "--all-features", "--test", "it"];
    let name = ["--", "the_fastest_and_the_finest_profile", "--nocapture"];
    let mut cargo = workspace.cargo(&[&test[..], &name].concat());
    Outcome::from_result(shell::run(cargo.env("ROWSCAN_PICOSCAN_SECONDS", "600")))
}
