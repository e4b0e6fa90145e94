//! Digital lines of a scanner that are switched at given instants.

use std::sync::Arc;

use rowscan_protocol::time::SimTime;

use crate::line_change::LineChange;
use crate::shared::Shared;

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
