//! A child: started in its own process group, watched, told to end.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{ExitStatus, Stdio};
use std::sync::Arc;
use std::time::Duration;

use regex_lite::Regex;
use rowscan_emulator::lockstep::ChildClock;
use rowscan_ports::clock::within;
use rowscan_ports::task;
use tokio::process::Command;
use tokio::sync::watch;
use tokio::task::JoinSet;

use crate::journal::Journal;
use crate::output::Output;

/// How long a child may take, host time, to end by itself with its streams before it is told to.
const OWN_END: Duration = Duration::from_millis(300);
/// How long a child that was told to end may take, host time, before it is killed.
const GRACE: Duration = Duration::from_secs(3);
/// How long its output may take to end after it, host time: a grandchild may hold it open.
const LAST_WORDS: Duration = Duration::from_secs(1);
/// Where the program stands that has a child end with us. Not everywhere: then only an orderly end takes the children along.
const SETPRIV: &str = "/usr/bin/setpriv";

/// What a child is started with: placeholders filled in.
#[derive(Debug)]
pub(crate) struct Start<'a> {
    pub(crate) id: &'a str,
    /// The command as the scenario has it, for the journal: ports differ from run to run.
    pub(crate) written: &'a [String],
    pub(crate) command: Vec<String>,
    pub(crate) env: BTreeMap<String, String>,
    /// Its working folder, where its logs go too.
    pub(crate) folder: &'a Path,
    /// What is looked for in its output, by number.
    pub(crate) patterns: Vec<(usize, Regex)>,
}

/// Why a child could not be started.
#[derive(Debug, thiserror::Error)]
#[error("cannot start `{program}`: {cause}")]
pub(crate) struct StartError {
    program: String,
    cause: io::Error,
}

/// Stops a child and has it go on.
#[derive(Clone, Debug)]
pub(crate) struct Stopper {
    group: Option<i32>,
    exited: watch::Receiver<Option<i32>>,
}

impl Stopper {
    /// Stops it with its group.
    pub(crate) fn stop(&self) {
        self.signal(Signal::Stop);
    }

    /// Has it go on.
    pub(crate) fn go_on(&self) {
        self.signal(Signal::Continue);
    }

    fn signal(&self, signal: Signal) {
        // Its number may be another's once it has ended.
        if self.exited.borrow().is_none() {
            signal.send(self.group);
        }
    }
}

/// A running child. Dropping it kills its group.
#[derive(Debug)]
pub(crate) struct Child {
    pub(crate) id: String,
    pub(crate) output: Arc<Output>,
    /// The number of its process, also once it has ended.
    pub(crate) number: Option<u32>,
    group: Option<i32>,
    exited: watch::Receiver<Option<i32>>,
    tasks: JoinSet<()>,
}

impl Child {
    /// Starts it. On Linux it dies with the calling thread.
    pub(crate) fn start(start: Start<'_>, journal: &Journal) -> Result<Self, StartError> {
        let program = start.command.first().cloned().unwrap_or_default();
        let failed = |cause| StartError { program: program.clone(), cause };
        if program.contains('/') && !Path::new(&program).is_file() {
            return Err(failed(io::Error::from(io::ErrorKind::NotFound)));
        }
        let output = Output::create(start.folder, start.id, start.patterns, journal.clone());
        let output = Arc::new(output.map_err(failed)?);
        let mut command = command(&start.command);
        command
            .current_dir(start.folder)
            .envs(&start.env)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .kill_on_drop(true);
        #[cfg(unix)]
        command.process_group(0);
        let mut child = command.spawn().map_err(failed)?;
        let number = child.id();
        let group = number.and_then(|id| i32::try_from(id).ok());
        journal.note(format!("{}.started", start.id), start.written.join(" "));
        let (tell, exited) = watch::channel(None);
        let mut tasks = JoinSet::new();
        if let Some(pipe) = child.stdout.take() {
            tasks.spawn(task(Arc::clone(&output).follow("out", pipe)));
        }
        if let Some(pipe) = child.stderr.take() {
            tasks.spawn(task(Arc::clone(&output).follow("err", pipe)));
        }
        let (id, journal) = (start.id.to_owned(), journal.clone());
        tokio::spawn(task(async move {
            let code = child.wait().await.ok().and_then(exit_code);
            let told = code.map_or("its code is unknown".to_owned(), |code| format!("code {code}"));
            journal.note(format!("{id}.exited"), told);
            // Nobody needs to hear it.
            let _ = tell.send(Some(code.unwrap_or(-1)));
        }));
        Ok(Self { id: start.id.to_owned(), output, number, group, exited, tasks })
    }

