//! Finds the scans in a device's bytes.

use rowscan_protocol::client::{Client, Event};
use rowscan_protocol::scan::Scan;
use std::time::Duration;

/// The largest payload that is taken for one: twice that of the largest scan telegram in text.
pub(crate) const MAX_PAYLOAD: usize = 64 * 1024;

/// A client that only listens.
#[derive(Debug)]
pub(crate) struct ScanWatch(Client);

impl Default for ScanWatch {
    fn default() -> Self {
        Self(Client::listen(MAX_PAYLOAD))
    }
}

impl ScanWatch {
    /// Takes the device's next bytes.
    pub(crate) fn push(&mut self, bytes: &[u8]) {
        self.0.handle_bytes(Duration::ZERO, bytes);
    }

    /// The next scan that is complete.
    pub(crate) fn next_scan(&mut self) -> Option<&Scan> {
        loop {
            match self.0.poll_event()? {
                Event::Scan => return Some(self.0.scan()),
                _ => continue,
            }
        }
    }
}
