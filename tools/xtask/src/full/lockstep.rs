//! The proof of the lockstep clock for twenty seeds; `ci` tries three.

use crate::python;
use crate::steps::Outcome;
use crate::workspace::Workspace;

/// Runs it.
pub fn run(workspace: &Workspace) -> Outcome {
    python::run_only(workspace, &["test_lockstep.py"], &[("ROWSCAN_LOCKSTEP_SEEDS", "20")])
}
