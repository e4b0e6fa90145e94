//! Children whose time is simulated: their clock, and the library that puts a child on it.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};

use rowscan_emulator::lockstep::ChildClock;
use rowscan_emulator::stage::Stage;

use crate::scenario::{Scenario, Time};

/// The library's file.
const LIBRARY: &str = "librowscan_child_clock.so";
/// The variable that has a program's loader load it.
const PRELOAD: &str = "LD_PRELOAD";
/// The page's file in the run's folder.
const PAGE: &str = "time-page";
/// Where a program finds it, by placeholder.
const PLACE: &str = "clock";

/// Why a child cannot go by simulated time.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ChildClockError {
    #[error(transparent)]
    Page(#[from] rowscan_child_clock::PageError),
    #[error(
        "`time = \"simulated\"` needs {LIBRARY}, which is in none of: {0}; build it by `cargo build -p rowscan-child-clock-preload`, or name it in \
         ROWSCAN_CHILD_CLOCK"
    )]
    NoLibrary(String),
    #[error("{}: expected a path without spaces and colons; move it", .0.display())]
    Place(PathBuf),
    #[error("`{}` {why}; leave `time = \"simulated\"` out, or have it read {{{PLACE}}} (docs/lockstep.md)", program.display())]
    Program { program: PathBuf, why: &'static str },
}

/// The clock of the scenario's children, if one of them goes by it; its place is noted.
pub(crate) fn clock(
    scenario: &Scenario,
    stage: &Stage,
    folder: &Path,
    places: &mut BTreeMap<String, String>,
) -> Result<Option<ChildClock>, ChildClockError> {
    if scenario.runs.iter().all(|run| run.time == Time::Host) {
        return Ok(None);
    }
    let clock = ChildClock::create(&folder.join(PAGE), stage.receiver().start_s())?;
    places.insert(PLACE.to_owned(), clock.path().to_string_lossy().into_owned());
    Ok(Some(clock))
}

/// Where the library is: as `given`, or near `program`.
pub(crate) fn library(given: Option<&Path>, program: Option<&Path>) -> Result<PathBuf, ChildClockError> {
    let beside = program.and_then(Path::parent);
    let near = |folder: &Path| {
        [folder.to_owned(), folder.join("deps"), folder.join("../lib/rowscan")].map(|at| at.join(LIBRARY))
    };
    let mut places: Vec<PathBuf> = given.map(Path::to_owned).into_iter().collect();
    if given.is_none() {
        places.extend(beside.into_iter().flat_map(near));
    }
    let found = places.iter().find(|place| place.is_file());
    let looked = || places.iter().map(|place| place.display().to_string()).collect::<Vec<_>>().join(", ");
    let found = found.ok_or_else(|| ChildClockError::NoLibrary(looked()))?;
    // A child has another folder. That of a place that is there can be told.
    let found = std::path::absolute(found).unwrap_or_else(|_| found.clone());
    // The loader takes these for ends of a name.
    match found.to_str().filter(|path| !path.contains([':', ' '])) {
        Some(_) => Ok(found),
        None => Err(ChildClockError::Place(found)),
    }
}

/// What a child is started with so that it goes by the clock: `command` and `env` filled in.
pub(crate) fn put_on_clock(
    library: &Path,
    places: &BTreeMap<String, String>,
    command: &[String],
    env: &mut BTreeMap<String, String>,
) -> Result<(), ChildClockError> {
    let program = command.first().map_or("", String::as_str);
    if program.contains('/') {
        refuse(Path::new(program), library)?;
    }
    let others = env.get(PRELOAD).map(|others| format!(":{others}")).unwrap_or_default();
    env.insert(PRELOAD.to_owned(), format!("{}{others}", library.display()));
    env.extend(places.get(PLACE).map(|page| (rowscan_child_clock::VARIABLE.to_owned(), page.clone())));
    Ok(())
}

