//! Ten runs of the sprayer's controllers in lockstep: the same valves to the byte; `ci` tries two.

use std::path::Path;
use std::process::Command;

use crate::counts::Counts;
use crate::shell;
use crate::steps::Outcome;
use crate::workspace::Workspace;

/// Runs of each.
const RUNS: usize = 10;
/// Scenarios, by what makes their commands.
const SCENARIOS: &[&str] = &["row", "reference", "lines", "isobus"];

/// Runs them; the Python controller is skipped visibly where there is no Python.
pub fn run(workspace: &Workspace) -> Outcome {
    let binary = match workspace.built_binary() {
        Ok(binary) => binary,
        Err(why) => return Outcome::Skipped(why),
    };
    let folder = workspace.root.join("target/sprayer-runs");
    let same = SCENARIOS.iter().try_for_each(|scenario| alike(workspace, &binary, scenario, &folder));
    match same {
        Ok(()) => Outcome::Passed(Counts { passed: (SCENARIOS.len() * RUNS) as u32, ..Counts::default() }),
        Err(why) => Outcome::failed(why),
    }
}

/// Every run of a scenario keeps the same commands and drive.
fn alike(workspace: &Workspace, binary: &Path, scenario: &str, folder: &Path) -> Result<(), String> {
    let path = workspace.root.join("tools/scenarios/sprayer").join(format!("{scenario}.toml"));
    let mut first: Option<Vec<u8>> = None;
    for run in 1..=RUNS {
        let keep = folder.join(format!("{scenario}-{run}"));
        // What an earlier run left there is not this one's.
        let _ = std::fs::remove_dir_all(&keep);
        shell::capture(Command::new(binary).arg("check").arg(&path).arg("--keep").arg(&keep))?;
        let kept = keep.join(format!("01-{scenario}/seed-7-run-1/sprayer.json"));
        let bytes = std::fs::read(&kept).map_err(|error| format!("{}: {error}", kept.display()))?;
        match &first {
            Some(first) if *first != bytes => {
                return Err(format!("{scenario}: run {run} told its valves something else than run 1"));
            }
            Some(_) => {}
            None => first = Some(bytes),
        }
    }
    Ok(())
}
