//! The Debian package, by cargo-deb from `[package.metadata.deb]` in Cargo.toml.

use std::path::PathBuf;

use super::{Dist, files};
use crate::shell;

/// Makes it from the binary that is there; none where this machine cannot, and then says so.
pub(super) fn make(dist: &Dist<'_>) -> Result<Option<PathBuf>, String> {
    if !shell::has("cargo-deb") {
        println!(
            "    SKIPPED: Debian package: cargo-deb is not installed (`cargo install --locked cargo-deb`)"
        );
        return Ok(None);
    }
    let mut cargo = dist.workspace.cargo(&[
        "deb",
        "--no-build",
        "--no-strip",
        "--profile",
        "dist",
        "--target",
        dist.target,
    ]);
    cargo.arg("--output").arg(&dist.folder).env("CARGO_TARGET_DIR", &dist.build);
    shell::run(&mut cargo)?;
    let mut made = files::all_in(&dist.folder)?.into_iter();
    let package = made.find(|path| path.extension().is_some_and(|ending| ending == "deb"));
    package.map(Some).ok_or_else(|| format!("cargo-deb has left no package in {}", dist.folder.display()))
}
