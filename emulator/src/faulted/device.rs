//! Faults of a scanner and its clock.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use rowscan_bus::Datagrams;
use rowscan_faults::{Fit, Order, Part};
use rowscan_protocol::device::{self, Device, LeftBehind, RefusedWith, Trouble};
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::lms2xx;
use rowscan_protocol::model::Model;
use rowscan_protocol::time::SimTime;
use rowscan_settings::fault_table::PartFault;
use rowscan_settings::fault_table::clock::ClockFault;
use rowscan_settings::fault_table::device::{
    Answer, Broken, DeviceFault, Dirt, Piece, Power, Refusal, RestFault, Stored,
};
use tokio::sync::Notify;

use super::fits::{FaultyScanner, fits, lms2xx_rate};
use super::orders::Orders;

/// Microseconds a second.
const MICROS: f64 = 1e6;

/// What is done to a device at an instant.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Change {
    PowerOff(u64),
    PowerOn(u64),
    Begin(u64, Trouble),
    End(u64),
    Drift(f64),
    Step(i64),
    /// The clock is to wrap at this instant.
    Wrap(SimTime),
    Leave(Stored),
}

/// The faults of one scanner.
#[derive(Debug)]
pub(crate) struct DeviceFaults {
    scanner: FaultyScanner,
    orders: Orders<Change>,
    active: Mutex<Vec<(u64, PartFault)>>,
    /// The clock's wrap is set already.
    foreseen: AtomicBool,
    /// What becomes of its datagrams, where it sends any: then it has REST as well.
    datagrams: Option<Datagrams>,
}

impl DeviceFaults {
    pub(crate) fn cola(changed: &Arc<Notify>, model: &'static Model) -> Arc<Self> {
        Self::of(FaultyScanner::Cola(model), changed)
    }

    pub(crate) fn lms2xx(changed: &Arc<Notify>) -> Arc<Self> {
        Self::of(FaultyScanner::Lms2xx, changed)
    }

    /// What becomes of its datagrams, where it sends any.
    pub(crate) fn datagrams(&self) -> Option<&Datagrams> {
        self.datagrams.as_ref()
    }

    fn of(scanner: FaultyScanner, changed: &Arc<Notify>) -> Arc<Self> {
        Arc::new(Self {
            scanner,
            orders: Orders::new(changed),
            active: Mutex::default(),
            foreseen: AtomicBool::new(false),
            datagrams: scanner.sends_datagrams().then(Datagrams::default),
        })
    }

    /// When there is something to do next.
    pub(crate) fn next(&self) -> Option<SimTime> {
        self.orders.next()
    }

    /// Does to a CoLa scanner what is due by `now`.
    pub(crate) fn act_on(&self, device: &mut Device, now: SimTime) {
        while let Some((at, change)) = self.orders.take(now) {
            match change {
                Change::PowerOff(_) => device.power_off(),
                Change::PowerOn(_) => device.power_on(at),
                Change::Begin(key, trouble) => device.begin_trouble(key, trouble),
                Change::End(key) => drop(device.end_trouble(key)),
                Change::Drift(ppm) => device.drift_clock(at, ppm),
                Change::Step(us) => device.step_clock(us),
                Change::Wrap(when) => device.wrap_clock(when),
                Change::Leave(stored) => device.leave_as(left_behind(stored)),
            }
        }
    }

    /// Does to an LMS2xx what is due by `now`; true if its supply has gone.
    pub(crate) fn act_on_lms2xx(&self, device: &mut lms2xx::device::Device, now: SimTime) -> bool {
        let mut off = false;
        while let Some((at, change)) = self.orders.take(now) {
            match change {
                Change::PowerOff(_) => {
                    device.power_off();
                    off = true;
                }
                Change::PowerOn(_) => device.power_on(at),
                Change::Begin(_, Trouble::Dirt { level, .. }) => device.soil(level),
                Change::End(_) => device.soil(0),
                Change::Leave(stored) => device.leave_as(rate(stored), stored.streaming),
                // Refused when they were added.
                Change::Begin(..) | Change::Drift(_) | Change::Step(_) | Change::Wrap(_) => {}
            }
        }
        off
    }

    fn begin_power(&self, key: u64, at: SimTime, power: &Power) {
        let (off, on) = power.outage();
        self.orders.push(at + off, Change::PowerOff(key));
        if let Some(on) = on {
            self.orders.push(at + on, Change::PowerOn(key));
        }
    }

    fn end_power(&self, key: u64, at: SimTime) {
        // It never went off, or is back already, unless its return is still to come or was never fixed.
        let never = self.orders.retract(|change| *change == Change::PowerOff(key));
        let was_to_return = self.orders.retract(|change| *change == Change::PowerOn(key));
        let open_end = self.take(key).is_some_and(|fault| match fault {
            PartFault::Device(DeviceFault::Power(power)) => power.outage().1.is_none(),
            _ => false,
        });
        if !never && (was_to_return || open_end) {
            self.orders.push(at, Change::PowerOn(key));
        }
    }

    fn begin_dirt(&self, key: u64, at: SimTime, dirt: Dirt) {
        let Dirt { level, sector_deg, ramp } = dirt;
        let first = if ramp.is_zero() { level } else { 1 };
        for step in first..=level {
            let later = ramp.mul_f64(f64::from(step) / f64::from(level.max(1)));
            if step > first {
                self.orders.push(at + later, Change::End(key));
            }
            let later = if ramp.is_zero() { Duration::ZERO } else { later };
            self.orders.push(at + later, Change::Begin(key, Trouble::Dirt { level: step, sector_deg }));
        }
    }

