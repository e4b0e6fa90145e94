//! Faults of the tractor and what is on it. They are functions of the instant, so nothing has to wait for them.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use rowscan_bus::Datagrams;
use rowscan_faults::{FaultControl, Fit, Order, Part};
use rowscan_protocol::time::SimTime;
use rowscan_settings::fault_table::PartFault;
use rowscan_vehicle::{Tractor, VehicleFault};

/// Which of the tractor's parts anyone can see.
#[derive(Clone, Debug, Default)]
pub(crate) struct Receivers {
    /// A scanner with an encoder input.
    pub(crate) encoder: Arc<AtomicBool>,
    /// Somebody who tells positions.
    pub(crate) gnss: Arc<AtomicBool>,
    /// Sentences that go out as datagrams.
    pub(crate) sends_datagrams: Arc<AtomicBool>,
    /// What becomes of those.
    pub(crate) datagrams: Datagrams,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Drive,
    Encoder,
    Gnss,
}

/// A part of the tractor.
#[derive(Debug)]
pub(crate) struct VehiclePart {
    tractor: Tractor,
    kind: Kind,
    seen: Arc<AtomicBool>,
    receivers: Receivers,
}

impl VehiclePart {
    /// Names the tractor's parts.
    pub(crate) fn name_all(control: &FaultControl, tractor: &Tractor, receivers: &Receivers) {
        let parts = [
            ("tractor", Kind::Drive, Arc::new(AtomicBool::new(true))),
            ("encoder", Kind::Encoder, Arc::clone(&receivers.encoder)),
            ("gnss", Kind::Gnss, Arc::clone(&receivers.gnss)),
        ];
        for (name, kind, seen) in parts {
            control.part(
                name,
                Arc::new(Self { tractor: tractor.clone(), kind, seen, receivers: receivers.clone() }),
            );
        }
    }

    fn fault(&self, fault: &PartFault) -> Option<VehicleFault> {
        match (self.kind, fault) {
            (Kind::Drive, PartFault::Drive(fault)) => Some(VehicleFault::Drive(*fault)),
            (Kind::Encoder, PartFault::Encoder(fault)) => Some(VehicleFault::Encoder(*fault)),
            (Kind::Gnss, PartFault::Gnss(fault)) => Some(VehicleFault::Gnss(*fault)),
            _ => None,
        }
    }
}

impl Part for VehiclePart {
    fn fits(&self, fault: &PartFault) -> Fit {
        if let (PartFault::Datagrams(fault), Kind::Gnss) = (fault, self.kind) {
            if fault.fate.needs_a_scanner() {
                return Fit::Foreign;
            }
            let sends = self.receivers.sends_datagrams.load(Ordering::Relaxed);
            return if sends { Fit::Acts } else { Fit::Foreign };
        }
        match (self.fault(fault), self.seen.load(Ordering::Relaxed), self.kind) {
            (None, ..) => Fit::Foreign,
            (Some(_), true, _) => Fit::Acts,
            (Some(_), false, Kind::Encoder) => {
                Fit::Refuses("no scanner here has an encoder input: an LMS2xx has none".to_owned())
            }
            (Some(_), false, _) => Fit::Refuses(
                "nothing here tells positions; add GNSS sentences or a CAN bus (`--nmea`, `--can`)"
                    .to_owned(),
            ),
        }
    }

    fn begin(&self, order: &Order<'_>) {
        if let (Kind::Gnss, PartFault::Datagrams(fault)) = (self.kind, order.fault) {
            self.receivers.datagrams.begin(order.key, *fault, order.p, order.seed);
        }
        if let Some(fault) = self.fault(order.fault) {
            self.tractor.begin_fault(order.key, fault, SimTime::ZERO + order.at);
        }
    }

    fn end(&self, key: u64, at: Duration) {
        self.receivers.datagrams.end(key);
        self.tractor.end_fault(key, SimTime::ZERO + at);
    }
}
