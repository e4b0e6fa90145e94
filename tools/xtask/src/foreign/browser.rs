//! The live page in a headless Chromium: what tools/python/test_browser.py looks at and presses.

use std::ffi::OsString;
use std::process::Command;

use super::{debian, with_programs};
use crate::python;
use crate::shell;
use crate::steps::Outcome;
use crate::workspace::Workspace;

/// Opens the page of the release binary and uses it.
pub fn run(workspace: &Workspace) -> Outcome {
    with_programs(workspace, &["chromium"], &["chromium"], |workspace| {
        // It prints figures: none of them is captured.
        python::run_only(workspace, &["-s", "test_browser.py"], &[("ROWSCAN_BROWSER", "1")])
    })
}

/// Runs a script of tools/python that opens the page of the release binary in Chromium. It needs no package, so any Python will do.
pub fn page_script(
    workspace: &Workspace,
    script: &str,
    arguments: impl Iterator<Item = OsString>,
) -> Result<(), String> {
    workspace.build_binary()?;
    debian::provide(&["chromium"], &["chromium"])?;
    let mut python = Command::new("python3");
    python.current_dir(workspace.root.join("tools/python")).arg(script).args(arguments);
    python.env("ROWSCAN_BIN", workspace.built_binary()?).env("PYTHONDONTWRITEBYTECODE", "1");
    shell::run(&mut python)
}
