//! Long work off the runtime's threads, so that signals and sockets go on being served.

use std::io;
use std::sync::{Arc, Mutex, PoisonError};

use super::Failure;

/// Runs `work` on a thread of its own; `what` says in an error what could not be done.
pub(super) async fn off_runtime<T, E>(
    what: &'static str,
    work: impl FnOnce() -> Result<T, E> + Send + 'static,
) -> Result<T, Failure>
where
    T: Send + 'static,
    E: Send + 'static,
    Failure: From<E>,
{
    let done = Arc::new(Mutex::new(None));
    let place = Arc::clone(&done);
    on_a_thread(Box::new(move || *place.lock().unwrap_or_else(PoisonError::into_inner) = Some(work())))
        .await
        .map_err(|cause| Failure::System { what, cause })?;
    let done = done.lock().unwrap_or_else(PoisonError::into_inner).take();
    done.map_or_else(
        || Err(Failure::System { what, cause: io::Error::other("it left no result") }),
        |done| Ok(done?),
    )
}

/// Compiled once for all work.
async fn on_a_thread(work: Box<dyn FnOnce() + Send>) -> io::Result<()> {
    tokio::task::spawn_blocking(work).await.map_err(io::Error::other)
}
