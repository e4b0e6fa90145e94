//! The archive: one folder with the binary, the library for children's time, the manual, completions, licences, the systemd unit and the Containerfile.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::{Dist, files, manual};
use crate::shell;

/// Files of the repository that go into it as they are.
const FILES: &[&str] = &[
    "README.md",
    "CHANGELOG.md",
    "LICENSE-MIT",
    "LICENSE-APACHE",
    "tools/dist/rowscan@.service",
    "tools/dist/Containerfile",
];

/// The file of checksums.
pub(super) const SUMS: &str = "SHA256SUMS";

/// The same content gives the same bytes: no times, no owners, sorted.
const SAME_BYTES: &[&str] = &[
    "--sort=name",
    "--owner=0",
    "--group=0",
    "--numeric-owner",
    "--mtime=@0",
    "--use-compress-program=gzip -9n",
];

/// Packs it; where it is.
pub(super) fn make(dist: &Dist<'_>, binary: &Path, library: Option<&Path>) -> Result<PathBuf, String> {
    let name = format!("rowscan-{}-{}", dist.version, dist.target);
    let stage = dist.folder.join(&name);
    for built in library.into_iter().chain([binary]) {
        files::copy(built, &stage.join(built.file_name().unwrap_or_default()))?;
    }
    for file in FILES {
        let from = dist.workspace.root.join(file);
        files::copy(&from, &stage.join(from.file_name().unwrap_or_default()))?;
    }
    let manual = manual::folder(dist);
    shell::run(
        Command::new("cp").arg("-r").arg(manual.join("man")).arg(manual.join("completions")).arg(&stage),
    )?;
    let archive = dist.folder.join(format!("{name}.tar.gz"));
    // Of macOS it is another tar, and GNU's has this name.
    let mut tar = Command::new(if shell::has("gtar") { "gtar" } else { "tar" });
    tar.args(SAME_BYTES).arg("-C").arg(&dist.folder).arg("-cf").arg(&archive).arg(&name);
    shell::run(&mut tar)?;
    fs::remove_dir_all(&stage).map_err(|error| format!("{}: {error}", stage.display()))?;
    Ok(archive)
}

/// SHA-256 of the release files, in a file of theirs.
pub(super) fn write_checksums(folder: &Path, given: &[PathBuf]) -> Result<(), String> {
    let mut names: Vec<_> = given.iter().filter_map(|file| file.file_name()).collect();
    names.sort();
    if names.is_empty() {
        return Err(format!("{}: nothing to sum; `cargo xtask dist` makes it", folder.display()));
    }
    let sums = shell::capture(Command::new("sha256sum").args(names).current_dir(folder))?;
    files::write(&folder.join(SUMS), &sums)
}
