//! Files that are written: the one place that decides what happens to what stands at a path already.
//!
//! A file that is an input, or another output, of the same program is refused while a [`KeptApart`](crate::KeptApart) lives.
//!
//! | at the path | what [`OutputFile`] does |
//! |---|---|
//! | nothing | writes a temporary file in the same folder, renames it on [`commit`](OutputFile::commit) |
//! | a file | the same; mode and owner stay. A file that may not be written to is refused |
//! | a recording: MCAP, a packet capture, CoLa telegrams, a candump log, any of them compressed | refuses it: what was recorded cannot be made again |
//! | a file with several names (hard links), or one whose owner cannot be kept | the finished content is copied into it |
//! | a symbolic link | as above, with the file it leads to; the link stays |
//! | a device, FIFO or terminal | writes to it directly |
//! | `-` | writes to standard output |
//!
//! Dropped without a commit, the temporary file is removed and the old file is as it was.

use std::fs::{self, File, Metadata, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use crate::apart::{Claim, check_no_input};
use crate::leftovers::Leftover;

/// Symbolic links that are followed one after another; the system's own limit.
const MAX_LINKS: usize = 40;

/// How recordings begin: MCAP; packet captures of both byte orders and clocks, and pcapng; CoLa B and A; gzip and Zstandard. Nothing that is exported begins so.
const RECORDINGS: [&[u8]; 10] = [
    b"\x89MCAP0\r\n",
    b"\xd4\xc3\xb2\xa1",
    b"\xa1\xb2\xc3\xd4",
    b"\x4d\x3c\xb2\xa1",
    b"\xa1\xb2\x3c\x4d",
    b"\x0a\x0d\x0d\x0a",
    b"\x02\x02\x02\x02",
    b"\x02s",
    b"\x1f\x8b",
    b"\x28\xb5\x2f\xfd",
];

/// True of what begins as a recording does; of a candump log by its first time: `(1700000000.000000) can0`.
fn is_recording(begins: &[u8]) -> bool {
    let is_candump = matches!(begins, [b'(', digit, ..] if digit.is_ascii_digit());
    is_candump || RECORDINGS.iter().any(|magic| begins.starts_with(magic))
}

/// So many bytes tell what a file is.
const BEGINNING: u64 = 16;

/// The path that means standard output.
pub const STANDARD_OUTPUT: &str = "-";

/// A file being written. Only [`commit`](Self::commit) changes what stands at its path, unless that is a device, FIFO or `-`.
#[derive(Debug)]
pub struct OutputFile {
    target: Target,
    /// Keeps other outputs away from its name.
    _claim: Option<Claim>,
    /// It may be an input: what is repaired or kept is read first.
    is_anew: bool,
    /// Where the next byte goes, for what cannot be rewound.
    written: u64,
}

/// A file that [`OutputFile::append_to_new`] opened, to be taken back if nothing worth keeping came.
#[derive(Clone, Debug)]
pub struct NewFile {
    /// None if it is no file of its own.
    path: Option<PathBuf>,
    /// It was there, empty.
    was_there: bool,
}

#[derive(Debug)]
enum Target {
    Replaced(Replaced),
    Direct(File),
    Stdout(io::Stdout),
    /// To be copied to what cannot be rewound.
    Spooled(File, Leftover, Box<Target>),
}

/// A temporary file, and what becomes of it.
#[derive(Debug)]
struct Replaced {
    file: File,
    temporary: Leftover,
    target: PathBuf,
    /// The file that stands there already.
    old: Option<File>,
    /// Its content is replaced and not the file.
    in_place: bool,
}

impl OutputFile {
    /// Writes all of its content, and has it appear.
    ///
    /// # Errors
    /// The system's; then nothing has appeared.
    pub fn write_whole(mut self, content: &[u8]) -> io::Result<()> {
        self.write_all(content)?;
        self.commit()
    }

    /// Opens `path` for a content that appears as a whole.
    ///
    /// # Errors
    /// The system's; [`io::ErrorKind::InvalidInput`] of an input or another output of this program; [`io::ErrorKind::AlreadyExists`] of a recording.
    pub fn create(path: &Path) -> io::Result<Self> {
        if is_standard_output(path) {
            return Ok(Self::of(Target::Stdout(io::stdout())));
        }
        let target = follow_links(path)?;
        check_no_input(&target)?;
        check_no_recording(&target)?;
        Self::open(&target)
    }

    /// The same of a file that this program has read and writes anew: what it repairs, and what it keeps for itself.
    ///
    /// # Errors
    /// As [`create`](Self::create).
    pub fn create_anew(path: &Path) -> io::Result<Self> {
        Ok(Self { is_anew: true, ..Self::open(&follow_links(path)?)? })
    }

    fn open(target: &Path) -> io::Result<Self> {
        let found = match fs::metadata(target) {
            Ok(found) => Some(found),
            Err(cause) if cause.kind() == io::ErrorKind::NotFound => None,
            Err(cause) => return Err(cause),
        };
        match &found {
            Some(found) if found.is_dir() => return Err(is_a_directory()),
            Some(found) if !found.is_file() => return Ok(Self::of(Target::Direct(open_existing(target)?))),
            _ => {}
        }
        let claim = Some(Claim::take(target)?);
        let opened = match found {
            Some(found) => {
                // Fails where the file may not be written to, as it would without a temporary file.
                let old = open_existing(target)?;
                match replace(target, Some((old, &found))) {
                    // The file may be written to, but not its folder.
                    Err(cause) if cause.kind() == io::ErrorKind::PermissionDenied => {
                        Target::Direct(OpenOptions::new().write(true).truncate(true).open(target)?)
                    }
                    other => other?,
                }
            }
            None => replace(target, None)?,
        };
        Ok(Self { _claim: claim, ..Self::of(opened) })
    }

    /// The same of a content whose beginning is written again at its end. Where that cannot be (a device, a FIFO, standard output), it is
    /// collected in a file in `folder` and copied on [`commit`](Self::commit).
    pub fn create_rewound(path: &Path, folder: &Path) -> io::Result<Self> {
        let file = Self::create(path)?;
        if !file.is_direct() {
            return Ok(file);
        }
        let (spool, temporary) = create_temporary(&folder.join("spool"), true)?;
        Ok(Self::of(Target::Spooled(spool, temporary, Box::new(file.target))))
    }

    /// Opens `path` for a content that is kept from its first byte on, such as a live recording. A file that holds bytes already is
    /// refused with [`io::ErrorKind::AlreadyExists`].
    pub fn append_to_new(path: &Path) -> io::Result<(Self, NewFile)> {
        if is_standard_output(path) {
            let new = NewFile { path: None, was_there: true };
            return Ok((Self::of(Target::Stdout(io::stdout())), new));
        }
        let target = follow_links(path)?;
        let found = fs::metadata(&target).ok();
        match &found {
            Some(found) if found.is_dir() => return Err(is_a_directory()),
            Some(found) if found.is_file() && found.len() > 0 => {
                return Err(io::ErrorKind::AlreadyExists.into());
            }
            _ => {}
        }
        let is_file = found.as_ref().is_none_or(Metadata::is_file);
        let claim =
            is_file.then(|| check_no_input(&target).and_then(|()| Claim::take(&target))).transpose()?;
        let file = OpenOptions::new().write(true).create(true).truncate(true).open(&target)?;
        let new = NewFile { path: is_file.then_some(target), was_there: found.is_some() };
        Ok((Self { _claim: claim, ..Self::of(Target::Direct(file)) }, new))
    }

    fn of(target: Target) -> Self {
        Self { target, _claim: None, is_anew: false, written: 0 }
    }

    /// True if the bytes leave as they are written and cannot be taken back: to a device, a FIFO or standard output.
    pub fn is_direct(&self) -> bool {
        matches!(self.target, Target::Direct(_) | Target::Stdout(_))
    }

    /// Puts the content in its place.
    pub fn commit(self) -> io::Result<()> {
        let mut target = match self.target {
            Target::Replaced(target) => target,
            Target::Spooled(mut spool, _temporary, to) => {
                let mut out = Self::of(*to);
                spool.seek(SeekFrom::Start(0))?;
                io::copy(&mut spool, &mut out)?;
                return out.commit();
            }
            Target::Direct(mut file) => return file.flush(),
            Target::Stdout(mut out) => return out.flush(),
        };
        if !self.is_anew {
            check_no_input(&target.target)?;
        }
        if let (true, Some(old)) = (target.in_place, &mut target.old) {
            target.file.seek(SeekFrom::Start(0))?;
            old.set_len(0)?;
            io::copy(&mut target.file, old)?;
            return old.sync_all();
        }
        // On the disk before it has the name: whoever looks after a power cut finds the old content or the new.
        target.file.sync_all()?;
        fs::rename(target.temporary.path(), &target.target)
    }
}

impl NewFile {
    /// Removes the file, or empties it if it was there before. A device is left alone.
    pub fn discard(&self) -> io::Result<()> {
        match &self.path {
            Some(path) if self.was_there => OpenOptions::new().write(true).open(path)?.set_len(0),
            Some(path) => fs::remove_file(path),
            None => Ok(()),
        }
    }
}

/// True if `path` means standard output.
pub fn is_standard_output(path: &Path) -> bool {
    path.as_os_str() == STANDARD_OUTPUT
}

impl OutputFile {
    fn out(&mut self) -> &mut dyn Write {
        match &mut self.target {
            Target::Replaced(target) => &mut target.file,
            Target::Direct(file) | Target::Spooled(file, ..) => file,
            Target::Stdout(out) => out,
        }
    }
}

impl Write for OutputFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.out().write(bytes)?;
        self.written += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out().flush()
    }
}

