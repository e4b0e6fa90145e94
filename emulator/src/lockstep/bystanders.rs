//! Ports whose peers look on and take no part: nobody waits for whoever controls the run.

use std::net::SocketAddr;
use std::sync::{Arc, Mutex, PoisonError};

/// Ports of this program whose connections count for nothing in lockstep. Clones share them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bystanders(Arc<Mutex<Vec<u16>>>);

impl Bystanders {
    pub(crate) fn add(&self, address: SocketAddr) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(address.port());
    }

    /// Whether this end of a connection is one of them.
    pub(super) fn has(&self, here: SocketAddr) -> bool {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).contains(&here.port())
    }
}
