//! Installing Debian packages where that is allowed.

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
