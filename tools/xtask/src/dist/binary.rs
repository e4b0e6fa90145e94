//! The binary: static, stripped, small enough.

use std::path::{Path, PathBuf};
use std::process::Command;

use super::{Dist, files};
use crate::shell;
use crate::workspace::CHILD_CLOCK;

/// Bytes that the binary may have.
const MOST: u64 = 20_000_000;

/// Builds it and checks that it is what it should be; where it is.
pub(super) fn build(dist: &Dist<'_>) -> Result<PathBuf, String> {
    let arguments = [
        "build",
        "--locked",
        "--profile",
        "dist",
        "-p",
        "rowscan",
        "--features",
        "full",
        "--bin",
        "rowscan",
        "--target",
        dist.target,
    ];
    let mut cargo = dist.workspace.cargo(&arguments);
    // With --target the flags are not for build scripts and macros, which cannot be static.
    cargo.env("RUSTFLAGS", flags(dist.target)).arg("--target-dir").arg(&dist.build);
    shell::run(&mut cargo).map_err(|why| {
        format!(
            "{why}; if the target is not there: `rustup target add {0}`, and a linker for {0}",
            dist.target
        )
    })?;
    let name = if dist.target.contains("windows") { "rowscan.exe" } else { "rowscan" };
    let binary = dist.folder.join(name);
    files::copy(&built_folder(dist).join(name), &binary)?;
    if files::size(&binary) > MOST {
        return Err(format!("the binary has {} bytes, more than {MOST}", files::size(&binary)));
    }
    is_static(&binary)?;
    Ok(binary)
}

/// The library that the binary puts children on simulated time with.
pub(super) const LIBRARY: &str = "librowscan_child_clock.so";

/// Builds the library, for systems that have it. It is the children's C library's, so it is not static.
pub(super) fn build_library(dist: &Dist<'_>) -> Result<Option<PathBuf>, String> {
    if !dist.target.contains("linux") {
        return Ok(None);
    }
    let arguments = ["build", "--locked", "--profile", "dist", "-p", CHILD_CLOCK, "--target", dist.target];
    let mut cargo = dist.workspace.cargo(&arguments);
    cargo.env("RUSTFLAGS", "").arg("--target-dir").arg(&dist.build);
    shell::run(&mut cargo)?;
    Ok(Some(built_folder(dist).join(LIBRARY)))
}

/// Where cargo puts the binary.
pub(super) fn built_folder(dist: &Dist<'_>) -> PathBuf {
    dist.build.join(dist.target).join("dist")
}

/// Flags of rustc for the target.
fn flags(target: &str) -> String {
    if target.contains("apple") {
        // There the system's library is always a shared one.
        return String::new();
    }
    let mut flags = "-C target-feature=+crt-static".to_owned();
    // There rustc brings its own linker, which folds functions of the same code into one and packs relocations.
    if target == "x86_64-unknown-linux-gnu" {
        flags += " -C link-arg=-Wl,--icf=all -C link-arg=-Wl,-z,pack-relative-relocs";
    }
    flags
}

/// A static program asks for no loader.
fn is_static(binary: &Path) -> Result<(), String> {
    if !shell::has("readelf") {
        println!("    SKIPPED: whether the binary is static: readelf is not installed");
        return Ok(());
    }
    let headers = shell::capture(Command::new("readelf").arg("-lW").arg(binary))?;
    match headers.contains("INTERP") {
        true => Err(format!("{} asks for a loader: it is not static", binary.display())),
        false => Ok(()),
    }
}
