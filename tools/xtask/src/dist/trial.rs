//! The release files, used as their users use them: from the archive to a first scan, and a Debian package that comes and goes.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use super::files;
use crate::emulator::Emulator;
use crate::shell;
use crate::workspace::Workspace;

/// Whether something could be tried.
pub(super) enum Trial {
    Passed,
    /// It could not, and why.
    Skipped(String),
}

/// Where the client's program is printed, as the first Python block.
const PAGE: &str = "docs/install.md";

/// The address in that program.
const PRINTED_ADDRESS: &str = r#"("127.0.0.1", 2111)"#;

/// Seconds from the archive to the first scan.
const MOST_S: f64 = 60.0;

/// Unpacks the archive into an empty folder, starts its binary, and runs the client of docs/install.md.
pub(super) fn archive(workspace: &Workspace, archive: &Path) -> Result<Trial, String> {
    if !shell::has("python3") {
        return Ok(Trial::Skipped("the first scan from the archive: python3 is not installed".to_owned()));
    }
    let folder = empty(workspace, "dist-archive")?;
    let page = files::read(&workspace.root.join(PAGE))?;
    let client = printed_client(&page)?;
    let start = Instant::now();
    shell::run(Command::new("tar").arg("-xf").arg(archive).arg("-C").arg(&folder))?;
    let name =
        archive.file_name().map(|name| name.to_string_lossy().replace(".tar.gz", "")).unwrap_or_default();
    let emulator = Emulator::of(&folder.join(name).join("rowscan"), &["--tcp", "127.0.0.1:0"])?;
    let (host, port) = emulator.place.split_once(':').ok_or("the emulator's address has no port")?;
    let client = client.replace(PRINTED_ADDRESS, &format!("({host:?}, {port})"));
    let said =
        shell::capture(Command::new("timeout").args(["60", "python3", "-c", &client]).current_dir(&folder))?;
    let seconds = start.elapsed().as_secs_f64();
    emulator.stop()?;
    println!("    {seconds:.2} s from the archive to the first scan in {PAGE}'s client: {}", said.trim());
    if !said.contains("541 ranges") {
        return Err(format!("the client of {PAGE} has read no scan: {said}"));
    }
    if seconds > MOST_S {
        return Err(format!("the first scan took {seconds:.0} s, more than {MOST_S:.0}"));
    }
    Ok(Trial::Passed)
}

/// The program in the first Python block of a page.
fn printed_client(page: &str) -> Result<&str, String> {
    let block =
        page.split_once("```python\n").and_then(|(_, rest)| rest.split_once("```")).map(|(block, _)| block);
    block
        .filter(|block| block.contains(PRINTED_ADDRESS))
        .ok_or(format!("{PAGE} has no Python block with {PRINTED_ADDRESS}"))
}

/// Installs the package into an empty root of its own, runs its program, removes it: nothing may be left.
pub(super) fn package(workspace: &Workspace, package: Option<&Path>) -> Result<Trial, String> {
    let Some(package) = package else {
        return Ok(Trial::Skipped("the Debian package: none was made".to_owned()));
    };
    if !shell::has("dpkg") {
        return Ok(Trial::Skipped("the Debian package: dpkg is not installed".to_owned()));
    }
    let root = empty(workspace, "dist-debian")?;
    let dpkg = |arguments: &[&str]| {
        let mut dpkg = Command::new("dpkg");
        dpkg.arg("--root").arg(&root).arg("--force-not-root").arg("--force-script-chrootless");
        dpkg.arg("--log").arg(root.join("dpkg.log")).args(arguments);
        dpkg
    };
    for file in ["status", "available", "info/format", "updates/.keep"] {
        files::write(&root.join("var/lib/dpkg").join(file), if file == "info/format" { "1\n" } else { "" })?;
    }
    let before = everything_below(&root)?;
    shell::run(dpkg(&["--install"]).arg(package))?;
    let installed = everything_below(&root)?;
    let version = shell::capture(Command::new(root.join("usr/bin/rowscan")).arg("--version"))?;
    shell::run(&mut dpkg(&["--purge", "rowscan"]))?;
    let left: Vec<PathBuf> =
        everything_below(&root)?.into_iter().filter(|path| !before.contains(path)).collect();
    println!(
        "    {}: {} files and folders installed, {} left after its removal",
        version.trim(),
        installed.len() - before.len(),
        left.len()
    );
    if left.is_empty() { Ok(Trial::Passed) } else { Err(format!("the package leaves {left:?}")) }
}

/// An empty folder for one trial.
fn empty(workspace: &Workspace, name: &str) -> Result<PathBuf, String> {
    let folder = workspace.scratch(name)?;
    fs::remove_dir_all(&folder)
        .and_then(|()| fs::create_dir(&folder))
        .map_err(|error| format!("{}: {error}", folder.display()))?;
    Ok(folder)
}

/// Files and folders in a root, without dpkg's own records.
fn everything_below(root: &Path) -> Result<Vec<PathBuf>, String> {
    let mut found = Vec::new();
    let mut open = vec![root.to_path_buf()];
    while let Some(folder) = open.pop() {
        let entries = fs::read_dir(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
        for path in entries.filter_map(Result::ok).map(|entry| entry.path()) {
            if path.ends_with("var/lib/dpkg") || path.ends_with("dpkg.log") {
                continue;
            }
            if path.is_dir() && !path.is_symlink() {
                open.push(path.clone());
            }
            found.push(path);
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_client_is_the_page_s_first_program() {
        let page = "# Install\n```sh\nls\n```\n```python\nconnect((\"127.0.0.1\", 2111))\n```\n```python\nother\n```\n";
        assert_eq!(printed_client(page), Ok("connect((\"127.0.0.1\", 2111))\n"));
        assert!(printed_client("```python\nother\n```\n").is_err());
    }
}