/// Pipes and standard output only tell where they are.
impl Seek for OutputFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match (&mut self.target, to) {
            (_, SeekFrom::Current(0)) => Ok(self.written),
            (Target::Replaced(Replaced { file, .. }) | Target::Spooled(file, ..), to) => {
                self.written = file.seek(to)?;
                Ok(self.written)
            }
            _ => Err(io::Error::new(io::ErrorKind::NotSeekable, "it cannot be rewound")),
        }
    }
}

/// Where a path leads to. The last link may lead to a file that does not exist yet.
fn follow_links(path: &Path) -> io::Result<PathBuf> {
    let mut path = path.to_owned();
    for _ in 0..MAX_LINKS {
        match fs::symlink_metadata(&path) {
            Ok(found) if found.is_symlink() => {
                // `join` takes an absolute target as it is.
                path = path.parent().unwrap_or(Path::new("")).join(fs::read_link(&path)?);
            }
            _ => return Ok(path),
        }
    }
    Err(io::Error::other("too many symbolic links lead on from there"))
}

/// Refuses a file that holds a recording, whole or torn.
fn check_no_recording(target: &Path) -> io::Result<()> {
    let mut begins = Vec::new();
    // A FIFO is not opened: it would wait for its other end.
    let is_file = fs::metadata(target).is_ok_and(|found| found.is_file());
    let read = |file: File| file.take(BEGINNING).read_to_end(&mut begins);
    match is_file && File::open(target).and_then(read).is_ok() && is_recording(&begins) {
        true => Err(io::Error::new(
            io::ErrorKind::AlreadyExists,
            "it holds a recording, which nothing is written over: name another file, or remove it",
        )),
        false => Ok(()),
    }
}

