//! The tractor: shared by scanners, encoder, GNSS and CAN, each of which samples it at its own simulated instants.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rowscan_protocol::time::SimTime;

use crate::trajectory::{Motion, Trajectory};

/// A shared tractor. It stands at its start until something starts it; from then on it is a function of simulated time and of the
/// commands it received.
#[derive(Clone, Debug)]
pub struct Tractor(Arc<Mutex<Driven>>);

#[derive(Debug)]
struct Driven {
    trajectory: Trajectory,
    began: Option<SimTime>,
}

impl Driven {
    /// Seconds driven at `at`; before it began, none.
    fn driven_s(&self, at: SimTime) -> Option<f64> {
        let began = self.began?;
        (at >= began).then(|| Duration::from_nanos(at.0 - began.0).as_secs_f64())
    }
}

impl Tractor {
    /// At its start, standing.
    pub fn new(trajectory: Trajectory) -> Self {
        Self(Arc::new(Mutex::new(Driven { trajectory, began: None })))
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
        let driven = self.lock();
        match driven.driven_s(at) {
            Some(t_s) => driven.trajectory.at(t_s),
            None => {
                let start = driven.trajectory.at(0.0);
                Motion { speed_m_s: 0.0, wheel_speed_m_s: 0.0, ..start }
            }
        }
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
