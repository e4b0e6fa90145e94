//! Inputs and outputs of a program, kept apart: nothing is written over what is read, and no two outputs over each other.

use std::ffi::OsString;
use std::fs::{self, Metadata};
use std::io;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// What this process reads and writes, while somebody wants to know.
static OPENED: Mutex<Opened> = Mutex::new(Opened { wanted: 0, read: Vec::new(), written: Vec::new() });

struct Opened {
    /// How many [`KeptApart`] live.
    wanted: u32,
    read: Vec<Identity>,
    written: Vec<Place>,
}

/// A file: device and inode.
type Identity = (u64, u64);

/// A name in a folder, of a file that may not be there yet.
type Place = (Identity, OsString);

/// While it lives, files that were opened as inputs since it began cannot be written, and no file can be written as two things at once. It is for a
/// program of one job: a library does not know what its caller wants to do next.
#[derive(Debug)]
pub struct KeptApart(());

impl KeptApart {
    /// Begins to remember.
    pub fn begin() -> Self {
        opened(|opened| opened.wanted += 1);
        Self(())
    }
}

impl Drop for KeptApart {
    fn drop(&mut self) {
        opened(|opened| {
            opened.wanted -= 1;
            if opened.wanted == 0 {
                opened.read.clear();
                opened.written.clear();
            }
        });
    }
}

/// Notes a file that is read. Devices and pipes may be read and written.
pub(crate) fn note_input(found: &Metadata) {
    let Some(identity) = identity(found).filter(|_| found.is_file()) else { return };
    opened(|opened| {
        if opened.wanted > 0 && !opened.read.contains(&identity) {
            opened.read.push(identity);
        }
    });
}

/// Refuses a file that is an input.
pub(crate) fn check_no_input(target: &Path) -> io::Result<()> {
    let found = fs::metadata(target).ok().filter(Metadata::is_file).as_ref().and_then(identity);
    match found {
        Some(found) if opened(|opened| opened.read.contains(&found)) => Err(io::Error::new(
            io::ErrorKind::InvalidInput,
            "it is read by this command: name another file to be written",
        )),
        _ => Ok(()),
    }
}

/// An output's name, its own while this lives.
#[derive(Debug)]
pub(crate) struct Claim(Option<Place>);

impl Claim {
    /// Claims what stands at `target`, or would; refuses what is written already.
    pub(crate) fn take(target: &Path) -> io::Result<Self> {
        let Some(place) = place(target) else { return Ok(Self(None)) };
        opened(|opened| {
            if opened.wanted == 0 {
                return Ok(Self(None));
            }
            if opened.written.contains(&place) {
                return Err(io::Error::new(
                    io::ErrorKind::InvalidInput,
                    "it is to be written as two things: name a file for each",
                ));
            }
            opened.written.push(place.clone());
            Ok(Self(Some(place)))
        })
    }
}

impl Drop for Claim {
    fn drop(&mut self) {
        if let Some(place) = self.0.take() {
            opened(|opened| opened.written.retain(|written| *written != place));
        }
    }
}

fn opened<T>(what: impl FnOnce(&mut Opened) -> T) -> T {
    what(&mut OPENED.lock().unwrap_or_else(PoisonError::into_inner))
}

fn place(target: &Path) -> Option<Place> {
    let folder = target.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    Some((identity(&fs::metadata(folder).ok()?)?, target.file_name()?.to_owned()))
}

#[cfg(unix)]
fn identity(found: &Metadata) -> Option<Identity> {
    use std::os::unix::fs::MetadataExt as _;
    Some((found.dev(), found.ino()))
}

#[cfg(not(unix))]
fn identity(_: &Metadata) -> Option<Identity> {
    None
}
