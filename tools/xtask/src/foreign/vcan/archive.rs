//! An initial file system for Linux: a cpio archive in the form called newc.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// A folder, as its mode has it.
const FOLDER: u32 = 0o040_755;
/// A file anyone may run.
const FILE: u32 = 0o100_755;

/// An archive being written.
#[derive(Default)]
pub struct Archive {
    bytes: Vec<u8>,
    entries: u32,
    folders: BTreeSet<PathBuf>,
}

impl Archive {
    /// Adds an empty folder, and those above it.
    pub fn folder(&mut self, path: &Path) {
        let mut above: Vec<&Path> = path.ancestors().filter(|folder| folder.file_name().is_some()).collect();
        while let Some(folder) = above.pop() {
            if self.folders.insert(folder.to_owned()) {
                self.entry(folder, FOLDER, &[]);
            }
        }
    }

    /// Adds a file and the folders above it.
    pub fn file(&mut self, path: &Path, data: &[u8]) {
        if let Some(folder) = path.parent() {
            self.folder(folder);
        }
        self.entry(path, FILE, data);
    }

    /// The whole archive.
    pub fn finish(mut self) -> Vec<u8> {
        self.entry(Path::new("TRAILER!!!"), 0, &[]);
        self.bytes
    }

    /// A header of thirteen numbers in eight hexadecimal digits, the name, the data, each filled up to four bytes.
    fn entry(&mut self, path: &Path, mode: u32, data: &[u8]) {
        let name = path.to_string_lossy();
        let name = name.trim_start_matches('/');
        self.entries += 1;
        let (size, name_size) = (data.len() as u32, name.len() as u32 + 1);
        // Inode, mode, owner, group, links, time, size, device and its minor, special's device and minor, name's length, checksum.
        let numbers = [self.entries, mode, 0, 0, 1, 0, size, 0, 0, 0, 0, name_size, 0];
        self.bytes.extend_from_slice(b"070701");
        for number in numbers {
            self.bytes.extend_from_slice(format!("{number:08X}").as_bytes());
        }
        self.bytes.extend_from_slice(name.as_bytes());
        self.bytes.push(0);
        self.fill();
        self.bytes.extend_from_slice(data);
        self.fill();
    }

    fn fill(&mut self) {
        while !self.bytes.len().is_multiple_of(4) {
            self.bytes.push(0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_are_aligned_and_folders_come_once_before_their_files() {
        let mut archive = Archive::default();
        archive.file(Path::new("/bin/a"), b"12345");
        archive.file(Path::new("/bin/b"), b"");
        let bytes = archive.finish();
        let text = String::from_utf8_lossy(&bytes);
        assert!(bytes.len().is_multiple_of(4) && text.starts_with("070701"));
        let names: Vec<usize> =
            ["bin\0", "bin/a\0", "bin/b\0", "TRAILER!!!\0"].map(|name| text.find(name).unwrap()).to_vec();
        assert!(
            names.is_sorted() && names.iter().all(|at| at % 4 == 2),
            "behind headers of 110 bytes: {names:?}"
        );
        assert_eq!(text.matches("070701").count(), 4);
    }
}
