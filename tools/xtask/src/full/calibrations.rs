//! Every shipped calibration is made again by its command; `ci` makes one of each family.

use crate::shell;
use crate::steps::Outcome;
use crate::workspace::{FULL, Workspace};

/// Runs the test of calibrations over all of them, optimised: through the eye a calibration takes minutes.
pub fn run(workspace: &Workspace) -> Outcome {
    let test = ["test", "--release", "-p", "rowscan", "--test", "it"];
    let mut cargo = workspace.cargo(&[&test[..], &FULL, &["--", "calibrations::", "--nocapture"]].concat());
    Outcome::from_result(shell::run(cargo.env("ROWSCAN_ALL_CALIBRATIONS", "1")))
}
