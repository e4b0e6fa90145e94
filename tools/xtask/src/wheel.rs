//! The Python package: a wheel by maturin, installed into an environment that is made for it, and its tests there.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::counts::Counts;
use crate::python::Python;
use crate::shell::{self, Limit};
use crate::steps::Outcome;
use crate::workspace::Workspace;

/// Every test has a time-out of its own; this one is for a pytest that hangs.
const LIMIT: Limit = Limit::InAll(Duration::from_secs(10 * 60));

/// What the tests use besides the package itself.
const BESIDES: &[&str] = &["pytest", "pytest-timeout", "pandas", "pyserial"];

/// A development wheel, installed and tested.
pub fn run(workspace: &Workspace) -> Outcome {
    test(workspace, &[])
}

/// A development wheel, built: what takes long of [`run`].
pub fn build_only(workspace: &Workspace) -> Outcome {
    if !shell::has("python3") {
        return Outcome::Skipped("python3 is not installed".to_owned());
    }
    let built = workspace.scratch("wheel").and_then(|folder| build(workspace, &folder.join("early")));
    Outcome::from_result(built.map(drop))
}

/// Builds a wheel, installs it and runs the tests; those that need the packages in `further` are skipped where these cannot be had.
pub fn test(workspace: &Workspace, further: &[&str]) -> Outcome {
    if !shell::has("python3") {
        return Outcome::Skipped("python3 is not installed".to_owned());
    }
    let python = match installed(workspace) {
        Ok(python) => python,
        Err(why) => return Outcome::failed(why),
    };
    if !further.is_empty()
        && let Err(why) = shell::run(python.install().args(further))
    {
        println!("SKIPPED: {}: {why}", further.join(", "));
    }
    run_tests(workspace, &python)
}

/// An environment with nothing in it but a new wheel and what its tests use.
fn installed(workspace: &Workspace) -> Result<Python, String> {
    let folder = workspace.scratch("wheel")?;
    let wheel = build(workspace, &folder.join(workspace.profile.name()))?;
    let python = Python::make(&folder)?;
    let pins = workspace.root.join("tools/python/requirements.txt");
    shell::run(python.install().arg("--constraint").arg(pins).arg(&wheel).args(BESIDES))?;
    Ok(python)
}

/// Builds the wheel as it ships, for this machine or another target, into `folder`; where it is.
pub fn build_for(workspace: &Workspace, target: Option<&str>, folder: &Path) -> Result<PathBuf, String> {
    let made = maturin(workspace, &workspace.scratch("wheel")?.join("ships"), target)?;
    fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let given = folder.join(made.file_name().unwrap_or_default());
    fs::copy(&made, &given).map_err(|error| format!("{}: {error}", given.display()))?;
    Ok(given)
}

/// Builds the wheel for this machine with the pinned maturin; where it is.
fn build(workspace: &Workspace, out: &Path) -> Result<PathBuf, String> {
    maturin(workspace, out, None)
}

fn maturin(workspace: &Workspace, out: &Path, target: Option<&str>) -> Result<PathBuf, String> {
    let _ = fs::remove_dir_all(out);
    let mut maturin = Python::prepare(workspace)?.command();
    maturin
        .args(["-m", "maturin", "build", "--quiet", "--locked", "--profile", workspace.profile.name()])
        .arg("--out")
        .arg(out)
        .env("CARGO_TARGET_DIR", &workspace.target)
        .current_dir(workspace.root.join("python"));
    if let Some(target) = target {
        maturin.args(["--target", target]);
    }
    if target.is_none_or(|target| target.contains("linux")) {
        maturin.args(["--compatibility", "linux"]);
    }
    shell::run(&mut maturin)?;
    let wheels = fs::read_dir(out).map_err(|error| format!("{}: {error}", out.display()))?;
    let mut wheels = wheels.filter_map(Result::ok).map(|entry| entry.path());
    let wheel = wheels.find(|path| path.extension().is_some_and(|extension| extension == "whl"));
    let wheel = wheel.ok_or_else(|| format!("maturin has left no wheel in {}", out.display()))?;
    let bytes = fs::metadata(&wheel).map_or(0, |about| about.len());
    println!("    {} MB: {}", bytes / 1_000_000, wheel.display());
    Ok(wheel)
}

fn run_tests(workspace: &Workspace, python: &Python) -> Outcome {
    let mut counts = Counts::default();
    let mut command = python.command();
    command
        .args(["-m", "pytest", "-p", "no:cacheprovider", "--color=no", "-ra"])
        // As its users do: from the package's folder.
        .current_dir(workspace.root.join("python"))
        .env("PYTHONDONTWRITEBYTECODE", "1");
    if let Ok(binary) = workspace.built_binary() {
        command.env("ROWSCAN_BIN", binary);
    }
    let exit = shell::run_lines(&mut command, LIMIT, |line| {
        println!("{line}");
        counts = Counts::from_pytest(line).unwrap_or(counts);
    });
    Outcome::from_tests(counts, exit)
}
