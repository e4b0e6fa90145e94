//! The virtual machine: Debian's kernel on a software processor, with what it boots packed from Debian's files and ours.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use super::archive::Archive;
use crate::foreign::debian;
use crate::shell::{self, Limit};
use crate::workspace::Workspace;

/// A run takes some ten seconds; a machine that hangs is stopped.
const LIMIT: Limit = Limit::InAll(Duration::from_secs(180));

/// Kernel modules, without dependencies of their own that are not here.
const MODULES: &[&str] = &["can", "can-raw", "can-dev", "vcan", "slcan"];

/// Programs of can-utils.
const PROGRAMS: &[&str] = &["candump", "cansend", "slcand"];

/// What a machine is made of.
pub struct Machine {
    /// Debian's packages, unpacked.
    debian: PathBuf,
    /// Kernel and initial file system.
    kernel: PathBuf,
    initramfs: PathBuf,
}

impl Machine {
    /// Fetches Debian's parts, unless they are there already; an error says why they cannot be had.
    pub fn fetch(workspace: &Workspace) -> Result<PathBuf, String> {
        let folder = workspace.scratch("vcan")?.join("debian");
        let kernel = debian::dependency_of("linux-image-amd64", "linux-image-")?;
        let emulator = if shell::has("qemu-system-x86_64") { &[][..] } else { &["qemu-system-x86"] };
        debian::unpack(&folder, emulator, &[&kernel, "busybox-static", "can-utils"])?;
        Ok(folder)
    }

    /// Packs what boots: busybox, modules, can-utils, `programs` of ours with the libraries they need, and the files of `init`.
    pub fn assemble(
        workspace: &Workspace,
        debian: PathBuf,
        programs: &[(&str, &Path)],
    ) -> Result<Self, String> {
        let mut archive = Archive::default();
        for folder in ["proc", "sys", "dev"] {
            archive.folder(Path::new(folder));
        }
        let own = workspace.root.join("tools/foreign/vcan");
        archive.file(Path::new("init"), &read(&own.join("init"))?);
        archive.file(Path::new("scene.toml"), &read(&own.join("scene.toml"))?);
        archive.file(Path::new("bin/busybox"), &read(&debian.join("bin/busybox"))?);
        for name in MODULES {
            let module = find(&debian, &|file| {
                let rest = file.strip_prefix(*name).and_then(|rest| rest.strip_prefix(".ko"));
                rest.is_some_and(|rest| rest.is_empty() || rest == ".xz")
            })?;
            let file = module.file_name().unwrap_or_default();
            archive.file(&Path::new("modules").join(file), &read(&module)?);
        }
        let mut libraries = Vec::new();
        let utilities = PROGRAMS.iter().map(|name| (*name, debian.join("usr/bin").join(name)));
        let ours = programs.iter().map(|(name, path)| (*name, path.to_path_buf()));
        for (name, path) in utilities.chain(ours) {
            archive.file(&Path::new("bin").join(name), &stripped(workspace, name, &path)?);
            libraries.extend(libraries_of(&path)?);
        }
        libraries.sort();
        libraries.dedup();
        for library in &libraries {
            archive.file(library, &read(library)?);
        }
        let initramfs = workspace.scratch("vcan")?.join("initramfs");
        fs::write(&initramfs, archive.finish())
            .map_err(|error| format!("{}: {error}", initramfs.display()))?;
        let kernel = find(&debian.join("boot"), &|file| file.starts_with("vmlinuz-"))?;
        Ok(Self { debian, kernel, initramfs })
    }

    /// Boots it with its second serial port on `line`; the lines of its console, once it has switched itself off.
    pub fn boot(&self, line: &Path) -> Result<Vec<String>, String> {
        let unpacked = self.debian.join("usr/bin/qemu-system-x86_64");
        let mut command = if unpacked.is_file() {
            let libraries = self.debian.join("usr/lib/x86_64-linux-gnu");
            let mut command = Command::new(unpacked);
            command.env("QEMU_MODULE_DIR", libraries.join("qemu")).env("LD_LIBRARY_PATH", libraries);
            for data in ["qemu", "seabios"] {
                command.arg("-L").arg(self.debian.join("usr/share").join(data));
            }
            command
        } else {
            Command::new("qemu-system-x86_64")
        };
        command.args(["-nodefaults", "-no-user-config", "-accel", "tcg", "-cpu", "max", "-M", "q35"]);
        command.args(["-m", "1024", "-display", "none", "-net", "none", "-no-reboot", "-serial", "stdio"]);
        command.arg("-chardev").arg(format!("serial,id=adapter,path={}", line.display()));
        command.args(["-serial", "chardev:adapter"]);
        command.arg("-kernel").arg(&self.kernel).arg("-initrd").arg(&self.initramfs);
        command.args(["-append", "console=ttyS0 quiet panic=-1"]);
        let mut console = Vec::new();
        shell::run_lines(&mut command, LIMIT, |line| console.push(line.trim_end().to_owned()))
            .map_err(|error| format!("{error}; it last said:\n{}", last(&console)))?;
        Ok(console)
    }
}

/// The end of a console, for who must find out what went wrong.
pub fn last(console: &[String]) -> String {
    console[console.len().saturating_sub(20)..].join("\n")
}

fn read(path: &Path) -> Result<Vec<u8>, String> {
    fs::read(path).map_err(|error| format!("{}: {error}", path.display()))
}

/// A program's bytes without what only a debugger reads, where there is a program to take it away.
fn stripped(workspace: &Workspace, name: &str, path: &Path) -> Result<Vec<u8>, String> {
    let bare = workspace.scratch("vcan")?.join(format!("{name}.stripped"));
    let strip = || shell::run(Command::new("strip").arg("-o").arg(&bare).arg(path));
    if shell::has("strip") && strip().is_ok() { read(&bare) } else { read(path) }
}

/// The libraries a program is linked to, where the loader finds them here.
fn libraries_of(program: &Path) -> Result<Vec<PathBuf>, String> {
    let said = shell::capture(Command::new("ldd").arg(program))?;
    // `libc.so.6 => /lib/…/libc.so.6 (0x…)`, or the loader's own path alone.
    let paths = said.split_whitespace().filter(|word| word.starts_with('/'));
    Ok(paths.map(PathBuf::from).collect())
}

/// The first file below `folder` whose name is wanted.
fn find(folder: &Path, wanted: &dyn Fn(&str) -> bool) -> Result<PathBuf, String> {
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        let entries = fs::read_dir(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
        for entry in entries.flatten() {
            let path = entry.path();
            if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
                folders.push(path);
            } else if path.file_name().and_then(|name| name.to_str()).is_some_and(wanted) {
                return Ok(path);
            }
        }
    }
    Err(format!("{} lacks a file it should have", folder.display()))
}
