//! Scenarios side by side, each in a process of its own: a clock in lockstep looks at all connections of its process, and would wait for the
//! children of others.

use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::sync::Arc;

use rowscan_check::Tried;
use rowscan_ports::task;
use tokio::io::AsyncReadExt;
use tokio::process::Command;
use tokio::sync::{Semaphore, watch};
use tokio::task::JoinHandle;

use super::Failure;

/// Scenarios to try, a process each.
#[derive(Debug)]
pub(super) struct Jobs {
    pub(super) scenarios: Vec<PathBuf>,
    /// Flags of each process.
    pub(super) flags: Vec<String>,
    /// Processes at a time.
    pub(super) at_once: usize,
    pub(super) fail_fast: bool,
}

impl Jobs {
    /// Tries them, and tells each in their order; what was done when it was cancelled.
    pub(super) async fn run(
        self,
        cancelled: watch::Receiver<bool>,
        tell: &mut (dyn FnMut(&Tried) -> Result<(), Failure> + Send),
    ) -> Result<Vec<Tried>, Failure> {
        let system = |cause| Failure::System { what: "start a process for a scenario", cause };
        let program = std::env::current_exe().map_err(system)?;
        let (stop, stopped) = watch::channel(false);
        let free = Arc::new(Semaphore::new(self.at_once));
        let mut jobs: Vec<JoinHandle<Vec<Tried>>> = Vec::new();
        for (number, scenario) in self.scenarios.into_iter().enumerate() {
            let mut command = Command::new(&program);
            command.arg("check").arg(&scenario).args(&self.flags).args(["--before", &number.to_string()]);
            let (free, ends) = (Arc::clone(&free), [cancelled.clone(), stopped.clone()]);
            jobs.push(tokio::spawn(task(async move {
                // Nobody closes it.
                let _place = free.acquire().await;
                one(command, &scenario, ends).await
            })));
        }
        let mut all = Vec::new();
        for job in jobs {
            let tried = job.await.map_err(|cause| system(cause.into()))?;
            if *stop.borrow() {
                continue;
            }
            tried.iter().try_for_each(&mut *tell)?;
            let is_bad = !tried.iter().all(Tried::is_fine);
            all.extend(tried);
            if is_bad && self.fail_fast {
                let _ = stop.send(true);
            }
        }
        Ok(all)
    }
}

/// Waits for an end; for ever if nobody can say so any more.
async fn says_so(mut end: watch::Receiver<bool>) {
    if end.wait_for(|end| *end).await.is_err() {
        std::future::pending().await
    }
}

/// Tries one scenario; its process is told to end when one of `ends` says so.
async fn one(mut command: Command, scenario: &Path, ends: [watch::Receiver<bool>; 2]) -> Vec<Tried> {
    if ends.iter().any(|end| *end.borrow()) {
        return vec![Tried::not_begun(scenario)];
    }
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).kill_on_drop(true);
    let unjudged = |why: String| vec![Tried::unjudged(scenario, &why)];
    let mut process = match command.spawn() {
        Ok(process) => process,
        Err(cause) => return unjudged(format!("cannot start a process for it: {cause}")),
    };
    let (stdin, stdout, stderr) = (process.stdin.take(), process.stdout.take(), process.stderr.take());
    let mut told = String::new();
    let mut complaints = String::new();
    let finished = async {
        let (mut out, mut err) = (stdout, stderr);
        let out = async {
            if let Some(out) = &mut out {
                let _ = out.read_to_string(&mut told).await;
            }
        };
        let err = async {
            if let Some(err) = &mut err {
                let _ = err.read_to_string(&mut complaints).await;
            }
        };
        tokio::join!(out, err);
        process.wait().await
    };
    let end = async {
        let [cancelled, stopped] = ends;
        tokio::select! {
            () = says_so(cancelled) => {}
            () = says_so(stopped) => {}
        }
        // The end of its input: it ends in order, and tells what is done.
        drop(stdin);
        std::future::pending::<()>().await;
    };
    let status = tokio::select! {
        status = finished => status,
        () = end => return vec![Tried::interrupted(scenario)],
    };
    let tried: Result<Vec<Tried>, _> =
        told.lines().map(|line| serde_json::from_slice(line.as_bytes())).collect();
    match (tried, status) {
        (Ok(tried), Ok(status)) if status.success() => tried,
        (_, status) => {
            let status = status.map_or_else(|cause| cause.to_string(), |status| status.to_string());
            let last = complaints.lines().last().unwrap_or("nothing");
            unjudged(format!("its process ended with {status}; it last said: {last}"))
        }
    }
}