    fn begin_clock(&self, at: SimTime, fault: ClockFault) {
        let change = match fault {
            ClockFault::Drift { ppm } => Change::Drift(ppm),
            ClockFault::Step { s } => Change::Step((s * MICROS) as i64),
            ClockFault::Wrap => Change::Wrap(at),
        };
        self.orders.push(at, change);
    }

    fn take(&self, key: u64) -> Option<PartFault> {
        let mut active = self.active.lock().unwrap_or_else(PoisonError::into_inner);
        let number = active.iter().position(|(other, _)| *other == key)?;
        Some(active.remove(number).1)
    }

    fn remember(&self, key: u64, fault: &PartFault) {
        self.active.lock().unwrap_or_else(PoisonError::into_inner).push((key, fault.clone()));
    }
}

impl Part for DeviceFaults {
    fn fits(&self, fault: &PartFault) -> Fit {
        fits(self.scanner, fault)
    }

    fn begin(&self, order: &Order<'_>) {
        let (key, at) = (order.key, SimTime::ZERO + order.at);
        self.remember(key, order.fault);
        match order.fault {
            PartFault::Datagrams(fault) => {
                if let Some(datagrams) = &self.datagrams {
                    datagrams.begin(key, *fault, order.p, order.seed);
                }
            }
            PartFault::Device(DeviceFault::Rest(fault)) => {
                self.orders.push(at, Change::Begin(key, rest_trouble(*fault)));
            }
            PartFault::Device(DeviceFault::Power(power)) => self.begin_power(key, at, power),
            PartFault::Device(DeviceFault::Dirt(dirt)) => self.begin_dirt(key, at, *dirt),
            PartFault::Device(DeviceFault::Broken(broken)) => {
                self.orders.push(at, Change::Begin(key, failure(*broken)));
            }
            PartFault::Device(DeviceFault::Refusal(refused)) => {
                self.orders.push(at, Change::Begin(key, refusal(refused)));
            }
            PartFault::Device(DeviceFault::Stored(stored)) => self.orders.push(at, Change::Leave(*stored)),
            PartFault::Clock(ClockFault::Wrap) if self.foreseen.swap(false, Ordering::Relaxed) => {}
            PartFault::Clock(fault) => self.begin_clock(at, *fault),
            _ => {}
        }
    }

    fn foresee(&self, fault: &PartFault, now: Duration, at: Duration) {
        if matches!(fault, PartFault::Clock(ClockFault::Wrap)) {
            self.foreseen.store(true, Ordering::Relaxed);
            self.orders.push(SimTime::ZERO + now, Change::Wrap(SimTime::ZERO + at));
        }
    }

    fn end(&self, key: u64, at: Duration) {
        if let Some(datagrams) = &self.datagrams {
            datagrams.end(key);
        }
        let at = SimTime::ZERO + at;
        let active = self.active.lock().unwrap_or_else(PoisonError::into_inner);
        let fault = active.iter().find(|(other, _)| *other == key).map(|(_, fault)| fault.clone());
        drop(active);
        match fault {
            Some(PartFault::Device(DeviceFault::Power(_))) => self.end_power(key, at),
            Some(PartFault::Device(DeviceFault::Stored(_)) | PartFault::Clock(ClockFault::Wrap)) => {}
            Some(PartFault::Clock(ClockFault::Drift { ppm })) => self.orders.push(at, Change::Drift(-ppm)),
            Some(PartFault::Clock(ClockFault::Step { s })) => {
                self.orders.push(at, Change::Step((-s * MICROS) as i64));
            }
            Some(PartFault::Device(_)) => {
                let is_its = |change: &Change| matches!(change, Change::Begin(other, _) | Change::End(other) if *other == key);
                self.orders.retract(is_its);
                self.orders.push(at, Change::End(key));
            }
            _ => {}
        }
        self.take(key);
    }
}

fn rate(stored: Stored) -> Option<lms2xx::Rate> {
    stored.rate.and_then(lms2xx_rate)
}

fn failure(broken: Broken) -> Trouble {
    let part = match broken.part {
        Piece::Motor => device::Part::Motor,
        Piece::Laser => device::Part::Laser,
        Piece::Temperature => device::Part::Temperature,
    };
    Trouble::Failure { part, until_reboot: broken.until_reboot }
}

fn refusal(refused: &Refusal) -> Trouble {
    let answer = match refused.answer {
        Answer::Code(code) => RefusedWith::Code(code),
        Answer::Declined => RefusedWith::Zero,
    };
    Trouble::Refusal { command: refused.command.clone(), answer, busy: refused.busy }
}

fn rest_trouble(fault: RestFault) -> Trouble {
    Trouble::Rest(match fault {
        RestFault::StaleNonces => device::RestTrouble::StaleNonces,
        RestFault::TooMany => device::RestTrouble::TooMany,
    })
}

fn left_behind(stored: Stored) -> LeftBehind {
    let dialect = stored.dialect.map(|dialect| if dialect == 'a' { Dialect::A } else { Dialect::B });
    LeftBehind { dialect, other_scan_data: stored.config, stopped: stored.other_client }
}
