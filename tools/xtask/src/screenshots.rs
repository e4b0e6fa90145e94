//! `cargo xtask screenshots [NAME…]`: pictures of the live page for docs/watch.md, made anew by the release binary and a headless Chromium.

use std::ffi::OsString;
use std::process::ExitCode;

use crate::foreign;
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

fn make(workspace: &Workspace, wanted: &[String]) -> Result<(), String> {
    let figures = workspace.root.join("docs/figures").into_os_string();
    foreign::page_script(
        workspace,
        "screenshots.py",
        std::iter::once(figures).chain(wanted.iter().map(OsString::from)),
    )
}
