//! The Debian package, built by `dpkg-deb` from metadata that stands here: one binary, its papers, the unit.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::{Dist, copy, read, size, write};
use crate::shell;

/// Debian's name of a machine.
fn architecture(target: &str) -> Option<&'static str> {
    match target.split('-').next()? {
        "x86_64" => Some("amd64"),
        "aarch64" => Some("arm64"),
        "armv7" => Some("armhf"),
        _ => None,
    }
}

/// Makes the package; none where this machine cannot, and then says so.
pub(super) fn package(dist: &Dist<'_>, binary: &Path, papers: &Path) -> Result<Option<PathBuf>, String> {
    let Some(architecture) = architecture(dist.target).filter(|_| shell::has("dpkg-deb")) else {
        println!("    SKIPPED: Debian package: no dpkg-deb here, or no Debian machine {}", dist.target);
        return Ok(None);
    };
    let stage = dist.folder.join("debian");
    let root = |path: &str| stage.join(path);
    copy(binary, &root("usr/bin/rowscan"))?;
    copy(&papers.join("completions/rowscan.bash"), &root("usr/share/bash-completion/completions/rowscan"))?;
    copy(&papers.join("completions/_rowscan"), &root("usr/share/zsh/vendor-completions/_rowscan"))?;
    copy(
        &papers.join("completions/rowscan.fish"),
        &root("usr/share/fish/vendor_completions.d/rowscan.fish"),
    )?;
    let source = &dist.workspace.root;
    copy(&source.join("tools/dist/rowscan@.service"), &root("usr/lib/systemd/system/rowscan@.service"))?;
    write(&root("usr/share/doc/rowscan/copyright"), &copyright(&read(&source.join("LICENSE-MIT"))?))?;
    copy(&source.join("README.md"), &root("usr/share/doc/rowscan/README.md"))?;
    copy(&source.join("CHANGELOG.md"), &root("usr/share/doc/rowscan/changelog"))?;
    for page in
        fs::read_dir(papers.join("man")).map_err(|error| format!("man: {error}"))?.filter_map(Result::ok)
    {
        copy(&page.path(), &root("usr/share/man/man1").join(page.file_name()))?;
    }
    let pack = |folder: &str| {
        let files = fs::read_dir(root(folder)).map_err(|error| format!("{folder}: {error}"))?;
        let files: Vec<PathBuf> = files.filter_map(Result::ok).map(|entry| entry.path()).collect();
        shell::run(Command::new("gzip").arg("-9n").args(files))
    };
    pack("usr/share/man/man1")?;
    shell::run(Command::new("gzip").arg("-9n").arg(root("usr/share/doc/rowscan/changelog")))?;
    write(&root("DEBIAN/control"), &control(&dist.version, architecture, size(binary)))?;
    set_modes(&stage)?;
    let package = dist.folder.join(format!("rowscan_{}_{architecture}.deb", dist.version));
    shell::run(Command::new("dpkg-deb").args(["--root-owner-group", "--build"]).arg(&stage).arg(&package))?;
    let _ = fs::remove_dir_all(&stage);
    Ok(Some(package))
}

/// The package's description.
fn control(version: &str, architecture: &str, binary_bytes: u64) -> String {
    format!(
        "Package: rowscan\nVersion: {version}\nArchitecture: {architecture}\nMaintainer: The rowscan authors <rowscan@localhost>\n\
         Installed-Size: {}\nSection: science\nPriority: optional\n\
         Description: virtual SICK LMS laser scanner in a virtual orchard\n \
         A virtual scanner on a virtual tractor in a virtual orchard, for programs that\n \
         read a real one: it speaks CoLa A and B over TCP and the LMS2xx on serial lines,\n \
         with GNSS and CAN from the same clock. The matching driver and estimator turn\n \
         scans into canopy volume and leaf area.\n",
        binary_bytes.div_ceil(1024) + 1024
    )
}

/// The licence in Debian's form: either licence may be chosen.
fn copyright(mit: &str) -> String {
    let holder =
        mit.lines().find(|line| line.starts_with("Copyright")).unwrap_or("Copyright: the rowscan authors");
    let text: String = mit
        .lines()
        .skip_while(|line| !line.starts_with("Permission"))
        .map(|line| match line.trim() {
            "" => " .\n".to_owned(),
            line => format!(" {line}\n"),
        })
        .collect();
    format!(
        "Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/\nUpstream-Name: rowscan\n\nFiles: *\n{}\nLicense: Expat or Apache-2.0\n\n\
         License: Expat\n{text}\nLicense: Apache-2.0\n On Debian systems, the Apache License 2.0 is in /usr/share/common-licenses/Apache-2.0.\n",
        holder.replacen("Copyright (c)", "Copyright:", 1)
    )
}

/// What Debian's policy has: folders and programs 755, other files 644.
fn set_modes(folder: &Path) -> Result<(), String> {
    let tell = |error: std::io::Error| format!("{}: {error}", folder.display());
    fs::set_permissions(folder, fs::Permissions::from_mode(0o755)).map_err(tell)?;
    for entry in fs::read_dir(folder).map_err(tell)?.filter_map(Result::ok) {
        let path = entry.path();
        if path.is_dir() {
            set_modes(&path)?;
        } else {
            let mode = if path.ends_with("usr/bin/rowscan") { 0o755 } else { 0o644 };
            fs::set_permissions(&path, fs::Permissions::from_mode(mode)).map_err(tell)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_control_file_is_of_fields_and_of_lines_that_go_on() {
        let control = control("0.2.0", "amd64", 18_000_000);
        assert!(
            control.contains("\nVersion: 0.2.0\n") && control.contains("\nInstalled-Size: 18603\n"),
            "{control}"
        );
        for line in control.lines() {
            assert!(line.starts_with(' ') || line.split_once(": ").is_some(), "{line}");
            assert!(line.len() < 100, "{line}");
        }
        assert_eq!(architecture("aarch64-unknown-linux-musl"), Some("arm64"));
        assert_eq!(architecture("wasm32-unknown-unknown"), None);
    }

    #[test]
    fn a_licence_s_empty_lines_are_dots() {
        let copyright =
            copyright("MIT License\n\nCopyright (c) 2026 someone\n\nPermission is granted\n\nto all.\n");
        assert!(copyright.contains("Copyright: 2026 someone\nLicense: Expat or Apache-2.0\n"), "{copyright}");
        assert!(copyright.contains("License: Expat\n Permission is granted\n .\n to all.\n"), "{copyright}");
    }
}
