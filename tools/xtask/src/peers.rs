//! `cargo xtask beside`: the caster beside the ray casters that users know, by `tools/beside/beside.py`; docs/beside.md.

use std::fs;
use std::path::Path;
use std::process::ExitCode;

use crate::python::Python;
use crate::shell;
use crate::workspace::Workspace;

/// Measures, with the arguments handed on: `--rounds N`, `--json`.
pub fn command(workspace: &Workspace, arguments: &[String]) -> ExitCode {
    match measure(workspace, arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("xtask beside: {why}");
            ExitCode::FAILURE
        }
    }
}

fn measure(workspace: &Workspace, arguments: &[String]) -> Result<(), String> {
    shell::run(&mut workspace.cargo(&["build", "--release", "--quiet", "-p", "rowscan-benches"]))?;
    let requirements = workspace.root.join("tools/beside/requirements.txt");
    let python = Python::kept(&workspace.scratch("peers")?, &requirements, |python| {
        install_each(python, &requirements)
    })?;
    let mut script = python.command();
    script
        .arg(workspace.root.join("tools/beside/beside.py"))
        .arg(workspace.target.join("release/rowscan-benches"))
        .arg(workspace.scratch("peers")?)
        .args(arguments)
        .env("PYTHONDONTWRITEBYTECODE", "1");
    shell::run(&mut script)
}

/// Installs the packages one by one: one that this machine cannot have is missing, and the others are measured.
fn install_each(python: &Python, requirements: &Path) -> Result<(), String> {
    let wanted = fs::read_to_string(requirements).map_err(|error| format!("requirements.txt: {error}"))?;
    for package in wanted.lines().filter(|line| !line.is_empty() && !line.starts_with('#')) {
        if let Err(why) = shell::run(python.install().arg(package).arg("--constraint").arg(requirements)) {
            eprintln!("    not there: {package}: {why}");
        }
    }
    Ok(())
}
