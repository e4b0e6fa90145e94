//! Faults of a bus.

use std::sync::Arc;
use std::time::Duration;

use rowscan_bus::tractor::TractorEcu;
use rowscan_bus::troubles::{Carried, Speaker, Troubles};
use rowscan_bus::{CanFrame, Datagrams};
use rowscan_faults::{Fit, Order, Part};
use rowscan_protocol::time::SimTime;
use rowscan_settings::fault_table::PartFault;
use rowscan_settings::fault_table::bus::BusFault;
use tokio::sync::Notify;

use super::orders::Orders;

/// What begins, or ends where there is no fault.
type BusOrder = (u64, Option<BusFault>);

/// What the plan orders of one bus.
#[derive(Debug)]
struct BusPart {
    orders: Orders<BusOrder>,
    /// What becomes of what it sends as datagrams, if it does.
    datagrams: Option<Datagrams>,
}

impl Part for BusPart {
    fn fits(&self, fault: &PartFault) -> Fit {
        match fault {
            PartFault::Bus(_) => Fit::Acts,
            PartFault::Datagrams(fault) if fault.fate.needs_a_scanner() => Fit::Foreign,
            PartFault::Datagrams(_) if self.datagrams.is_some() => Fit::Acts,
            _ => Fit::Foreign,
        }
    }

    fn begin(&self, order: &Order<'_>) {
        match (order.fault, &self.datagrams) {
            (PartFault::Bus(fault), _) => {
                self.orders.push(SimTime::ZERO + order.at, (order.key, Some(*fault)));
            }
            (PartFault::Datagrams(fault), Some(datagrams)) => {
                datagrams.begin(order.key, *fault, order.p, order.seed);
            }
            _ => {}
        }
    }

    fn end(&self, key: u64, at: Duration) {
        if let Some(datagrams) = &self.datagrams {
            datagrams.end(key);
        }
        self.orders.push(SimTime::ZERO + at, (key, None));
    }
}

/// The faults of one bus.
#[derive(Debug)]
pub(crate) struct BusFaults {
    part: Arc<BusPart>,
    troubles: Troubles,
}

impl BusFaults {
    pub(crate) fn new(changed: &Arc<Notify>, datagrams: Option<Datagrams>) -> Self {
        let part = BusPart { orders: Orders::new(changed), datagrams };
        Self { part: Arc::new(part), troubles: Troubles::default() }
    }

    /// What the plan knows it by.
    pub(crate) fn part(&self) -> Arc<dyn Part> {
        Arc::clone(&self.part) as Arc<dyn Part>
    }

    pub(crate) fn next(&self) -> Option<SimTime> {
        [self.part.orders.next(), self.troubles.next()].into_iter().flatten().min()
    }

    /// Does what is due by `now`.
    pub(crate) fn act(&mut self, now: SimTime, ecu: &mut TractorEcu) -> Vec<Carried> {
        let mut out = Vec::new();
        while let Some((at, (key, fault))) = self.part.orders.take(now) {
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
