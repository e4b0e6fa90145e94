//! Files that are read.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use crate::apart;

/// Most bytes of a file that is read whole, as scenes, rigs, scenarios, studies and calibrations are.
pub const MOST_BYTES_WHOLE: u64 = 16 * 1024 * 1024;

/// Opens a file to be read; while a [`KeptApart`](crate::KeptApart) lives, it cannot be written from here on.
///
/// # Errors
/// The system's, and [`io::ErrorKind::IsADirectory`].
pub fn open(path: &Path) -> io::Result<File> {
    let file = File::open(path)?;
    let found = file.metadata()?;
    if found.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a directory"));
    }
    apart::note_input(&found);
    Ok(file)
}

/// Says that a file will be read, if it is there, by this program or one that it starts: it cannot be written from here on.
pub fn will_be_read(path: &Path) {
    if let Ok(found) = path.metadata() {
        apart::note_input(&found);
    }
}

/// The content of a file of at most `most` bytes.
///
/// # Errors
/// As [`open`]; [`io::ErrorKind::FileTooLarge`] of one that holds more, or never ends.
pub fn read(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    whole(open(path)?, most)
}

/// The text of a file of at most [`MOST_BYTES_WHOLE`] bytes.
///
/// # Errors
/// As [`read`]; [`io::ErrorKind::InvalidData`] of what is no UTF-8.
pub fn read_text(path: &Path) -> io::Result<String> {
    String::from_utf8(read(path, MOST_BYTES_WHOLE)?)
        .map_err(|_| io::Error::new(io::ErrorKind::InvalidData, "expected text in UTF-8, found other bytes"))
}

/// The content of a file that this program keeps and replaces itself, such as the settings of a device or the journal of a study: it may be written.
///
/// # Errors
/// As [`read`].
pub fn read_own(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    whole(File::open(path)?, most)
}

fn whole(file: File, most: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    Bounded::new(file, most).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Bytes of which there may be so many; more of them are an error, [`io::ErrorKind::FileTooLarge`].
#[derive(Debug)]
pub struct Bounded<R> {
    inner: R,
    most: u64,
    left: u64,
}

impl<R: Read> Bounded<R> {
    /// At most so many bytes of `inner`.
    pub fn new(inner: R, most: u64) -> Self {
        Self { inner, most, left: most }
    }
}

impl<R: Read> Read for Bounded<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let read = self.inner.read(into)?;
        self.left = self.left.checked_sub(read as u64).ok_or_else(|| {
            let most = match self.most / (1024 * 1024) {
                0 => format!("{} bytes", self.most),
                mega => format!("{mega} MB"),
            };
            io::Error::new(io::ErrorKind::FileTooLarge, format!("expected at most {most}, found more"))
        })?;
        Ok(read)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_never_ends_is_refused() {
        let mut endless = Bounded::new(io::repeat(7), 1024 * 1024);
        let why = endless.read_to_end(&mut Vec::new()).expect_err("it never ends");
        assert_eq!(
            (why.kind(), why.to_string().as_str()),
            (io::ErrorKind::FileTooLarge, "expected at most 1 MB, found more")
        );
        let mut whole = Vec::new();
        assert_eq!(Bounded::new(&b"abc"[..], 3).read_to_end(&mut whole).expect("it fits"), 3);
        assert!(Bounded::new(&b"abcd"[..], 3).read_to_end(&mut whole).is_err());
    }
}
