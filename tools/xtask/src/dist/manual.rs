//! What the binary writes about itself: the manual's pages and the shells' completions.

use std::path::{Path, PathBuf};
use std::process::Command;

use super::{Dist, binary, files};
use crate::shell;

/// Shells, and what their completion files are called.
const SHELLS: &[(&str, &str)] = &[("bash", "rowscan.bash"), ("zsh", "_rowscan"), ("fish", "rowscan.fish")];

/// The folder that holds `man` and `completions`. It stands beside the built binary, where cargo-deb looks for files that are made.
pub(super) fn folder(dist: &Dist<'_>) -> PathBuf {
    binary::built_folder(dist).join("manual")
}

/// Has a binary of this machine write them.
pub(super) fn write(dist: &Dist<'_>, binary: &Path) -> Result<(), String> {
    let folder = folder(dist);
    let _ = std::fs::remove_dir_all(&folder);
    // A program for another machine cannot say it; the one of this machine says the same.
    let speaker = if dist.target.starts_with(std::env::consts::ARCH) {
        binary.to_path_buf()
    } else {
        dist.workspace.built_binary()?
    };
    shell::run(Command::new(&speaker).arg("man").arg(folder.join("man")))?;
    let pages = files::all_in(&folder.join("man"))?;
    shell::run(Command::new("gzip").arg("-9n").args(pages))?;
    for (name, file) in SHELLS {
        let script = shell::capture(Command::new(&speaker).args(["completions", name]))?;
        files::write(&folder.join("completions").join(file), &script)?;
    }
    Ok(())
}
