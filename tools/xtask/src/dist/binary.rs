//! The binary: static, stripped, small enough.

use std::path::PathBuf;
use std::process::Command;

use super::{Dist, copy, size};
use crate::shell;

/// Bytes that the binary may have.
const MOST: u64 = 20_000_000;

/// Builds it in a build directory of its own, so that other builds keep theirs, and checks that it is what it should be.
pub(super) fn build(dist: &Dist<'_>) -> Result<PathBuf, String> {
    let folder = dist.workspace.target.join("dist-build");
    let arguments = [
        "build",
        "--locked",
        "--profile",
        "dist",
        "-p",
        "rowscan",
        "--bin",
        "rowscan",
        "--target",
        dist.target,
    ];
    let mut cargo = dist.workspace.cargo(&arguments);
    // With --target the flag is not for build scripts and macros, which cannot be static.
    cargo.env("RUSTFLAGS", "-C target-feature=+crt-static").arg("--target-dir").arg(&folder);
    shell::run(&mut cargo).map_err(|why| {
        format!(
            "{why}; if the target is not there: `rustup target add {0}`, and a linker for {0}",
            dist.target
        )
    })?;
    let built = folder.join(dist.target).join("dist/rowscan");
    let binary = dist.folder.join("rowscan");
    copy(&built, &binary)?;
    if size(&binary) > MOST {
        return Err(format!("the binary has {} bytes, more than {MOST}", size(&binary)));
    }
    is_static(&binary)?;
    Ok(binary)
}

/// A static program asks for no loader.
fn is_static(binary: &PathBuf) -> Result<(), String> {
    let headers = shell::capture(Command::new("readelf").arg("-lW").arg(binary))?;
    match headers.contains("INTERP") {
        true => Err(format!("{} asks for a loader: it is not static", binary.display())),
        false => Ok(()),
    }
}