fn open_existing(path: &Path) -> io::Result<File> {
    OpenOptions::new().write(true).open(path)
}

fn is_a_directory() -> io::Error {
    io::Error::new(io::ErrorKind::IsADirectory, "it is a directory")
}

/// Begins a temporary file in the folder of `target`, like the old file where there is one.
fn replace(target: &Path, old: Option<(File, &Metadata)>) -> io::Result<Target> {
    let (file, temporary) = create_temporary(target, old.is_some())?;
    let in_place = old.as_ref().is_some_and(|(_, found)| has_other_names(found) || !take_after(&file, found));
    let old = old.map(|(old, _)| old);
    Ok(Target::Replaced(Replaced { file, temporary, target: target.to_owned(), old, in_place }))
}

/// Makes a file of a name that nothing else has. `private`: only its owner reads it until it gets another file's mode.
fn create_temporary(target: &Path, private: bool) -> io::Result<(File, Leftover)> {
    /// Tells apart the files of one process.
    static NUMBER: AtomicU64 = AtomicU64::new(0);
    let mut options = OpenOptions::new();
    options.read(true).write(true).create_new(true);
    #[cfg(unix)]
    if private {
        std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    }
    #[cfg(not(unix))]
    let _ = private;
    loop {
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let path = target.with_file_name(format!(".rowscan-{}-{number}.part", std::process::id()));
        match options.open(&path) {
            Ok(file) => {
                return Ok((file, Leftover::file(path)));
            }
            Err(cause) if cause.kind() == io::ErrorKind::AlreadyExists => {}
            Err(cause) => return Err(cause),
        }
    }
}

