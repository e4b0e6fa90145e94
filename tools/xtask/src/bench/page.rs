//! What the live page costs a headless Chromium without a graphics card: tools/python/page_rate.py measures it.

use std::process::{Command, ExitCode};

use crate::foreign;
use crate::shell;
use crate::workspace::Workspace;

/// Measures and prints one JSON object a scene; the script's seconds may follow.
pub fn run(workspace: &Workspace, arguments: &[String]) -> ExitCode {
    match measure(workspace, arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("xtask bench page: {why}");
            ExitCode::FAILURE
        }
    }
}

/// The script needs no package, so any Python will do.
fn measure(workspace: &Workspace, arguments: &[String]) -> Result<(), String> {
    workspace.build_binary()?;
    foreign::chromium()?;
    let mut python = Command::new("python3");
    python.current_dir(workspace.root.join("tools/python")).arg("page_rate.py").args(arguments);
    python.env("ROWSCAN_BIN", workspace.built_binary()?).env("PYTHONDONTWRITEBYTECODE", "1");
    shell::run(&mut python)
}
