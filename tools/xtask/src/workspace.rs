//! Where things are: the workspace, its build directory, its source files.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::shell;

/// Every part of the program: what tests see and what ships. Without it cargo builds what README's first pages use.
pub const FULL: [&str; 2] = ["--features", "rowscan/full"];

/// The package of the library that puts children on simulated time: no other package has the library built.
pub const CHILD_CLOCK: &str = "rowscan-child-clock-preload";

/// How a program is compiled.
#[derive(Clone, Copy, Debug)]
pub enum Profile {
    /// As tests are, with every part.
    Dev,
    /// As README says: optimised, with the default parts.
    Release,
}

impl Profile {
    /// Its name for cargo.
    pub fn name(self) -> &'static str {
        match self {
            Self::Dev => "dev",
            Self::Release => "release",
        }
    }

    /// The folder of its programs below the build directory.
    fn folder(self) -> &'static str {
        match self {
            Self::Dev => "debug",
            Self::Release => "release",
        }
    }
}

/// The checked-out workspace.
#[derive(Clone)]
pub struct Workspace {
    /// Folder of the root Cargo.toml.
    pub root: PathBuf,
    /// Cargo's build directory.
    pub target: PathBuf,
    /// How the binary is compiled that is tested.
    pub profile: Profile,
}

impl Workspace {
    /// Asks cargo where the workspace and its build directory are.
    pub fn find() -> Result<Self, String> {
        let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml");
        let output = Command::new(cargo())
            .args(["metadata", "--format-version", "1", "--no-deps", "--manifest-path"])
            .arg(&manifest)
            .output()
            .map_err(|error| format!("cannot run cargo metadata: {error}"))?;
        if !output.status.success() {
            return Err(format!("cargo metadata failed: {}", String::from_utf8_lossy(&output.stderr)));
        }
        let metadata: serde_json::Value =
            serde_json::from_slice(&output.stdout).map_err(|error| format!("cargo metadata: {error}"))?;
        let path = |key: &str| {
            metadata[key].as_str().map(PathBuf::from).ok_or(format!("cargo metadata has no {key}"))
        };
        Ok(Self {
            root: path("workspace_root")?,
            target: path("target_directory")?,
            profile: Profile::Release,
        })
    }

    /// A `cargo` command that runs in the workspace.
    pub fn cargo(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(cargo());
        command.current_dir(&self.root).args(arguments);
        command
    }

    /// The binary, if it has been built.
    pub fn built_binary(&self) -> Result<PathBuf, String> {
        let binary = self.binary();
        if binary.is_file() {
            Ok(binary)
        } else {
            Err(format!("the {} binary is not built", self.profile.name()))
        }
    }

    /// Where the binary is, or will be.
    fn binary(&self) -> PathBuf {
        self.target.join(self.profile.folder()).join("rowscan")
    }

    /// Builds the binary. A failed build leaves none, so that later steps cannot test an old one.
    pub fn build_binary(&self) -> Result<(), String> {
        let _ = fs::remove_file(self.binary());
        shell::run(&mut match self.profile {
            // The tests' own build has the binary, too; built alone, it would be compiled again with fewer features of its dependencies.
            Profile::Dev => {
                self.cargo(&[&["test", "--workspace", "--no-run", "--quiet"], &FULL[..]].concat())
            }
            Profile::Release => self.cargo(&["build", "--release", "-p", "rowscan"]),
        })
    }

    /// A folder for the tasks' own files, made if missing.
    pub fn scratch(&self, name: &str) -> Result<PathBuf, String> {
        let folder = self.target.join("xtask").join(name);
        fs::create_dir_all(&folder).map_err(|error| format!("cannot make {}: {error}", folder.display()))?;
        Ok(folder)
    }

    /// Every file of the workspace, relative to its root and sorted, without build output and version control.
    pub fn files(&self) -> Result<Vec<PathBuf>, String> {
        let mut files = Vec::new();
        let mut folders = vec![self.root.clone()];
        while let Some(folder) = folders.pop() {
            let entries = fs::read_dir(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
            for entry in entries.filter_map(Result::ok) {
                let path = entry.path();
                let Ok(kind) = entry.file_type() else { continue };
                if kind.is_dir() {
                    if path != self.target && !is_generated(&entry.file_name().to_string_lossy()) {
                        folders.push(path);
                    }
                } else if kind.is_file()
                    && let Ok(relative) = path.strip_prefix(&self.root)
                {
                    files.push(relative.to_path_buf());
                }
            }
        }
        files.sort();
        Ok(files)
    }
}

/// True for folders that hold nothing anyone wrote.
fn is_generated(name: &str) -> bool {
    matches!(name, ".git" | ".venv" | "__pycache__" | ".pytest_cache") || name.starts_with("target")
}

/// The cargo that runs us, or the one on the path.
fn cargo() -> OsString {
    std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into())
}
