//! What a program leaves behind that ends before its owners do: temporary files, and links to what is gone.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Everything of this process that must go with it.
static LEFTOVERS: Mutex<Vec<Named>> = Mutex::new(Vec::new());

/// A name in a folder, and where it leads to if it is a link.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Named {
    path: PathBuf,
    target: Option<PathBuf>,
}

impl Named {
    /// Removes it, unless another program has taken the name over meanwhile.
    fn remove(&self) {
        let is_ours = match &self.target {
            Some(target) => fs::read_link(&self.path).is_ok_and(|found| found == *target),
            None => true,
        };
        if is_ours {
            // It may have been renamed; nobody waits for an answer.
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// A name that is removed when this is dropped, or by [`remove_leftovers`], whichever comes first.
#[derive(Debug)]
pub struct Leftover(Named);

impl Leftover {
    /// A file.
    pub fn file(path: PathBuf) -> Self {
        Self::of(Named { path, target: None })
    }

    /// A symbolic link to `target`; one that leads elsewhere by then is left alone.
    pub fn link(path: PathBuf, target: PathBuf) -> Self {
        Self::of(Named { path, target: Some(target) })
    }

    fn of(named: Named) -> Self {
        LEFTOVERS.lock().unwrap_or_else(PoisonError::into_inner).push(named.clone());
        Self(named)
    }

    /// The name.
    pub fn path(&self) -> &Path {
        &self.0.path
    }
}

impl Drop for Leftover {
    fn drop(&mut self) {
        let mut all = LEFTOVERS.lock().unwrap_or_else(PoisonError::into_inner);
        // Not there: it was removed already, and the name may be another's by now.
        if let Some(at) = all.iter().position(|named| *named == self.0) {
            all.swap_remove(at).remove();
        }
    }
}

/// Removes every [`Leftover`] of this process. For a program that ends while a thread of its own still has some.
pub fn remove_leftovers() {
    for named in LEFTOVERS.lock().unwrap_or_else(PoisonError::into_inner).drain(..) {
        named.remove();
    }
}
