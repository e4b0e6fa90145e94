//! All processes that descend from a run's children, also those that have left their process group. They are found by an environment variable that
//! they inherit.

use std::sync::atomic::{AtomicU64, Ordering};

/// The variable's name.
const VARIABLE: &str = "ROWSCAN_RUN";
/// Looks at all processes, at most.
const ROUNDS: usize = 10;
/// Variables of a process, at most: the system itself allows fewer.
#[cfg(target_os = "linux")]
const MOST_BYTES: u64 = 8 * 1024 * 1024;

/// The descendants of one run. Dropping it kills those that still run.
#[derive(Debug)]
pub(crate) struct Descendants {
    value: String,
}

impl Descendants {
    /// Of a run that begins: no other run has this value.
    pub(crate) fn new() -> Self {
        static RUNS: AtomicU64 = AtomicU64::new(0);
        let run = RUNS.fetch_add(1, Ordering::Relaxed);
        Self { value: format!("{}-{run}", std::process::id()) }
    }

    /// What a child is started with, so that it and its own children are known.
    pub(crate) fn mark(&self) -> (String, String) {
        (VARIABLE.to_owned(), self.value.clone())
    }

    /// Kills those that still run, and returns their programs' names. Without `/proc` none is found; nor is one that has cleared its environment.
    pub(crate) fn end(&self) -> Vec<String> {
        let mut found = Vec::new();
        // A process that is killed while it starts another leaves that one behind: so look again.
        for _ in 0..ROUNDS {
            let left = self.kill();
            if left.is_empty() {
                break;
            }
            found.extend(left);
        }
        found
    }

    #[cfg(target_os = "linux")]
    fn kill(&self) -> Vec<String> {
        use rustix::process::{Pid, PidfdFlags, Signal, pidfd_open, pidfd_send_signal};
        let mut killed = Vec::new();
        let Ok(processes) = std::fs::read_dir("/proc") else { return killed };
        for process in processes.flatten() {
            let id = process.file_name().to_str().and_then(|name| name.parse().ok()).and_then(Pid::from_raw);
            let Some(id) = id.filter(|_| self.is_descendant(&process.path())) else { continue };
            let name = rowscan_files::read_own(&process.path().join("comm"), MOST_BYTES).unwrap_or_default();
            // The number may belong to another process by now: hold the process, and look again.
            let Ok(held) = pidfd_open(id, PidfdFlags::empty()) else { continue };
            if self.is_descendant(&process.path()) && pidfd_send_signal(&held, Signal::KILL).is_ok() {
                killed.push(String::from_utf8_lossy(&name).trim().to_owned());
            }
        }
        killed
    }

    #[cfg(not(target_os = "linux"))]
    fn kill(&self) -> Vec<String> {
        Vec::new()
    }

    /// Whether the process of this folder has the variable. One that has ended has none.
    #[cfg(target_os = "linux")]
    fn is_descendant(&self, process: &std::path::Path) -> bool {
        let mark = format!("{VARIABLE}={}", self.value);
        rowscan_files::read_own(&process.join("environ"), MOST_BYTES).is_ok_and(|variables| {
            variables.split(|byte| *byte == 0).any(|variable| variable == mark.as_bytes())
        })
    }
}

impl Drop for Descendants {
    fn drop(&mut self) {
        self.end();
    }
}
