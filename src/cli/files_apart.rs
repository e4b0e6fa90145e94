//! No file is written over another one of the same command.

use std::path::{Path, PathBuf};

use super::Failure;

/// The files of one command.
#[derive(Debug, Default)]
pub(super) struct FilesApart<'a> {
    pub(super) read: Vec<&'a Path>,
    pub(super) written: Vec<&'a Path>,
}

impl FilesApart<'_> {
    /// Refuses a file that is to be written and is read, or written, as something else. Devices and pipes may be.
    pub(super) fn check(&self) -> Result<(), Failure> {
        for (number, path) in self.written.iter().enumerate() {
            let Some(place) = place(path) else { continue };
            let is_same = |other: &&&Path| self::place(other).is_some_and(|other| other == place);
            let name = path.display();
            if self.read.iter().any(|other| is_same(&other)) {
                let why = format!("{name} is read by this command: name another file to be written");
                return Err(Failure::Usage(why));
            }
            if self.written.iter().take(number).any(|other| is_same(&other)) {
                let why = format!("{name} is to be written as two things: name a file for each");
                return Err(Failure::Usage(why));
            }
        }
        Ok(())
    }
}

/// What the path leads to, or would; none of what is no file.
pub(super) fn place(path: &Path) -> Option<PathBuf> {
    match path.canonicalize() {
        Ok(found) => found.is_file().then_some(found),
        Err(_) => {
            let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty());
            let folder = parent.unwrap_or(Path::new(".")).canonicalize().ok()?;
            Some(folder.join(path.file_name()?))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_read_or_written_already_is_not_written_again() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("scene.toml"), "version = 1").expect("written");
        let check = |read: &[&Path], written: &[&Path]| {
            FilesApart { read: read.to_vec(), written: written.to_vec() }
                .check()
                .map_err(|error| error.to_string())
        };
        let (scene, truth, log) = (at("scene.toml"), at("truth.jsonl"), at("bus.log"));
        assert_eq!(check(&[&scene, Path::new("spindle")], &[&truth, &log]), Ok(()));
        let over = check(&[&scene], &[&truth, &folder.path().join("./scene.toml")]).expect_err("it is read");
        assert!(over.contains("scene.toml is read by this command"), "{over}");
        let twice = check(&[&scene], &[&log, &truth, &log]).expect_err("it is written");
        assert!(twice.contains("bus.log is to be written as two things"), "{twice}");
        let null = Path::new("/dev/null");
        assert_eq!(check(&[], &[null, null]), Ok(()));
    }
}
