//! `cargo xtask screenshots [NAME…]`: pictures of the live page for docs/watch.md, made anew by the release binary and a headless Chromium.

use std::process::{Command, ExitCode};

use crate::foreign;
use crate::shell;
use crate::workspace::Workspace;

/// Makes the pictures named, or all.
pub fn command(workspace: &Workspace, arguments: &[String]) -> ExitCode {
    match make(workspace, arguments) {
        Ok(()) => {
            println!("look at each before it is committed");
            ExitCode::SUCCESS
        }
        Err(why) => {
            eprintln!("xtask screenshots: {why}");
            ExitCode::FAILURE
        }
    }
}

/// The script needs no package, so any Python will do.
fn make(workspace: &Workspace, wanted: &[String]) -> Result<(), String> {
    workspace.build_binary()?;
    foreign::chromium()?;
    let mut python = Command::new("python3");
    python.current_dir(workspace.root.join("tools/python")).arg("screenshots.py");
    python.arg(workspace.root.join("docs/figures")).args(wanted);
    python.env("ROWSCAN_BIN", workspace.built_binary()?).env("PYTHONDONTWRITEBYTECODE", "1");
    shell::run(&mut python)
}
