//! Holds the start of a drive until somebody lets it go.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use tokio::sync::Notify;

/// Keeps a rig's drive from starting, whoever takes scans, until [`Hold::release`].
#[derive(Clone, Debug)]
pub struct Hold {
    released: Arc<AtomicBool>,
    changed: Arc<Notify>,
}

impl Hold {
    pub(crate) fn new(changed: Arc<Notify>) -> Self {
        Self { released: Arc::default(), changed }
    }

    /// Lets the drive start.
    pub fn release(&self) {
        self.released.store(true, Ordering::Release);
        self.changed.notify_one();
    }

    pub(crate) fn is_released(&self) -> bool {
        self.released.load(Ordering::Acquire)
    }
}