#[cfg(unix)]
fn has_other_names(found: &Metadata) -> bool {
    std::os::unix::fs::MetadataExt::nlink(found) > 1
}

#[cfg(not(unix))]
fn has_other_names(_: &Metadata) -> bool {
    false
}

/// Gives `file` the owner and mode of another; false if the system refuses.
fn take_after(file: &File, found: &Metadata) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::{MetadataExt as _, fchown};
        let ours = file.metadata().map(|ours| (ours.uid(), ours.gid()));
        let owner = (found.uid(), found.gid());
        if !ours.is_ok_and(|ours| ours == owner) && fchown(file, Some(owner.0), Some(owner.1)).is_err() {
            return false;
        }
    }
    file.set_permissions(found.permissions()).is_ok()
}

#[cfg(unix)]
#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::{FileTypeExt as _, MetadataExt as _, PermissionsExt as _, symlink};

    fn write(path: &Path, content: &str) {
        let mut file = OutputFile::create(path).unwrap();
        file.write_all(content.as_bytes()).unwrap();
        file.commit().unwrap();
    }

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn a_recording_stays_what_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("drive.mcap");
        let link = folder.path().join("link.csv");
        symlink(&path, &link).unwrap();
        let others = [&b"(1700000000.000000) can0 18FEF100#00"[..], b"\x89MCAP0\r\nand more"];
        for content in RECORDINGS.into_iter().chain(others) {
            fs::write(&path, content).unwrap();
            for name in [&path, &link] {
                let refused = OutputFile::create(name).unwrap_err();
                assert_eq!(refused.kind(), io::ErrorKind::AlreadyExists, "{refused}");
            }
            assert_eq!(fs::read(&path).unwrap(), content);
        }
        // What only begins like one, what is empty, and what is kept by this program itself.
        for content in [&RECORDINGS[0][..7], b"", b"y_m,leaf_area_m2\n", b"PAR1", b"<svg", b"II*\0", b"(a)"] {
            fs::write(&path, content).unwrap();
            OutputFile::create(&path).unwrap().write_whole(b"new").unwrap();
            assert_eq!(fs::read(&path).unwrap(), b"new");
        }
        fs::write(&path, RECORDINGS[0]).unwrap();
        OutputFile::create_anew(&path).unwrap().write_whole(b"repaired").unwrap();
    }

    #[test]
    fn a_file_keeps_its_mode_and_owner_and_an_existing_part_file_is_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.csv");
        fs::write(&path, "old").unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).unwrap();
        // Only root may give files away.
        let is_root = std::os::unix::fs::chown(&path, Some(1234), Some(1235)).is_ok();
        fs::write(folder.path().join("out.csv.part"), "precious").unwrap();
        write(&path, "new");
        let found = fs::metadata(&path).unwrap();
        assert_eq!((fs::read_to_string(&path).unwrap().as_str(), found.mode() & 0o7777), ("new", 0o640));
        assert!(!is_root || (found.uid(), found.gid()) == (1234, 1235));
        assert_eq!(fs::read_to_string(folder.path().join("out.csv.part")).unwrap(), "precious");
        assert_eq!(names(folder.path()), ["out.csv", "out.csv.part"]);
    }

    #[test]
    fn links_stay_links_and_their_file_changes() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("data")).unwrap();
        fs::write(at("data/real"), "old").unwrap();
        symlink("data/real", at("one")).unwrap();
        symlink("one", at("two")).unwrap();
        write(&at("two"), "new");
        assert!(at("one").is_symlink() && at("two").is_symlink());
        assert_eq!(fs::read_to_string(at("data/real")).unwrap(), "new");
        symlink("data/none_yet", at("dangling")).unwrap();
        write(&at("dangling"), "made");
        assert_eq!(fs::read_to_string(at("data/none_yet")).unwrap(), "made");
        symlink("circle", at("circle")).unwrap();
        assert!(OutputFile::create(&at("circle")).is_err());
        fs::hard_link(at("data/real"), at("hard")).unwrap();
        write(&at("hard"), "both");
        assert_eq!(fs::read_to_string(at("data/real")).unwrap(), "both");
        assert_eq!(fs::metadata(at("hard")).unwrap().nlink(), 2);
        assert_eq!(names(&at("data")), ["none_yet", "real"]);
    }

    #[test]
    fn devices_and_pipes_are_written_through() {
        let folder = tempfile::tempdir().unwrap();
        let null = folder.path().join("null");
        symlink("/dev/null", &null).unwrap();
        write(&null, "gone");
        write(Path::new("/dev/null"), "gone");
        assert!(fs::metadata("/dev/null").unwrap().file_type().is_char_device());
        assert!(null.is_symlink());
        let fifo = folder.path().join("fifo");
        assert!(std::process::Command::new("mkfifo").arg(&fifo).status().unwrap().success());
        let reader = std::thread::spawn({
            let fifo = fifo.clone();
            move || fs::read_to_string(fifo).unwrap()
        });
        write(&fifo, "through");
        assert_eq!(reader.join().unwrap(), "through");
        assert!(fs::metadata(&fifo).unwrap().file_type().is_fifo());
    }

    #[test]
    fn what_is_rewound_reaches_a_pipe_in_order() {
        let folder = tempfile::tempdir().unwrap();
        let (fifo, spool) = (folder.path().join("fifo"), tempfile::tempdir().unwrap());
        assert!(std::process::Command::new("mkfifo").arg(&fifo).status().unwrap().success());
        let reader = std::thread::spawn({
            let fifo = fifo.clone();
            move || fs::read_to_string(fifo).unwrap()
        });
        let mut file = OutputFile::create_rewound(&fifo, spool.path()).unwrap();
        file.write_all(b"0 rows").unwrap();
        file.seek(SeekFrom::Start(0)).unwrap();
        file.write_all(b"7").unwrap();
        assert_eq!(names(spool.path()).len(), 1);
        file.commit().unwrap();
        assert_eq!(reader.join().unwrap(), "7 rows");
        assert!(names(spool.path()).is_empty());
    }

    #[test]
    fn without_a_commit_nothing_has_happened() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out");
        let mut half = OutputFile::create(&path).unwrap();
        half.write_all(b"half").unwrap();
        drop(half);
        assert!(names(folder.path()).is_empty());
        fs::write(&path, "old").unwrap();
        OutputFile::create(&path).unwrap().write_all(b"half").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(names(folder.path()), ["out"]);
        assert_eq!(OutputFile::create(folder.path()).unwrap_err().kind(), io::ErrorKind::IsADirectory);
        assert!(OutputFile::create(&folder.path().join("none/out")).is_err());
    }

    #[test]
    fn two_writers_of_one_path_do_not_share_a_temporary_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out");
        let (mut one, mut other) = (OutputFile::create(&path).unwrap(), OutputFile::create(&path).unwrap());
        one.write_all(b"one").unwrap();
        other.write_all(b"other").unwrap();
        other.commit().unwrap();
        one.commit().unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "one");
        assert_eq!(names(folder.path()), ["out"]);
    }
}
