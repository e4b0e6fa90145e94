//! Faults of a bus.

use std::sync::Arc;
use std::time::Duration;

use rowscan_bus::CanFrame;
use rowscan_bus::tractor::TractorEcu;
use rowscan_bus::troubles::{Carried, Speaker, Troubles};
use rowscan_fault_table::PartFault;
use rowscan_fault_table::bus::BusFault;
use rowscan_faults::{Fit, Order, Part};
use rowscan_protocol::time::SimTime;
use tokio::sync::Notify;

use super::orders::Orders;

/// What begins, or ends where there is no fault.
type BusOrder = (u64, Option<BusFault>);

/// What the plan orders of one bus.
#[derive(Debug)]
struct BusPart(Orders<BusOrder>);

impl Part for BusPart {
    fn fits(&self, fault: &PartFault) -> Fit {
        if matches!(fault, PartFault::Bus(_)) { Fit::Acts } else { Fit::Foreign }
    }

    fn begin(&self, order: &Order<'_>) {
        if let PartFault::Bus(fault) = order.fault {
            self.0.push(SimTime::ZERO + order.at, (order.key, Some(*fault)));
        }
    }

    fn end(&self, key: u64, at: Duration) {
        self.0.push(SimTime::ZERO + at, (key, None));
    }
}

/// The faults of one bus.
#[derive(Debug)]
pub(crate) struct BusFaults {
    part: Arc<BusPart>,
    troubles: Troubles,
}

impl BusFaults {
    pub(crate) fn new(changed: &Arc<Notify>) -> Self {
        Self { part: Arc::new(BusPart(Orders::new(changed))), troubles: Troubles::default() }
    }

    /// What the plan knows it by.
    pub(crate) fn part(&self) -> Arc<dyn Part> {
        Arc::clone(&self.part) as Arc<dyn Part>
    }

    pub(crate) fn next(&self) -> Option<SimTime> {
        [self.part.0.next(), self.troubles.next()].into_iter().flatten().min()
    }

    /// Does what is due by `now`.
    pub(crate) fn act(&mut self, now: SimTime, ecu: &mut TractorEcu) -> Vec<Carried> {
        let mut out = Vec::new();
        while let Some((at, (key, fault))) = self.part.0.take(now) {
            out.extend(match fault {
                Some(fault) => self.troubles.begin(key, fault, at, ecu),
                None => self.troubles.end(key, at, ecu),
            });
        }
        if self.troubles.next().is_some_and(|due| due <= now) {
            out.extend(self.troubles.poll(now, ecu));
        }
        out
    }

    /// What of `said` passes, and what comes of it.
    pub(crate) fn carry(
        &mut self,
        at: SimTime,
        ecu: &mut TractorEcu,
        said: Vec<(Speaker, CanFrame)>,
    ) -> Vec<Carried> {
        self.troubles.carry(at, ecu, said)
    }
}
