//! The clients in tools/python: plain Python sockets and pytest, run against the release binary.

use std::fs;
use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;

use crate::counts::Counts;
use crate::shell::{self, Limit};
use crate::steps::Outcome;
use crate::workspace::Workspace;

/// Every test has a time-out of its own; this one is for a pytest that hangs.
const LIMIT: Limit = Limit::InAll(Duration::from_secs(30 * 60));

/// Installs the pinned packages (once) and runs the tests.
pub fn run(workspace: &Workspace) -> Outcome {
    run_only(workspace, &[], &[])
}

/// The same of these files alone, in this environment.
pub fn run_only(workspace: &Workspace, files: &[&str], environment: &[(&str, &str)]) -> Outcome {
    if !shell::has("python3") {
        return Outcome::Skipped("python3 is not installed".to_owned());
    }
    let binary = match workspace.built_binary() {
        Ok(binary) => binary,
        Err(why) => return Outcome::Skipped(why),
    };
    let python = match Python::prepare(workspace) {
        Ok(python) => python,
        Err(why) => return Outcome::failed(why),
    };
    let mut counts = Counts::default();
    let mut command = python.command();
    command
        .args(["-m", "pytest", "-p", "no:cacheprovider", "--color=no", "-ra"])
        .args(files)
        .envs(environment.iter().copied())
        .current_dir(workspace.root.join("tools/python"))
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .env("ROWSCAN_BIN", binary);
    let exit = shell::run_lines(&mut command, LIMIT, |line| {
        println!("{line}");
        counts = Counts::from_pytest(line).unwrap_or(counts);
    });
    Outcome::from_tests(counts, exit)
}

/// An interpreter that sees the pinned packages.
struct Python {
    program: PathBuf,
    /// Where the packages are, if not in a virtual environment.
    packages: Option<PathBuf>,
}

impl Python {
    /// Makes or reuses the environment below the build directory. Where the system's Python cannot make one with pip in it
    /// (Debian without python3-venv), pip installs into a plain folder instead.
    fn prepare(workspace: &Workspace) -> Result<Self, String> {
        let requirements = workspace.root.join("tools/python/requirements.txt");
        let wanted =
            fs::read_to_string(&requirements).map_err(|error| format!("requirements.txt: {error}"))?;
        let folder = workspace.scratch("python")?;
        let (venv, packages, stamp) =
            (folder.join("venv"), folder.join("packages"), folder.join("installed.txt"));
        let in_venv = Self { program: venv.join("bin/python"), packages: None };
        let in_folder = Self { program: "python3".into(), packages: Some(packages.clone()) };
        if fs::read_to_string(&stamp).is_ok_and(|installed| installed == wanted) {
            return Ok(if packages.is_dir() { in_folder } else { in_venv });
        }
        for old in [&venv, &packages] {
            let _ = fs::remove_dir_all(old);
        }
        let made = shell::run(Command::new("python3").args(["-m", "venv"]).arg(&venv));
        let python = if made.is_ok() {
            in_venv
        } else {
            println!("    no virtual environment here; installing into a plain folder");
            in_folder
        };
        let mut pip = python.command();
        pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-input"]);
        if let Some(packages) = &python.packages {
            pip.arg("--target").arg(packages);
        }
        shell::run(pip.arg("--requirement").arg(&requirements))?;
        fs::write(&stamp, wanted).map_err(|error| format!("{}: {error}", stamp.display()))?;
        Ok(python)
    }

    fn command(&self) -> Command {
        let mut command = Command::new(&self.program);
        if let Some(packages) = &self.packages {
            command.env("PYTHONPATH", packages);
        }
        command
    }
}
