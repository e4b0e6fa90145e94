//! The plan of faults on the timeline: it begins and ends them at their instants, before anything else acts.

use std::sync::Arc;

use rowscan_faults::FaultControl;
use rowscan_protocol::time::SimTime;

use crate::shared::Shared;

/// The plan, and the CoLa scanners that it acts on. An LMS2xx and a bus obey by themselves.
#[derive(Debug)]
pub(crate) struct FaultSource {
    control: FaultControl,
    scanners: Vec<Arc<Shared>>,
}

impl FaultSource {
    pub(crate) fn new(control: FaultControl) -> Self {
        Self { control, scanners: Vec::new() }
    }

    pub(crate) fn control(&self) -> &FaultControl {
        &self.control
    }

    pub(crate) fn add(&mut self, shared: Arc<Shared>) {
        self.scanners.push(shared);
    }

    pub(crate) fn next(&self) -> Option<SimTime> {
        let plan = self.control.next_due().map(|at| SimTime::ZERO + at);
        let orders = self.scanners.iter().filter_map(|shared| shared.next_change());
        orders.chain(plan).min()
    }

    /// Nothing of this is sent to anyone.
    pub(crate) fn fire(&self, at: SimTime) -> bool {
        self.control.advance_to(at.elapsed());
        self.scanners.iter().for_each(|shared| shared.change(at));
        false
    }
}
