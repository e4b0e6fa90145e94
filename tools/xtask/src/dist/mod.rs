//! `cargo xtask dist`: what is given to people who do not compile. A static binary, archives with checksums, a Debian package.
//!
//! Everything lies in `dist` below cargo's build directory; `dist/rowscan` is the binary, unpacked.

mod binary;
mod debian;
mod paper;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use crate::shell;
use crate::steps::Outcome;
use crate::workspace::Workspace;

/// The target without argument.
const DEFAULT_TARGET: &str = "x86_64-unknown-linux-gnu";

/// Files of the repository that go into the archive as they are.
const FILES: &[&str] = &[
    "README.md",
    "CHANGELOG.md",
    "LICENSE-MIT",
    "LICENSE-APACHE",
    "tools/dist/rowscan@.service",
    "tools/dist/Containerfile",
];

/// What a release is made of, and where it goes.
struct Dist<'a> {
    workspace: &'a Workspace,
    target: &'a str,
    version: String,
    folder: PathBuf,
}

/// Makes everything for the target named, or for this machine's.
pub fn command(workspace: &Workspace, arguments: &[String]) -> ExitCode {
    let target = arguments.first().map_or(DEFAULT_TARGET, String::as_str);
    match make(workspace, target) {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("dist: {why}");
            ExitCode::FAILURE
        }
    }
}

/// The same as a step of `full`.
pub fn run(workspace: &Workspace) -> Outcome {
    Outcome::from_result(make(workspace, DEFAULT_TARGET))
}

fn make(workspace: &Workspace, target: &str) -> Result<(), String> {
    let folder = workspace.target.join("dist");
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let dist = Dist { workspace, target, version: version(workspace)?, folder };
    let binary = binary::build(&dist)?;
    let papers = paper::write_all(&dist, &binary)?;
    let archive = dist.archive(&binary, &papers)?;
    let mut made = vec![archive];
    made.extend(debian::package(&dist, &binary, &papers)?);
    dist.checksums(&made)?;
    for file in made.iter().chain([&binary]) {
        println!("    {:>12} bytes  {}", size(file), file.display());
    }
    Ok(())
}

/// The version of the workspace.
fn version(workspace: &Workspace) -> Result<String, String> {
    let manifest = read(&workspace.root.join("Cargo.toml"))?;
    let line = manifest.lines().find_map(|line| line.strip_prefix("version = \""));
    line.and_then(|rest| rest.split('"').next())
        .map(str::to_owned)
        .ok_or("Cargo.toml has no version".to_owned())
}

impl Dist<'_> {
    /// The archive: one folder with the binary, its papers and what stands in [`FILES`].
    fn archive(&self, binary: &Path, papers: &Path) -> Result<PathBuf, String> {
        let name = format!("rowscan-{}-{}", self.version, self.target);
        let stage = self.folder.join(&name);
        fs::create_dir_all(&stage).map_err(|error| format!("{}: {error}", stage.display()))?;
        copy(binary, &stage.join("rowscan"))?;
        for file in FILES {
            let from = self.workspace.root.join(file);
            copy(&from, &stage.join(from.file_name().unwrap_or_default()))?;
        }
        shell::run(
            Command::new("cp").arg("-r").arg(papers.join("man")).arg(papers.join("completions")).arg(&stage),
        )?;
        let archive = self.folder.join(format!("{name}.tar.gz"));
        // The same content gives the same bytes: no times, no owners, sorted.
        let sorted = [
            "--sort=name",
            "--owner=0",
            "--group=0",
            "--numeric-owner",
            "--mtime=@0",
            "--use-compress-program=gzip -9n",
        ];
        shell::run(
            Command::new("tar").args(sorted).arg("-C").arg(&self.folder).arg("-cf").arg(&archive).arg(&name),
        )?;
        let _ = fs::remove_dir_all(&stage);
        Ok(archive)
    }

    /// SHA-256 of all that is given away.
    fn checksums(&self, files: &[PathBuf]) -> Result<(), String> {
        let names = files.iter().filter_map(|file| file.file_name());
        let sums = shell::capture(Command::new("sha256sum").args(names).current_dir(&self.folder))?;
        write(&self.folder.join("SHA256SUMS"), &sums)
    }
}

fn read(path: &Path) -> Result<String, String> {
    fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))
}

fn write(path: &Path, text: &str) -> Result<(), String> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    }
    fs::write(path, text).map_err(|error| format!("{}: {error}", path.display()))
}

fn copy(from: &Path, to: &Path) -> Result<(), String> {
    if let Some(folder) = to.parent() {
        fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    }
    fs::copy(from, to).map(|_| ()).map_err(|error| format!("{} to {}: {error}", from.display(), to.display()))
}

fn size(path: &Path) -> u64 {
    fs::metadata(path).map_or(0, |about| about.len())
}
