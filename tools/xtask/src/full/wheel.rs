//! The wheel as it ships: built in release, installed and tested, with the notebook.

use crate::steps::Outcome;
use crate::wheel;
use crate::workspace::Workspace;

/// What runs a notebook, and draws in it.
const NOTEBOOK: &[&str] = &["nbclient", "nbformat", "ipykernel", "matplotlib"];

/// The package's own tests on the release wheel.
pub fn run(workspace: &Workspace) -> Outcome {
    wheel::test(workspace, NOTEBOOK)
}
