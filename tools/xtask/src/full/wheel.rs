//! The wheel as it ships: built in release, installed and tested.

use crate::steps::Outcome;
use crate::wheel::{self, Profile};
use crate::workspace::Workspace;

/// The package's own tests on the release wheel.
pub fn run(workspace: &Workspace) -> Outcome {
    wheel::test(workspace, Profile::Release, wheel::BESIDES)
}
