//! The container image: the static binary and nothing else, by whatever this machine makes images with.

use std::path::Path;
use std::process::Command;

use super::files;
use crate::shell;
use crate::workspace::Workspace;

/// The image's name, and the file that it is saved to.
const NAME: &str = "rowscan";
const FILE: &str = "rowscan-image.tar";

/// Builds the image from the release files in `folder` and saves it there.
pub(super) fn make(workspace: &Workspace, folder: &Path) -> Result<(), String> {
    if !folder.join("rowscan").is_file() {
        return Err(format!("{}: there is no rowscan; `cargo xtask dist` makes it", folder.display()));
    }
    let context = workspace.scratch("container")?;
    files::copy(&folder.join("rowscan"), &context.join("rowscan"))?;
    for file in ["LICENSE-MIT", "LICENSE-APACHE", "tools/dist/Containerfile"] {
        let from = workspace.root.join(file);
        files::copy(&from, &context.join(from.file_name().unwrap_or_default()))?;
    }
    let saved = folder.join(FILE);
    let _ = std::fs::remove_file(&saved);
    let recipe = context.join("Containerfile");
    match ["docker", "podman"].into_iter().find(|program| shell::has(program)) {
        Some(program) => {
            let mut build = Command::new(program);
            build.args(["build", "--tag", NAME, "--file"]).arg(&recipe).arg(&context);
            shell::run(&mut build)?;
            shell::run(Command::new(program).args(["save", "--output"]).arg(&saved).arg(NAME))?;
        }
        None if shell::has("buildah") => {
            let mut build = Command::new("buildah");
            build.args(["bud", "--isolation", "chroot", "--tag", NAME, "--file"]).arg(&recipe).arg(&context);
            shell::run(&mut build)?;
            let to = format!("docker-archive:{}:{NAME}", saved.display());
            shell::run(Command::new("buildah").args(["push", NAME]).arg(to))?;
        }
        None => {
            println!("SKIPPED: container: neither docker, podman nor buildah is installed");
            return Ok(());
        }
    }
    println!("    {:>12} bytes  {}", files::size(&saved), saved.display());
    Ok(())
}
