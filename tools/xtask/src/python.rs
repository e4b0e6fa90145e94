//! The clients in tools/python: plain Python sockets and pytest, run against the binary: in `ci` that of the tests, else the one that ships.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use crate::counts::Counts;
use crate::shell::{self, Limit};
use crate::steps::Outcome;
use crate::workspace::Workspace;

/// Every test has a time-out of its own; this one is for a pytest that hangs.
const LIMIT: Limit = Limit::InAll(Duration::from_secs(30 * 60));

/// Where an environment's interpreter is, and its packages where there is none.
const VENV: &str = "venv";
const PACKAGES: &str = "packages";

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
        .args(["-m", "pytest", "-p", "no:cacheprovider", "--color=no", "-ra", "--durations=10"])
        // They mostly wait: for peers, and for time to pass.
        .args(["-n", "3", "--dist", "worksteal"])
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

/// An interpreter with packages of its own.
pub struct Python {
    program: PathBuf,
    /// Where the packages are, if not in a virtual environment.
    packages: Option<PathBuf>,
}

impl Python {
    /// Makes or reuses the environment with the pinned packages below the build directory.
    pub fn prepare(workspace: &Workspace) -> Result<Self, String> {
        let requirements = workspace.root.join("tools/python/requirements.txt");
        Self::kept(&workspace.scratch("python")?, &requirements, |python| {
            shell::run(python.install().arg("--requirement").arg(&requirements))
        })
    }

    /// The environment in `folder`; made anew, with what `install` installs, when `requirements` has changed.
    pub fn kept(
        folder: &Path,
        requirements: &Path,
        install: impl FnOnce(&Self) -> Result<(), String>,
    ) -> Result<Self, String> {
        let wanted =
            fs::read_to_string(requirements).map_err(|error| format!("requirements.txt: {error}"))?;
        let stamp = folder.join("installed.txt");
        if fs::read_to_string(&stamp).is_ok_and(|installed| installed == wanted) {
            return Ok(Self::of(folder));
        }
        let python = Self::make(folder)?;
        install(&python)?;
        fs::write(&stamp, wanted).map_err(|error| format!("{}: {error}", stamp.display()))?;
        Ok(python)
    }

    /// Makes an empty environment in `folder`, in place of an older one. Where the system's Python cannot make one with pip in it (Debian without
    /// python3-venv), pip installs into a plain folder instead.
    pub fn make(folder: &Path) -> Result<Self, String> {
        let (venv, packages) = (folder.join(VENV), folder.join(PACKAGES));
        for old in [&venv, &packages] {
            let _ = fs::remove_dir_all(old);
        }
        if shell::run(Command::new("python3").args(["-m", "venv"]).arg(&venv)).is_err() {
            println!("    no virtual environment here; installing into a plain folder");
            fs::create_dir_all(&packages).map_err(|error| format!("{}: {error}", packages.display()))?;
        }
        Ok(Self::of(folder))
    }

    /// The environment in `folder`.
    fn of(folder: &Path) -> Self {
        let packages = folder.join(PACKAGES);
        match packages.is_dir() {
            true => Self { program: "python3".into(), packages: Some(packages) },
            false => Self { program: folder.join(VENV).join("bin/python"), packages: None },
        }
    }

    /// A command that installs what is named after it.
    pub fn install(&self) -> Command {
        let mut pip = self.command();
        pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-input"]);
        if let Some(packages) = &self.packages {
            pip.arg("--target").arg(packages);
        }
        pip
    }

    /// A command of the interpreter.
    pub fn command(&self) -> Command {
        let mut command = Command::new(&self.program);
        if let Some(packages) = &self.packages {
            command.env("PYTHONPATH", packages);
        }
        command
    }
}