    /// Its exit code, once it has ended; -1 where the system does not tell.
    pub(crate) fn exit_code(&self) -> Option<i32> {
        *self.exited.borrow()
    }

    /// Its process, while it runs.
    pub(crate) fn process(&self) -> Option<u32> {
        self.group.and_then(|group| u32::try_from(group).ok())
    }

    /// What stops it for a while.
    pub(crate) fn stopper(&self) -> Stopper {
        Stopper { group: self.group, exited: self.exited.clone() }
    }

    /// Waits until it has ended. Cancel safe.
    pub(crate) async fn exited(&self) {
        let mut exited = self.exited.clone();
        // The sender says it before it goes.
        let _ = exited.wait_for(Option::is_some).await;
    }

    /// Waits until it has ended, and kills it and what is left of its group if it takes long; waits for its last output.
    async fn end(&mut self) {
        if within(GRACE, self.exited()).await.is_none() {
            Signal::Kill.send(self.group);
            self.exited().await;
        }
        Signal::Kill.send(self.group);
        self.group = None;
        let tasks = &mut self.tasks;
        let _ = within(LAST_WORDS, async { while tasks.join_next().await.is_some() {} }).await;
    }
}

impl Drop for Child {
    fn drop(&mut self) {
        Signal::Kill.send(self.group);
    }
}

/// Ends them all, whose streams have ended. Simulated time stands, so what they still do is the same in every run; once all are told to end, their timers take the
/// host's time: one that cleans up may have to wait.
pub(crate) async fn end_all(children: &mut [Child], clock: Option<ChildClock>) {
    // A stopped one would not hear it.
    children.iter().for_each(|child| Signal::Continue.send(child.group));
    // One that ends with its streams is let go: an interpreter that exits heeds no signal's handler any more, and would be ended by the signal, now and then.
    let by_themselves = async {
        for child in &*children {
            child.exited().await;
        }
    };
    if within(OWN_END, by_themselves).await.is_none() {
        let stays = children.iter().filter(|child| child.exit_code().is_none());
        stays.for_each(|child| Signal::Terminate.send(child.group));
    }
    let mut last_timers = JoinSet::new();
    if let Some(clock) = clock {
        last_timers.spawn(task(async move { clock.follow_host().await }));
    }
    for child in children {
        child.end().await;
    }
}

#[derive(Clone, Copy, Debug)]
enum Signal {
    Terminate,
    Kill,
    Stop,
    Continue,
}

impl Signal {
    #[cfg(unix)]
    fn send(self, group: Option<i32>) {
        use rustix::process::{Pid, kill_process_group};
        let signal = match self {
            Self::Terminate => rustix::process::Signal::TERM,
            Self::Kill => rustix::process::Signal::KILL,
            Self::Stop => rustix::process::Signal::STOP,
            Self::Continue => rustix::process::Signal::CONT,
        };
        if let Some(group) = group.and_then(Pid::from_raw) {
            // It is gone: so much the better.
            let _ = kill_process_group(group, signal);
        }
    }

    #[cfg(not(unix))]
    fn send(self, _: Option<i32>) {}
}

/// The command; through `setpriv`, where that is, which asks the kernel to kill the child when our thread ends.
fn command(words: &[String]) -> Command {
    let direct = || {
        let mut command = Command::new(words.first().map_or("", String::as_str));
        command.args(words.get(1..).unwrap_or_default());
        command
    };
    if !PathBuf::from(SETPRIV).is_file() {
        return direct();
    }
    let mut command = Command::new(SETPRIV);
    command.args(["--pdeathsig", "KILL", "--"]).args(words);
    command
}

#[cfg(unix)]
fn exit_code(status: ExitStatus) -> Option<i32> {
    use std::os::unix::process::ExitStatusExt;
    status.code().or_else(|| status.signal().map(|signal| 128 + signal))
}

#[cfg(not(unix))]
fn exit_code(status: ExitStatus) -> Option<i32> {
    status.code()
}
