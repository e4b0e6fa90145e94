//! What other programs on this machine are doing, by `/proc`: whose a socket is, and whether a program waits for input.

use std::collections::HashSet;
use std::ffi::OsStr;
use std::fs;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// System calls in which a thread waits for input, for time or for another thread, by their numbers on this architecture.
#[cfg(target_arch = "x86_64")]
const WAITS: &[(u64, &str)] = &[
    (0, "read"),
    (7, "poll"),
    (17, "pread64"),
    (19, "readv"),
    (23, "select"),
    (34, "pause"),
    (43, "accept"),
    (45, "recvfrom"),
    (47, "recvmsg"),
    (61, "wait4"),
    (128, "rt_sigtimedwait"),
    (202, "futex"),
    (208, "io_getevents"),
    (219, "restart_syscall"),
    (232, "epoll_wait"),
    (247, "waitid"),
    (270, "pselect6"),
    (271, "ppoll"),
    (281, "epoll_pwait"),
    (288, "accept4"),
    (299, "recvmmsg"),
    (441, "epoll_pwait2"),
    (449, "futex_waitv"),
];
/// The same on 64-bit ARM.
#[cfg(target_arch = "aarch64")]
const WAITS: &[(u64, &str)] = &[
    (4, "io_getevents"),
    (22, "epoll_pwait"),
    (63, "read"),
    (65, "readv"),
    (67, "pread64"),
    (72, "pselect6"),
    (73, "ppoll"),
    (95, "waitid"),
    (98, "futex"),
    (128, "restart_syscall"),
    (137, "rt_sigtimedwait"),
    (202, "accept"),
    (207, "recvfrom"),
    (212, "recvmsg"),
    (242, "accept4"),
    (243, "recvmmsg"),
    (260, "wait4"),
    (441, "epoll_pwait2"),
    (449, "futex_waitv"),
];
/// Elsewhere nothing counts as waiting.
#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
const WAITS: &[(u64, &str)] = &[];

/// System calls in which a thread sleeps by this machine's time, whoever holds the clock.
#[cfg(target_arch = "x86_64")]
const SLEEPS: &[(u64, &str)] = &[(35, "nanosleep"), (230, "clock_nanosleep")];
/// The same on 64-bit ARM.
#[cfg(target_arch = "aarch64")]
const SLEEPS: &[(u64, &str)] = &[(101, "nanosleep"), (115, "clock_nanosleep")];
/// Elsewhere none is known.
#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
const SLEEPS: &[(u64, &str)] = &[];

