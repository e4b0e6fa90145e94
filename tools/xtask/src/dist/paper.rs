//! What comes with the binary and is written by it: the manual's pages and the shells' completions.

use std::path::{Path, PathBuf};
use std::process::Command;

use super::{Dist, write};
use crate::shell;

/// Shells, and what their completion files are called.
const SHELLS: &[(&str, &str)] = &[("bash", "rowscan.bash"), ("zsh", "_rowscan"), ("fish", "rowscan.fish")];

/// Has `binary` write them; gives the folder that holds `man` and `completions`.
pub(super) fn write_all(dist: &Dist<'_>, binary: &Path) -> Result<PathBuf, String> {
    let folder = dist.folder.join("papers");
    shell::run(Command::new(binary).arg("man").arg(folder.join("man")))?;
    for (name, file) in SHELLS {
        let script = shell::capture(Command::new(binary).args(["completions", name]))?;
        write(&folder.join("completions").join(file), &script)?;
    }
    Ok(folder)
}