/// Refuses a program that cannot load the library. Of a script its interpreter does.
fn refuse(program: &Path, library: &Path) -> Result<(), ChildClockError> {
    let (Some(of_program), Some(of_library)) = (Elf::of(program), Elf::of(library)) else { return Ok(()) };
    let refused = |why| Err(ChildClockError::Program { program: program.to_owned(), why });
    if of_program.machine != of_library.machine {
        return refused("is for another architecture than the library of simulated time");
    }
    match of_program.has_loader {
        true => Ok(()),
        false => refused("is static: no library can give it simulated time"),
    }
}

/// What a program's file says of itself.
struct Elf {
    /// Class, byte order and number of the machine.
    machine: [u8; 4],
    has_loader: bool,
}

impl Elf {
    /// None if it is no such file, or its headers are not where linkers put them.
    fn of(path: &Path) -> Option<Self> {
        let mut head = Vec::new();
        rowscan_files::open(path).ok()?.take(4096).read_to_end(&mut head).ok()?;
        let word = |at: usize| head.get(at..at + 2)?.first_chunk().copied().map(u16::from_le_bytes);
        let is_known = head.starts_with(b"\x7fELF\x02\x01");
        let (kind, machine) = (head.get(16..18)?, head.get(18..20)?);
        if !is_known || !matches!(kind, [2 | 3, 0]) {
            return None;
        }
        let headers = usize::try_from(u64::from_le_bytes(*head.get(32..)?.first_chunk()?)).ok()?;
        let (size, count) = (usize::from(word(54)?), usize::from(word(56)?));
        /// `PT_INTERP`.
        const LOADER: [u8; 4] = [3, 0, 0, 0];
        let kinds = (0..count)
            .map(|number| head.get(headers.saturating_add(number * size)..)?.first_chunk::<4>().copied());
        let kinds = kinds.collect::<Option<Vec<_>>>()?;
        Some(Self {
            machine: [head[4], head[5], machine[0], machine[1]],
            has_loader: kinds.contains(&LOADER),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_library_is_told_with_the_command_that_builds_it() {
        let folder = tempfile::tempdir().unwrap();
        let program = folder.path().join("bin/rowscan");
        let missing = |given: Option<&Path>| library(given, Some(&program)).unwrap_err().to_string();
        let told = missing(None);
        assert!(
            told.contains("cargo build -p rowscan-child-clock-preload") && told.contains("bin/deps"),
            "{told}"
        );
        let at = folder.path().join("lib/rowscan").join(LIBRARY);
        std::fs::create_dir_all(at.parent().unwrap()).unwrap();
        std::fs::create_dir_all(program.parent().unwrap()).unwrap();
        std::fs::write(&at, "").unwrap();
        assert!(library(None, Some(&program)).unwrap().is_file());
        // What was named is not replaced by what is near.
        assert!(missing(Some(&folder.path().join("other.so"))).contains("other.so"));
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn a_static_program_and_one_of_another_machine_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let here = std::env::current_exe().unwrap();
        assert!(refuse(&here, &here).is_ok());
        let bytes = std::fs::read(&here).unwrap();
        let headers = usize::try_from(u64::from_le_bytes(*bytes[32..].first_chunk().unwrap())).unwrap();
        let changed = |name: &str, change: &dyn Fn(&mut [u8])| {
            let mut bytes = bytes.clone();
            change(&mut bytes);
            let path = folder.path().join(name);
            std::fs::write(&path, bytes).unwrap();
            refuse(&path, &here).map_err(|error| error.to_string())
        };
        let other = changed("other", &|bytes| bytes[18] ^= 1).unwrap_err();
        assert!(other.contains("another architecture"), "{other}");
        // Without the header of its loader.
        let is_static = changed("static", &|bytes| {
            for number in 0..usize::from(bytes[56]) {
                let at = headers + number * usize::from(bytes[54]);
                if bytes[at] == 3 {
                    bytes[at] = 4;
                }
            }
        });
        assert!(is_static.unwrap_err().contains("is static"));
        let script = folder.path().join("script");
        std::fs::write(&script, "#!/bin/sh\n").unwrap();
        assert!(refuse(&script, &here).is_ok());
    }
}
