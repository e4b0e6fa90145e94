//! The survey by mutation for five seeds; `ci` tries the scenarios' own.

use std::process::Command;

use crate::shell;
use crate::steps::Outcome;
use crate::workspace::{CHILD_CLOCK, Workspace};

/// Runs it. The library for children whose time is simulated stands beside the program.
pub fn run(workspace: &Workspace) -> Outcome {
    let library = shell::run(&mut workspace.cargo(&["build", "--release", "-p", CHILD_CLOCK]));
    let binary = match library.and_then(|()| workspace.built_binary()) {
        Ok(binary) => binary,
        Err(why) => return Outcome::failed(why),
    };
    let survey = workspace.root.join("tools/scenarios/survey/survey.py");
    let tried = (1..=5).map(|seed: u32| {
        let mut command = Command::new("python3");
        shell::run(command.arg(&survey).arg(&binary).args(["--seed", &seed.to_string()]))
    });
    let failed: Vec<String> = tried.filter_map(Result::err).collect();
    Outcome::from_result(if failed.is_empty() { Ok(()) } else { Err(failed.join("\n")) })
}
