//! What the live page costs a headless Chromium without a graphics card: tools/python/page_rate.py measures it.

use std::ffi::OsString;
use std::process::ExitCode;

use crate::foreign;
use crate::workspace::Workspace;

/// Measures and prints one JSON object a scene; the script's seconds may follow.
pub fn run(workspace: &Workspace, arguments: &[String]) -> ExitCode {
    match foreign::page_script(workspace, "page_rate.py", arguments.iter().map(OsString::from)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("xtask bench page: {why}");
            ExitCode::FAILURE
        }
    }
}
