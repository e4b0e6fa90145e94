//! Installing Debian packages where that is allowed, or unpacking them into a folder where it is not needed.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::OnceLock;

use crate::shell;

/// Makes `programs` available by installing `packages`, if any of them is missing; an error says why that cannot be.
pub fn provide(programs: &[&str], packages: &[&str]) -> Result<(), String> {
    let missing = || programs.iter().filter(|program| !shell::has(program)).copied().collect::<Vec<_>>();
    provide_where(&missing().join(", "), || missing().is_empty(), packages)
}

/// Makes what is called `wanted` available by installing `packages`, if it is not there.
pub fn provide_where(wanted: &str, is_there: impl Fn() -> bool, packages: &[&str]) -> Result<(), String> {
    if is_there() {
        return Ok(());
    }
    if !shell::has("apt-get") {
        return Err(format!("{wanted} not installed, and there is no apt-get"));
    }
    update()?;
    let mut install = apt_get().ok_or("not root")?;
    install.args(["install", "-y", "--no-install-recommends", "-qq"]).args(packages);
    shell::run(install.stdout(Stdio::null()))?;
    is_there().then_some(()).ok_or_else(|| format!("{wanted} not in {}", packages.join(", ")))
}

/// Unpacks packages into `folder` and installs nothing: `whole` ones with what of their dependencies this system lacks, `bare` ones alone.
/// A folder that holds them already is left as it is. Needs no root, unless this system has no package lists yet.
pub fn unpack(folder: &Path, whole: &[&str], bare: &[&str]) -> Result<(), String> {
    let (complete, contents) = (folder.join("complete"), [whole, bare].concat().join(" "));
    if fs::read_to_string(&complete).is_ok_and(|found| found == contents) {
        return Ok(());
    }
    let fail = |error: std::io::Error| format!("{}: {error}", folder.display());
    let _ = fs::remove_dir_all(folder);
    let debs = folder.join("debs");
    fs::create_dir_all(&debs).map_err(fail)?;
    let mut names: Vec<String> = bare.iter().map(|name| (*name).to_owned()).collect();
    names.extend(missing_for(whole)?);
    // Fetching as another user than ours would need a folder that other user can write.
    let mut download = Command::new("apt-get");
    download.args(["-o", "APT::Sandbox::User=", "-qq", "download"]).args(&names).current_dir(&debs);
    shell::run(download.stdout(Stdio::null()))?;
    for deb in fs::read_dir(&debs).map_err(fail)?.flatten() {
        shell::run(Command::new("dpkg").arg("-x").arg(deb.path()).arg(folder))?;
    }
    fs::remove_dir_all(&debs).and_then(|()| fs::write(&complete, contents)).map_err(fail)
}

/// The first package beginning with `prefix` that `package` depends on.
pub fn dependency_of(package: &str, prefix: &str) -> Result<String, String> {
    if !shell::has("apt-get") || !shell::has("dpkg") {
        return Err(format!("{package}: there is no apt-get"));
    }
    let ask = || {
        let said = shell::capture(Command::new("apt-cache").args(["depends", package]))?;
        let found = said.lines().find_map(|line| line.trim().strip_prefix("Depends: ")).map(str::to_owned);
        found.filter(|name| name.starts_with(prefix)).ok_or(format!("{package}: not in the package lists"))
    };
    ask().or_else(|_| update().and_then(|()| ask()))
}

/// The names of `packages` and their dependencies that are not installed.
fn missing_for(packages: &[&str]) -> Result<Vec<String>, String> {
    if packages.is_empty() {
        return Ok(Vec::new());
    }
    let mut simulate = Command::new("apt-get");
    let said =
        shell::capture(simulate.args(["install", "-s", "-y", "--no-install-recommends"]).args(packages))?;
    // `Inst NAME (…)`; one that is there and would only be newer has its version in brackets.
    let lines = said.lines().filter_map(|line| line.strip_prefix("Inst ")?.split_once(' '));
    Ok(lines.filter(|(_, rest)| !rest.starts_with('[')).map(|(name, _)| name.to_owned()).collect())
}

/// Refreshes the package lists, once a run.
fn update() -> Result<(), String> {
    static DONE: OnceLock<Result<(), String>> = OnceLock::new();
    DONE.get_or_init(|| {
        let mut update =
            apt_get().ok_or("programs are missing, and neither root nor `sudo -n` is available")?;
        shell::run(update.args(["update", "-qq"]).stdout(Stdio::null()))
    })
    .clone()
}

/// `apt-get` as root, if we are or may become it without a password.
fn apt_get() -> Option<Command> {
    let quiet = |program: &str, arguments: &[&str]| {
        let output =
            Command::new(program).args(arguments).stdin(Stdio::null()).stderr(Stdio::null()).output();
        output.ok().filter(|output| output.status.success()).map(|output| output.stdout)
    };
    if quiet("id", &["-u"]).is_some_and(|id| id.trim_ascii() == b"0") {
        let mut command = Command::new("apt-get");
        command.env("DEBIAN_FRONTEND", "noninteractive");
        return Some(command);
    }
    quiet("sudo", &["-n", "true"])?;
    let mut command = Command::new("sudo");
    command.args(["-n", "DEBIAN_FRONTEND=noninteractive", "apt-get"]);
    Some(command)
}
