//! The tractor: shared by scanners, encoder, GNSS and CAN, each of which samples it at its own simulated instants.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rowscan_protocol::time::SimTime;
use rowscan_settings::fault_table::vehicle::DriveFault;

use crate::encoder::Encoder;
use crate::faults::{Counting, Report, Reporting, Swaying, VehicleFault};
use crate::gnss::Receiver;
use crate::nozzles::Nozzles;
use crate::trajectory::{Motion, Trajectory};

/// A shared tractor. It stands at its start until something starts it; from then on it is a function of simulated time and of the
/// commands it received.
#[derive(Clone, Debug)]
pub struct Tractor(Arc<Mutex<Driven>>);

#[derive(Debug)]
struct Driven {
    trajectory: Trajectory,
    began: Option<SimTime>,
    counting: Counting,
    reporting: Reporting,
    swaying: Swaying,
    nozzles: Nozzles,
    /// What leaves the nozzles of its boom, as shares of full flow.
    flows: Nozzles,
}

impl Driven {
    /// Seconds driven at `at`; before it began, none.
    fn driven_s(&self, at: SimTime) -> Option<f64> {
        let began = self.began?;
        (at >= began).then(|| Duration::from_nanos(at.0 - began.0).as_secs_f64())
    }

    fn motion(&self, at: SimTime) -> Motion {
        let motion = match self.driven_s(at) {
            Some(t_s) => self.trajectory.at(t_s),
            None => {
                let start = self.trajectory.at(0.0);
                Motion { speed_m_s: 0.0, wheel_speed_m_s: 0.0, ..start }
            }
        };
        let sway = self.swaying.at(at);
        let (mut place, heading) = (motion.place, motion.place.heading_rad);
        if sway.right_m != 0.0 {
            place.x_m += sway.right_m * libm::cos(heading);
            place.y_m -= sway.right_m * libm::sin(heading);
        }
        Motion {
            place,
            right_m: sway.right_m,
            up_m: motion.up_m + sway.up_m,
            roll_rad: motion.roll_rad + sway.roll_rad,
            ..motion
        }
    }
}

impl Tractor {
    /// At its start, standing.
    pub fn new(trajectory: Trajectory) -> Self {
        Self(Arc::new(Mutex::new(Driven {
            trajectory,
            began: None,
            counting: Counting::default(),
            reporting: Reporting::default(),
            swaying: Swaying::default(),
            nozzles: Nozzles::default(),
            flows: Nozzles::default(),
        })))
    }

    /// Starts it at `at`, unless it has started.
    pub fn begin(&self, at: SimTime) {
        self.lock().began.get_or_insert(at);
    }

    /// When it was set going; none while it stands at its start.
    pub fn began(&self) -> Option<SimTime> {
        self.lock().began
    }

    /// Where it is at `at`, and how fast.
    pub fn motion(&self, at: SimTime) -> Motion {
        self.lock().motion(at)
    }

    /// The ticks that `encoder` on its wheel has given by `at`, as far as it counts them.
    pub fn encoder_ticks(&self, encoder: &Encoder, at: SimTime) -> f64 {
        let driven = self.lock();
        let wheel_m = driven.motion(at).wheel_m;
        let ticks = |wheel_m| encoder.ticks(wheel_m);
        ticks(driven.counting.counted_m(at, wheel_m)) + driven.counting.wrapped(at, ticks)
    }

    /// What `receiver` on its roof tells at `at`.
    pub fn report(&self, receiver: &Receiver, at: SimTime) -> Report {
        let driven = self.lock();
        driven.reporting.report(receiver, at, |when| driven.motion(when))
    }

    /// A fault begins; before the drive, it is there when that begins.
    pub fn begin_fault(&self, key: u64, fault: VehicleFault, at: SimTime) {
        let mut driven = self.lock();
        let wheel_m = driven.motion(at).wheel_m;
        let t_s = driven.driven_s(at).unwrap_or(0.0);
        match fault {
            VehicleFault::Encoder(fault) => driven.counting.begin(key, fault, at, wheel_m),
            VehicleFault::Gnss(fault) => driven.reporting.begin(key, fault, at),
            VehicleFault::Drive(DriveFault::Speed { m_s, change_m_s2 }) => {
                driven.trajectory.detour(key, t_s, m_s, change_m_s2);
            }
            VehicleFault::Drive(fault) => driven.swaying.begin(key, fault, at),
        }
    }

