//! Work as a runtime gets it.

use std::future::Future;
use std::pin::Pin;

/// Work of any kind.
pub type Task<T = ()> = Pin<Box<dyn Future<Output = T> + Send>>;

/// Work to be spawned. The runtime has a hundred functions for every type of future that it is given, in every crate that gives one; these are of one type.
pub fn task<T>(work: impl Future<Output = T> + Send + 'static) -> Task<T> {
    Box::pin(work)
}
