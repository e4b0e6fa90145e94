//! `cargo xtask dist`: the release files, for people who do not compile. A static binary, an archive with checksums, a Debian package.
//!
//! Everything lies in `dist` below cargo's build directory; `dist/rowscan` is the binary, unpacked.

mod archive;
mod binary;
mod container;
mod debian;
mod files;
mod manual;
mod trial;

use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;

use crate::counts::Counts;
use crate::steps::{self, Outcome, Step};
use crate::wheel;
use crate::workspace::Workspace;

/// The machine that is built for if none is named.
const DEFAULT_TARGET: &str = "x86_64-unknown-linux-gnu";

/// What a release is made of, and where it goes.
struct Dist<'a> {
    workspace: &'a Workspace,
    target: &'a str,
    version: String,
    /// Where the release files are.
    folder: PathBuf,
    /// Where cargo builds it: a directory of its own, so that other builds keep theirs.
    build: PathBuf,
}

/// Makes everything for the target named, or for x86-64 Linux, and tries it as `full` does.
pub fn command(workspace: &Workspace, arguments: &[String]) -> ExitCode {
    match arguments {
        [] => steps::run(workspace, &[Step::new("dist", run)], &[]),
        // Another machine's program cannot be tried here.
        [target] => match make(workspace, target) {
            Ok(_) => ExitCode::SUCCESS,
            Err(why) => {
                eprintln!("dist: {why}");
                ExitCode::FAILURE
            }
        },
        _ => {
            eprintln!("usage: cargo xtask dist [TARGET]");
            ExitCode::from(2)
        }
    }
}

/// The Python wheel as it ships, beside the other release files.
pub fn wheel(workspace: &Workspace, arguments: &[String]) -> ExitCode {
    let target = arguments.first().map(String::as_str);
    ended("wheel", wheel::build_for(workspace, target, &folder(workspace)).map(drop))
}

/// The image of the binary that `dist` has made for this machine.
pub fn container(workspace: &Workspace, _arguments: &[String]) -> ExitCode {
    ended("container", container::make(workspace, &folder(workspace)))
}

/// SHA-256 of all release files there are, wherever they were made.
pub fn checksums(workspace: &Workspace, _arguments: &[String]) -> ExitCode {
    let folder = folder(workspace);
    let is_given =
        |path: &PathBuf| path.is_file() && !path.ends_with(archive::SUMS) && !path.ends_with("rowscan");
    let given = files::all_in(&folder).map(|all| all.into_iter().filter(is_given).collect::<Vec<_>>());
    ended("checksums", given.and_then(|given| archive::write_checksums(&folder, &given)))
}

fn ended(what: &str, result: Result<(), String>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("{what}: {why}");
            ExitCode::FAILURE
        }
    }
}

/// Where the release files are.
fn folder(workspace: &Workspace) -> PathBuf {
    workspace.target.join("dist")
}

/// Makes everything and uses it as its users do; a step of `full`.
pub fn run(workspace: &Workspace) -> Outcome {
    let made = match make(workspace, DEFAULT_TARGET) {
        Ok(made) => made,
        Err(why) => return Outcome::failed(why),
    };
    let mut counts = Counts::default();
    for result in
        [trial::archive(workspace, &made.archive), trial::package(workspace, made.package.as_deref())]
    {
        match result {
            Ok(trial::Trial::Passed) => counts.passed += 1,
            Ok(trial::Trial::Skipped(why)) => {
                println!("    SKIPPED: {why}");
                counts.skipped += 1;
            }
            Err(why) => return Outcome::Failed(counts, why),
        }
    }
    Outcome::Passed(counts)
}

/// The release files.
struct Made {
    archive: PathBuf,
    /// None where no Debian package can be made.
    package: Option<PathBuf>,
}

fn make(workspace: &Workspace, target: &str) -> Result<Made, String> {
    let folder = folder(workspace);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let build = workspace.target.join("dist-build");
    let dist = Dist { workspace, target, version: version(workspace)?, folder, build };
    let binary = binary::build(&dist)?;
    manual::write(&dist, &binary)?;
    let library = binary::build_library(&dist)?;
    let archive = archive::make(&dist, &binary, library.as_deref())?;
    let package = debian::make(&dist)?;
    let given: Vec<PathBuf> = [archive.clone()].into_iter().chain(package.clone()).collect();
    archive::write_checksums(&dist.folder, &given)?;
    for file in given.iter().chain([&binary]) {
        println!("    {:>12} bytes  {}", files::size(file), file.display());
    }
    Ok(Made { archive, package })
}

/// The version of the workspace.
fn version(workspace: &Workspace) -> Result<String, String> {
    let manifest = files::read(&workspace.root.join("Cargo.toml"))?;
    let line = manifest.lines().find_map(|line| line.strip_prefix("version = \""));
    line.and_then(|rest| rest.split('"').next())
        .map(str::to_owned)
        .ok_or("Cargo.toml has no version".to_owned())
}
