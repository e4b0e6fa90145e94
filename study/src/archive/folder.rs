//! The folder that rows are kept in.

use std::collections::VecDeque;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use rowscan_files::OutputFile;

use crate::fingerprint;

/// Most bytes of rows in one folder: some hundred thousand rows.
pub const MOST_BYTES: u64 = 1024 * 1024 * 1024;
/// Most bytes of one row.
const MOST_BYTES_ROW: u64 = 64 * 1024 * 1024;
/// Rows are called so; other files are left alone.
const ENDING: &str = ".row";
/// Hexadecimal digits before it.
const DIGITS: usize = 16;

/// What stands at the name of a row.
pub(super) enum Found {
    /// No file.
    Nothing,
    /// Its content.
    Bytes(Vec<u8>),
    /// Something that cannot be read.
    Unreadable(String),
}

/// Looks for a row.
pub(super) fn look(path: &Path) -> Found {
    match rowscan_files::read_own(path, MOST_BYTES_ROW) {
        Ok(bytes) => Found::Bytes(bytes),
        Err(cause) if cause.kind() == io::ErrorKind::NotFound => Found::Nothing,
        Err(cause) => Found::Unreadable(format!("cannot be read: {cause}")),
    }
}

/// A folder of rows, and how much room they take.
#[derive(Debug)]
pub(super) struct Folder {
    path: PathBuf,
    most_bytes: u64,
    bytes: u64,
    /// By age, the oldest first.
    rows: VecDeque<(PathBuf, u64)>,
}

impl Folder {
    /// Lists the rows that are there; makes the folder if there is none.
    pub(super) fn open(path: &Path, most_bytes: u64) -> io::Result<Self> {
        fs::create_dir_all(path)?;
        let mut found = Vec::new();
        for entry in path.read_dir()? {
            let entry = entry?;
            if !is_row(&entry.file_name().to_string_lossy()) {
                continue;
            }
            // Another run may have taken it away.
            let Ok(about) = entry.metadata() else { continue };
            found.push((about.modified()?, entry.path(), about.len()));
        }
        found.sort();
        let rows: VecDeque<_> = found.into_iter().map(|(_, path, bytes)| (path, bytes)).collect();
        let bytes = rows.iter().map(|(_, bytes)| bytes).sum();
        Ok(Self { path: path.to_owned(), most_bytes, bytes, rows })
    }

    /// Where the row of a key stands.
    pub(super) fn path(&self, key: &str) -> PathBuf {
        self.path.join(format!("{}{ENDING}", fingerprint::of_content(key.as_bytes())))
    }

    /// Keeps a row, whole or not at all; the oldest make room for it.
    pub(super) fn keep(&mut self, path: &Path, content: &[u8]) -> io::Result<()> {
        let more = content.len() as u64;
        self.forget(path);
        while self.bytes + more > self.most_bytes {
            let Some((oldest, bytes)) = self.rows.pop_front() else {
                return Err(io::Error::new(
                    io::ErrorKind::StorageFull,
                    "a row is larger than the folder may be",
                ));
            };
            self.bytes -= bytes;
            // Another run may have taken it away.
            let _ = fs::remove_file(oldest);
        }
        OutputFile::create_anew(path)?.write_whole(content)?;
        self.bytes += more;
        self.rows.push_back((path.to_owned(), more));
        Ok(())
    }

    /// What is written anew is no longer counted as it was.
    fn forget(&mut self, path: &Path) {
        if let Some(at) = self.rows.iter().position(|(other, _)| other == path) {
            self.bytes -= self.rows.remove(at).map_or(0, |(_, bytes)| bytes);
        }
    }
}

fn is_row(name: &str) -> bool {
    name.strip_suffix(ENDING)
        .is_some_and(|digits| digits.len() == DIGITS && digits.bytes().all(|byte| byte.is_ascii_hexdigit()))
}
