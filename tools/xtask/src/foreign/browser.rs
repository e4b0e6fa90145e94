//! The live page in a headless Chromium: what tools/python/test_browser.py looks at and presses.

use super::with_programs;
use crate::python;
use crate::steps::Outcome;
use crate::workspace::Workspace;

/// Opens the page of the release binary and uses it.
pub fn run(workspace: &Workspace) -> Outcome {
    with_programs(workspace, &["chromium"], &["chromium"], |workspace| {
        // It prints figures: none of them is captured.
        python::run_only(workspace, &["-s", "test_browser.py"], &[("ROWSCAN_BROWSER", "1")])
    })
}
