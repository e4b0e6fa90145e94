//! Long work off the runtime's threads, so that signals and sockets go on being served.

use std::io;

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
    match tokio::task::spawn_blocking(work).await {
        Ok(done) => Ok(done?),
        Err(cause) => Err(Failure::System { what, cause: io::Error::other(cause) }),
    }
}