    /// The fault of this key is over.
    pub fn end_fault(&self, key: u64, at: SimTime) {
        let mut driven = self.lock();
        let wheel_m = driven.motion(at).wheel_m;
        let t_s = driven.driven_s(at).unwrap_or(0.0);
        let Driven { trajectory, counting, reporting, swaying, .. } = &mut *driven;
        let _ = counting.end(key, at, wheel_m)
            || reporting.end(key, at)
            || swaying.end(key, at)
            || trajectory.rejoin(key, t_s);
    }

    /// How long it will have driven when it has come to this Y, as far as its drive is known now; none if that takes longer than an hour.
    pub fn drives_to(&self, y_m: f64) -> Option<Duration> {
        self.drives_within(y_m, 3600)
    }

    /// The same; none if that takes longer than so many seconds.
    pub fn drives_within(&self, y_m: f64, longest_s: u32) -> Option<Duration> {
        let driven = self.lock();
        let there = |t_s: f64| driven.trajectory.at(t_s).place.y_m >= y_m;
        let until_s = (0..=longest_s).map(f64::from).find(|t_s| there(*t_s))?;
        let (mut from_s, mut until_s) = ((until_s - 1.0).max(0.0), until_s);
        // To a microsecond.
        while until_s - from_s > 1e-6 {
            let middle_s = from_s.midpoint(until_s);
            if there(middle_s) { until_s = middle_s } else { from_s = middle_s }
        }
        Some(Duration::from_secs_f64(until_s))
    }

    /// Accelerates to `speed_m_s` from `at` on; starts it if it stands.
    pub fn command(&self, at: SimTime, speed_m_s: f64) {
        let mut driven = self.lock();
        if driven.began.is_none() {
            // It starts from rest, not at the speed its own drive begins with.
            driven.began = Some(at);
            driven.trajectory.halt(0.0);
        }
        if let Some(t_s) = driven.driven_s(at) {
            driven.trajectory.command(t_s, speed_m_s);
        }
    }

    /// Opens nozzle `number` of its sprayer this far from `at` on: 0 shut, 1 open.
    pub fn command_nozzle(&self, at: SimTime, number: u8, duty: f64) {
        self.lock().nozzles.tell(at, number, duty.clamp(0.0, 1.0));
    }

    /// How far a nozzle has been told to open; none while it has been told nothing.
    pub fn nozzle_duty(&self, number: usize, at: SimTime) -> Option<f64> {
        self.lock().nozzles.duty(number, at)
    }

    /// From `at` on this share of full flow leaves nozzle `number` of its boom.
    pub fn set_nozzle_flow(&self, at: SimTime, number: u8, share: f64) {
        self.lock().flows.tell(at, number, share.max(0.0));
    }

    /// The share of full flow that leaves a nozzle of its boom; 0 before anything was said of it.
    pub fn nozzle_flow(&self, number: usize, at: SimTime) -> f64 {
        self.lock().flows.duty(number, at).unwrap_or(0.0)
    }

    /// How often nozzles have been told otherwise, or have given otherwise, by `at`.
    pub fn nozzle_changes(&self, at: SimTime) -> u64 {
        let driven = self.lock();
        driven.nozzles.changes(at) + driven.flows.changes(at)
    }

    fn lock(&self) -> MutexGuard<'_, Driven> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: u64 = 1_000_000_000;

    #[test]
    fn it_stands_until_it_is_set_going() {
        let tractor = Tractor::new(Trajectory::straight(2.0, 1.5));
        let still = tractor.motion(SimTime(7 * SECOND));
        assert_eq!((still.place.y_m, still.speed_m_s), (2.0, 0.0));
        tractor.begin(SimTime(10 * SECOND));
        tractor.begin(SimTime(11 * SECOND));
        assert_eq!(tractor.motion(SimTime(9 * SECOND)).speed_m_s, 0.0);
        assert_eq!(tractor.motion(SimTime(12 * SECOND)).place.y_m, 5.0);
    }

    #[test]
    fn a_command_sets_it_going_from_rest() {
        let tractor = Tractor::new(Trajectory::straight(0.0, 1.5));
        tractor.command(SimTime(5 * SECOND), 1.0);
        assert_eq!(tractor.motion(SimTime(5 * SECOND)).speed_m_s, 0.0);
        // Half a metre a second squared for two seconds.
        assert!((tractor.motion(SimTime(7 * SECOND)).place.y_m - 1.0).abs() < 1e-12);
        assert!((tractor.motion(SimTime(9 * SECOND)).place.y_m - 3.0).abs() < 1e-12);
    }
}
