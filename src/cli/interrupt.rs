//! SIGINT, SIGTERM and SIGHUP end a command in order.

use std::future::Future;

use super::{Failure, Outcome};

/// Resolves when the user wants the command to end.
pub(super) struct Interrupt {
    #[cfg(unix)]
    terminate: tokio::signal::unix::Signal,
    #[cfg(unix)]
    interrupt: tokio::signal::unix::Signal,
    #[cfg(unix)]
    hang_up: tokio::signal::unix::Signal,
}

impl Interrupt {
    /// From here on the signals are ours.
    #[cfg(unix)]
    pub(super) fn watch() -> Result<Self, Failure> {
        use tokio::signal::unix::{SignalKind, signal};
        let watch = |kind| signal(kind).map_err(|cause| Failure::System { what: "watch for signals", cause });
        Ok(Self {
            terminate: watch(SignalKind::terminate())?,
            interrupt: watch(SignalKind::interrupt())?,
            hang_up: watch(SignalKind::hangup())?,
        })
    }

    #[cfg(not(unix))]
    pub(super) fn watch() -> Result<Self, Failure> {
        Ok(Self {})
    }

    /// Waits for a signal. Cancel safe.
    pub(super) async fn wait(&mut self) {
        self.signal().await;
    }

    /// Waits for a signal and gives its number. Cancel safe.
    pub(super) async fn signal(&mut self) -> u8 {
        #[cfg(unix)]
        tokio::select! {
            _ = self.terminate.recv() => 15,
            _ = self.interrupt.recv() => 2,
            _ = self.hang_up.recv() => 1,
        }
        #[cfg(not(unix))]
        {
            let _ = tokio::signal::ctrl_c().await;
            2
        }
    }

    /// The result of a command that has none until it is finished; the signal's exit code if one comes first.
    pub(super) async fn finite(
        &mut self,
        work: impl Future<Output = Result<Outcome, Failure>>,
    ) -> Result<Outcome, Failure> {
        tokio::select! {
            ended = work => ended,
            signal = self.signal() => Ok(Outcome::Interrupted(signal)),
        }
    }

    /// `work`, unless a signal comes first.
    pub(super) async fn or<T>(&mut self, work: impl Future<Output = T>) -> Option<T> {
        tokio::select! {
            done = work => Some(done),
            () = self.wait() => None,
        }
    }
}

/// While it lives, a file that reaches the limit of `ulimit -f` gives an error on write, with a message. Without it SIGXFSZ kills the
/// program.
pub(super) struct FileSizeLimit {
    #[cfg(target_os = "linux")]
    _signal: Option<tokio::signal::unix::Signal>,
}

impl FileSizeLimit {
    /// Takes the signal, if the system gives it.
    pub(super) fn watch() -> Self {
        Self {
            #[cfg(target_os = "linux")]
            _signal: {
                // SIGXFSZ, everywhere but on MIPS.
                const FILE_SIZE: i32 = 25;
                tokio::signal::unix::signal(tokio::signal::unix::SignalKind::from_raw(FILE_SIZE)).ok()
            },
        }
    }
}
