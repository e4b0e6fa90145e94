//! SIGINT, SIGTERM and SIGHUP end every command: in order where it listens, at once where it cannot.
//!
//! A thread of its own hears them, so that nothing a command waits for (a FIFO, a stalled mount, a long computation) keeps it from ending:
//! one that does not notice the signal, or is not done with ending, is ended from here, and takes what it would leave behind with it.

use std::future::Future;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use rowscan_ports::clock::rest;
use tokio::sync::watch;

use super::{Failure, Outcome};

/// What a command gets to notice a signal in.
const UNNOTICED: Duration = Duration::from_millis(600);

/// What a command that has noticed gets to write its results in: a disk under load may take seconds.
const ENDING: Duration = Duration::from_secs(10);

/// Resolves when the user wants the command to end.
#[derive(Clone, Debug)]
pub(super) struct Interrupt {
    /// The signal's number, once there was one.
    heard: watch::Receiver<Option<u8>>,
    noticed: Arc<AtomicBool>,
}

impl Interrupt {
    /// From here on the signals are ours. Once every clone is dropped, nobody listens, and a signal ends the process at once.
    pub(super) fn watch() -> Result<Self, Failure> {
        let (tell, heard) = watch::channel(None);
        let noticed = Arc::new(AtomicBool::new(false));
        let failed = |cause| Failure::System { what: "watch for signals", cause };
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(failed)?;
        let mut signals = {
            let _entered = runtime.enter();
            Signals::take()?
        };
        let thread = std::thread::Builder::new().name("signals".to_owned());
        let is_noticed = Arc::clone(&noticed);
        let watching = move || {
            runtime.block_on(async {
                let signal = signals.next().await;
                if tell.receiver_count() > 0 {
                    let _ = tell.send(Some(signal));
                    rest(UNNOTICED).await;
                    if is_noticed.load(Ordering::Acquire) {
                        rest(ENDING).await;
                    }
                }
                rowscan_files::remove_leftovers();
                std::process::exit(i32::from(128 + signal));
            });
        };
        thread.spawn(watching).map_err(failed)?;
        Ok(Self { heard, noticed })
    }

    /// Waits for a signal. Cancel safe.
    pub(super) async fn wait(&mut self) {
        self.signal().await;
    }

    /// Waits for a signal and gives its number. Cancel safe.
    pub(super) async fn signal(&mut self) -> u8 {
        let heard = self.heard.wait_for(Option::is_some).await.ok().and_then(|heard| *heard);
        match heard {
            Some(signal) => {
                self.noticed.store(true, Ordering::Release);
                signal
            }
            // Its thread is gone, which ends with the process only.
            None => std::future::pending().await,
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

/// The signals that end a command.
struct Signals {
    #[cfg(unix)]
    terminate: tokio::signal::unix::Signal,
    #[cfg(unix)]
    interrupt: tokio::signal::unix::Signal,
    #[cfg(unix)]
    hang_up: tokio::signal::unix::Signal,
}

impl Signals {
    #[cfg(unix)]
    fn take() -> Result<Self, Failure> {
        use tokio::signal::unix::{SignalKind, signal};
        let take = |kind| signal(kind).map_err(|cause| Failure::System { what: "watch for signals", cause });
        Ok(Self {
            terminate: take(SignalKind::terminate())?,
            interrupt: take(SignalKind::interrupt())?,
            hang_up: take(SignalKind::hangup())?,
        })
    }

    #[cfg(not(unix))]
    fn take() -> Result<Self, Failure> {
        Ok(Self {})
    }

    /// The number of the next one.
    async fn next(&mut self) -> u8 {
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
