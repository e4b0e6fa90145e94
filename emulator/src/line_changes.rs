//! Digital lines of a scanner that are switched at given instants.

use std::sync::Arc;

use rowscan_protocol::device::{Device, DigitalLineError};
use rowscan_protocol::time::SimTime;

use crate::scanner::Shared;

/// A digital line that is switched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LineChange {
    /// When.
    pub at: SimTime,
    /// An output; else an input.
    pub output: bool,
    /// Which, from 1.
    pub number: u8,
    /// On; else off.
    pub on: bool,
}

impl LineChange {
    /// Switches it on `device`.
    pub fn apply(&self, device: &mut Device) -> Result<(), DigitalLineError> {
        match self.output {
            true => device.set_output(self.at, self.number, self.on),
            false => device.set_input(self.at, self.number, self.on),
        }
    }
}

/// The changes of one scanner that are still to come, the latest first.
#[derive(Debug)]
pub(crate) struct LineChanges {
    shared: Arc<Shared>,
    pending: Vec<LineChange>,
}

impl LineChanges {
    pub(crate) fn new(shared: Arc<Shared>, mut pending: Vec<LineChange>) -> Self {
        // Stable, so that changes of one instant keep their order.
        pending.reverse();
        pending.sort_by_key(|change| std::cmp::Reverse(change.at));
        Self { shared, pending }
    }

    pub(crate) fn next(&self) -> Option<SimTime> {
        self.pending.last().map(|change| change.at)
    }

    pub(crate) fn fire(&mut self, at: SimTime) -> bool {
        while let Some(change) = self.pending.pop_if(|change| change.at <= at) {
            let mut device = self.shared.device();
            if let Err(cause) = change.apply(&mut device) {
                tracing::warn!(%cause, "line not switched");
            }
            self.shared.spread(&device);
        }
        false
    }
}
