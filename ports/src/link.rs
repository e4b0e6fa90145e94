//! A name that stays: a symbolic link to a pseudo-terminal, whose own name the system chooses anew each time.

use std::fs;
use std::io;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

use rowscan_files::{Leftover, NameLock};

/// Where the system keeps pseudo-terminals.
const PSEUDO_TERMINALS: &str = "/dev/pts";

/// Why a link could not be made.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// Something else has the name, and is left alone.
    #[error("{} is already there and no link to a pseudo-terminal; choose another name, or remove it", .0.display())]
    Taken(PathBuf),
    /// Another program serves clients there.
    #[error(
        "{} is served by another rowscan already; choose another name, or end that program", .0.display()
    )]
    InUse(PathBuf),
    /// The system refused.
    #[error("cannot make the link {}: {cause}; expected a name in a folder that you may write to", path.display())]
    System {
        /// The link.
        path: PathBuf,
        /// What the system said.
        cause: io::Error,
    },
}

/// A symbolic link that goes away with its owner.
#[derive(Debug)]
pub(super) struct Link {
    link: Leftover,
    _claim: NameLock,
}

impl Link {
    /// Links `path` to the terminal `target`. A link left behind by a program that was killed is replaced at once, without a
    /// moment in which there is none; one that a living rowscan serves is left alone.
    pub(super) fn place(path: &Path, target: &Path) -> Result<Self, LinkError> {
        let claim = NameLock::take(path).map_err(|cause| match cause.kind() {
            io::ErrorKind::AddrInUse => LinkError::InUse(path.to_owned()),
            _ => LinkError::System { path: path.to_owned(), cause },
        })?;
        match fs::read_link(path) {
            Ok(found) if found.starts_with(PSEUDO_TERMINALS) => {}
            Ok(_) => return Err(LinkError::Taken(path.to_owned())),
            Err(cause) if cause.kind() == io::ErrorKind::NotFound => {}
            // It is there, and no link.
            Err(cause) if cause.kind() == io::ErrorKind::InvalidInput => {
                return Err(LinkError::Taken(path.to_owned()));
            }
            Err(cause) => return Err(LinkError::System { path: path.to_owned(), cause }),
        }
        let mut beside = path.as_os_str().to_owned();
        beside.push(format!(".{}.new", std::process::id()));
        let beside = PathBuf::from(beside);
        symlink(target, &beside)
            .and_then(|()| fs::rename(&beside, path))
            .inspect_err(|_| {
                let _ = fs::remove_file(&beside);
            })
            .map_err(|cause| LinkError::System { path: path.to_owned(), cause })?;
        Ok(Self { link: Leftover::link(path.to_owned(), target.to_owned()), _claim: claim })
    }

    pub(super) fn path(&self) -> &Path {
        self.link.path()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stale_link_is_replaced_and_anything_else_is_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scanner");
        symlink("/dev/pts/100000", &path).unwrap();
        let link = Link::place(&path, Path::new("/dev/pts/100001")).unwrap();
        assert_eq!(fs::read_link(link.path()).unwrap(), Path::new("/dev/pts/100001"));
        drop(link);
        assert!(fs::symlink_metadata(&path).is_err(), "removed with its owner");

        fs::write(&path, "mine").unwrap();
        assert!(matches!(Link::place(&path, Path::new("/dev/pts/1")), Err(LinkError::Taken(_))));
        assert_eq!(fs::read_to_string(&path).unwrap(), "mine");
        let elsewhere = folder.path().join("elsewhere");
        symlink("/etc/hostname", &elsewhere).unwrap();
        assert!(matches!(Link::place(&elsewhere, Path::new("/dev/pts/1")), Err(LinkError::Taken(_))));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_link_in_use_is_not_taken_over() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scanner");
        let first = Link::place(&path, Path::new("/dev/pts/100001")).unwrap();
        // The same name by another way.
        let other_way = folder.path().join("../").join(folder.path().file_name().unwrap()).join("scanner");
        for path in [&path, &other_way] {
            let refused = Link::place(path, Path::new("/dev/pts/100002"));
            assert!(matches!(refused, Err(LinkError::InUse(_))), "{refused:?}");
        }
        assert_eq!(fs::read_link(&path).unwrap(), Path::new("/dev/pts/100001"));
        drop(first);
        let second = Link::place(&path, Path::new("/dev/pts/100002")).unwrap();
        assert_eq!(fs::read_link(second.path()).unwrap(), Path::new("/dev/pts/100002"));
    }

    #[test]
    fn a_link_that_was_taken_over_is_not_removed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scanner");
        let first = Link::place(&path, Path::new("/dev/pts/100001")).unwrap();
        fs::remove_file(&path).unwrap();
        symlink("/dev/pts/100002", &path).unwrap();
        drop(first);
        assert_eq!(fs::read_link(&path).unwrap(), Path::new("/dev/pts/100002"));
    }
}