/// The name of a system call among these.
fn named(number: Option<i64>, among: &[(u64, &'static str)]) -> Option<&'static str> {
    let number = u64::try_from(number?).ok()?;
    among.iter().find(|(known, _)| *known == number).map(|(_, name)| *name)
}

/// What a program does at the moment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Doing {
    /// Every thread waits for input, time or another thread.
    Waits,
    /// A thread does something else.
    Works(String),
    /// It is gone.
    Gone,
}

/// The sockets that a process (`self`, or a number) has open.
pub(crate) fn sockets(process: &str) -> io::Result<HashSet<u32>> {
    let mut found = HashSet::new();
    for descriptor in fs::read_dir(format!("/proc/{process}/fd"))? {
        // A descriptor may be closed meanwhile.
        let Ok(target) = descriptor.and_then(|descriptor| fs::read_link(descriptor.path())) else { continue };
        let target = target.to_string_lossy();
        let inode = target.strip_prefix("socket:[").and_then(|rest| rest.strip_suffix(']'));
        found.extend(inode.and_then(|inode| inode.parse::<u32>().ok()));
    }
    Ok(found)
}

/// The processes that have this socket open.
pub(crate) fn owners(inode: u32) -> Vec<u32> {
    let processes = fs::read_dir("/proc").into_iter().flatten().flatten();
    let numbers = processes.filter_map(|entry| entry.file_name().to_str()?.parse::<u32>().ok());
    numbers.filter(|process| sockets(&process.to_string()).is_ok_and(|open| open.contains(&inode))).collect()
}

/// Room for a line of `/proc`.
const LINE: usize = 1024;

/// The line of a small file of `/proc`, read at once: looks at programs are most of what lockstep does.
fn line(file: PathBuf, room: &mut [u8; LINE]) -> io::Result<&str> {
    let size = fs::File::open(file)?.read(room)?;
    std::str::from_utf8(room.get(..size).unwrap_or_default()).map_err(io::Error::other)
}

/// The processor time that the threads of a process have used.
pub(crate) fn processor_time(process: u32) -> Duration {
    let threads = fs::read_dir(format!("/proc/{process}/task")).into_iter().flatten().flatten();
    let time_ns = threads.filter_map(|thread| {
        let mut room = [0; LINE];
        line(thread.path().join("schedstat"), &mut room).ok()?.split(' ').next()?.parse::<u64>().ok()
    });
    Duration::from_nanos(time_ns.sum())
}

/// True if no thread of a process runs, or is about to: whatever they wait for, time among it.
pub(crate) fn is_asleep(process: u32) -> bool {
    let threads = fs::read_dir(format!("/proc/{process}/task")).into_iter().flatten().flatten();
    let states = threads.filter_map(|thread| {
        let mut stat = [0; LINE];
        let stat = line(thread.path().join("stat"), &mut stat).ok()?;
        stat.rsplit_once(") ").and_then(|(_, rest)| rest.chars().next())
    });
    let mut states = states.peekable();
    states.peek().is_some() && states.all(|state| state == 'S')
}

/// What a process does.
pub(crate) fn doing(process: u32) -> Doing {
    doing_beside(process, None)
}

/// Whether a child of this program has ended, and the program has not taken its exit code.
pub(crate) fn is_unnoticed(process: u32) -> bool {
    let mut room = [0; LINE];
    let Ok(stat) = line(format!("/proc/{process}/stat").into(), &mut room) else { return false };
    let mut after = stat.rsplit_once(") ").map_or("", |(_, rest)| rest).split(' ');
    let (state, parent) = (after.next(), after.next());
    state == Some("Z") && parent.and_then(|parent| parent.parse().ok()) == Some(std::process::id())
}

/// What the other threads of this program do: one may hold what a peer said and nobody has dealt with yet.
pub(crate) fn doing_here() -> Doing {
    let this = fs::read_link("/proc/thread-self").ok();
    doing_beside(std::process::id(), this.as_deref().and_then(Path::file_name))
}

fn doing_beside(process: u32, left_out: Option<&OsStr>) -> Doing {
    let Ok(threads) = fs::read_dir(format!("/proc/{process}/task")) else { return Doing::Gone };
    let looked_at = |thread: &fs::DirEntry| left_out.is_none_or(|left_out| thread.file_name() != left_out);
    for thread in threads.flatten().filter(looked_at) {
        // A thread may end meanwhile.
        let (mut stat, mut call) = ([0; LINE], [0; LINE]);
        let Ok(stat) = line(thread.path().join("stat"), &mut stat) else { continue };
        let state = stat.rsplit_once(") ").and_then(|(_, rest)| rest.chars().next());
        match state {
            // A stopped program waits for nothing: it will work once it goes on.
            Some('T' | 't') => return Doing::Works("it is stopped".to_owned()),
            Some('Z' | 'X') => return Doing::Gone,
            Some('S') => {}
            // One that has been woken and waits for its processor to take it on is still in its system call, by the kernel's words.
            _ => return Doing::Works("a thread runs".to_owned()),
        }
        let call = match line(thread.path().join("syscall"), &mut call) {
            Ok(call) => call,
            Err(cause) if cause.kind() == io::ErrorKind::PermissionDenied => {
                return Doing::Works("its system calls may not be looked at (ptrace rights)".to_owned());
            }
            Err(_) => continue,
        };
        let number = call.split(' ').next().and_then(|number| number.trim().parse::<i64>().ok());
        if named(number, WAITS).is_none() {
            return Doing::Works(match (named(number, SLEEPS), number) {
                (Some(name), _) => format!("a thread sleeps by this machine's time, in {name}"),
                (None, Some(number)) => format!("a thread is in system call {number}"),
                (None, None) => "a thread runs".to_owned(),
            });
        }
    }
    Doing::Waits
}

/// The system calls its threads are in, for a message.
pub(crate) fn calls(process: u32) -> String {
    let threads = fs::read_dir(format!("/proc/{process}/task")).into_iter().flatten().flatten();
    let names = threads.map(|thread| {
        let call = fs::read_to_string(thread.path().join("syscall")).unwrap_or_default();
        let number = call.split(' ').next().unwrap_or_default().trim();
        call_name(number)
    });
    names.take(16).collect::<Vec<_>>().join(", ")
}

/// A system call as /proc tells it, in words: a number alone says nothing to a reader.
fn call_name(number: &str) -> String {
    let known = number.parse().ok();
    match named(known, WAITS).or_else(|| named(known, SLEEPS)) {
        Some(name) => name.to_owned(),
        None if known.is_some() => format!("system call {number}"),
        // Such as `running`.
        None => number.to_owned(),
    }
}

#[cfg(test)]
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
mod tests {
    use super::*;
    use std::process::{Command, Stdio};

    fn until(process: u32, wanted: impl Fn(&Doing) -> bool) {
        // The kernel takes its time; that it gets there is the assertion.
        while !wanted(&doing(process)) {
            std::thread::yield_now();
        }
    }

    #[test]
    fn a_system_call_without_a_name_is_told_as_one() {
        assert_eq!(call_name("9999"), "system call 9999");
        assert_eq!(call_name("running"), "running");
        assert_eq!(call_name(""), "");
    }

    #[test]
    fn a_program_that_reads_waits_and_a_stopped_one_does_not() {
        let mut child = Command::new("cat").stdin(Stdio::piped()).spawn().unwrap();
        until(child.id(), |doing| *doing == Doing::Waits);
        let signal = |name: &str| {
            Command::new("kill").args([name, &child.id().to_string()]).status().unwrap();
        };
        signal("-STOP");
        until(child.id(), |doing| matches!(doing, Doing::Works(why) if why == "it is stopped"));
        signal("-CONT");
        until(child.id(), |doing| *doing == Doing::Waits);
        child.kill().unwrap();
        child.wait().unwrap();
        assert_eq!(doing(child.id()), Doing::Gone);
    }

    #[test]
    fn a_program_that_sleeps_is_at_work_and_asleep() {
        let mut child = Command::new("sleep").arg("1000").spawn().unwrap();
        until(child.id(), |doing| matches!(doing, Doing::Works(_)) && is_asleep(child.id()));
        child.kill().unwrap();
        child.wait().unwrap();
        assert!(!is_asleep(child.id()), "it is gone");
        assert!(!is_asleep(std::process::id()), "this one runs");
    }

    #[test]
    fn a_program_that_computes_works() {
        let mut child = Command::new("sh").args(["-c", "while :; do :; done"]).spawn().unwrap();
        until(child.id(), |doing| matches!(doing, Doing::Works(_)));
        for _ in 0..100 {
            assert!(matches!(doing(child.id()), Doing::Works(_)));
        }
        child.kill().unwrap();
        child.wait().unwrap();
    }
}
