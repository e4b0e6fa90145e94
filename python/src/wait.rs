//! Long calls: off the interpreter's lock, and interrupted by Ctrl-C. The one file that waits by the host's clock.

use std::io;
use std::pin::Pin;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use pyo3::prelude::*;
use tokio::runtime::{Builder, Handle};
use tokio::sync::oneshot;

use crate::failure::{Failure, Refusal};

/// How often signals are looked at. A call that is done returns at once.
const LOOK_EVERY: Duration = Duration::from_millis(50);

/// How long a device is given to end its stream.
pub(crate) const STOP_TIMEOUT: Duration = Duration::from_secs(2);

/// Runs `work` on a thread of its own. Interrupted, it is left to itself: its result is dropped.
pub(crate) fn for_work<T: Send + 'static>(
    py: Python<'_>,
    what: &'static str,
    work: impl FnOnce() -> Result<T, Failure> + Send + 'static,
) -> PyResult<T> {
    let (done, mut finished) = mpsc::sync_channel(1);
    let spawned = thread::Builder::new().name("rowscan".to_owned()).spawn(move || {
        // Nobody waits any more if it was interrupted.
        let _ = done.send(work());
    });
    spawned.map_err(|cause| Refusal::System { what, cause })?;
    loop {
        let (outcome, back) = py.detach(move || {
            let outcome = finished.recv_timeout(LOOK_EVERY);
            (outcome, finished)
        });
        finished = back;
        match outcome {
            Ok(outcome) => return Ok(outcome?),
            Err(RecvTimeoutError::Timeout) => py.check_signals()?,
            Err(RecvTimeoutError::Disconnected) => {
                let cause = io::Error::other("it ended without a result");
                return Err(Refusal::System { what, cause }.into());
            }
        }
    }
}

/// Runs a future on a thread of its own, with a runtime of its own. Interrupted, it is dropped.
pub(crate) fn for_future<T, F>(
    py: Python<'_>,
    what: &'static str,
    make: impl FnOnce() -> F + Send + 'static,
) -> PyResult<T>
where
    T: Send + 'static,
    F: Future<Output = Result<T, Failure>> + 'static,
{
    for_future_by(py, what, make, move |task| {
        let runtime = Builder::new_current_thread().enable_all().build();
        let runtime = runtime.map_err(|cause| Refusal::System { what, cause })?;
        runtime.block_on(task)
    })
}

/// The same on a runtime that runs already.
pub(crate) fn for_future_on<T, F>(
    py: Python<'_>,
    what: &'static str,
    runtime: Handle,
    make: impl FnOnce() -> F + Send + 'static,
) -> PyResult<T>
where
    T: Send + 'static,
    F: Future<Output = Result<T, Failure>> + 'static,
{
    for_future_by(py, what, make, move |task| runtime.block_on(task))
}

/// Runs a future on a thread of its own, by `block_on`. Interrupted, it is dropped.
fn for_future_by<T, F>(
    py: Python<'_>,
    what: &'static str,
    make: impl FnOnce() -> F + Send + 'static,
    block_on: impl FnOnce(Pin<Box<dyn Future<Output = Result<T, Failure>>>>) -> Result<T, Failure>
    + Send
    + 'static,
) -> PyResult<T>
where
    T: Send + 'static,
    F: Future<Output = Result<T, Failure>> + 'static,
{
    let (kept, interrupted) = oneshot::channel();
    let done = for_work(py, what, move || block_on(Box::pin(unless(interrupted, make()))));
    drop(kept);
    done
}

/// The future's result, unless whoever waits for it goes away.
async fn unless<T>(
    interrupted: oneshot::Receiver<()>,
    future: impl Future<Output = Result<T, Failure>>,
) -> Result<T, Failure> {
    tokio::select! {
        outcome = future => outcome,
        _ = interrupted => Err(Failure::Interrupted),
    }
}

/// The future's result, if it comes within `patience`; with none it is waited for.
pub(crate) async fn within<T>(patience: Option<Duration>, future: impl Future<Output = T>) -> Option<T> {
    match patience {
        Some(patience) => tokio::time::timeout(patience, future).await.ok(),
        None => Some(future.await),
    }
}
