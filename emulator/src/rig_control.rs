//! The handle by which others look at a running rig's time, stop it, and let it go on.

use std::net::SocketAddr;
use std::sync::Arc;

use rowscan_protocol::time::SimTime;
use rowscan_vehicle::Tractor;

use crate::clock::{SimClock, TimeScale, TimeScaleError};
use crate::lockstep::Bystanders;
use crate::steps::Steps;

/// A rig's time in others' hands. Clones share it; every call but [`RigControl::stepped`] returns at once.
#[derive(Clone, Debug)]
pub struct RigControl {
    pub(crate) clock: Arc<SimClock>,
    pub(crate) steps: Steps,
    pub(crate) tractor: Tractor,
    pub(crate) mode: ClockMode,
    pub(crate) bystanders: Bystanders,
}

/// What drives a rig's time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClockMode {
    /// The host's clock.
    Paced,
    /// Whoever takes what is sent.
    Max,
    /// Acknowledgements.
    Lockstep,
    /// Acknowledgements, and grants of steps.
    Granted,
}

/// A rig's time at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigTime {
    /// What drives it.
    pub mode: ClockMode,
    /// Simulated time.
    pub at: SimTime,
    /// Simulated seconds a host second, on a paced clock.
    pub scale: Option<f64>,
    /// Somebody has stopped it, or all steps that were granted are taken.
    pub paused: bool,
    /// Steps taken.
    pub steps: u64,
    /// Steps granted in all, where they are counted.
    pub granted: Option<u64>,
    /// When the drive started.
    pub began: Option<SimTime>,
    /// Where the tractor is along its row, metres, since then.
    pub row_m: Option<f64>,
}

impl RigControl {
    /// Time now.
    pub fn time(&self) -> RigTime {
        let at = self.clock.now();
        let began = self.tractor.began();
        let (steps, granted) = (self.steps.taken(), self.steps.granted());
        RigTime {
            mode: self.mode,
            at,
            scale: match self.clock.scale() {
                TimeScale::Paced(scale) => Some(scale),
                TimeScale::Max => None,
            },
            paused: self.clock.is_paused() || granted.is_some_and(|granted| granted <= steps),
            steps,
            granted,
            began,
            row_m: began.map(|_| self.tractor.motion(at).place.y_m),
        }
    }

    /// Who connects to this program at `address` takes no part in lockstep.
    pub fn exclude(&self, address: SocketAddr) {
        self.bystanders.add(address);
    }

    /// Stops time. Clients are answered meanwhile, and connections are taken.
    pub fn pause(&self) {
        self.clock.pause(true);
    }

    /// Lets time run on. Steps are counted no longer, unless they need a grant.
    pub fn resume(&self) {
        if self.mode != ClockMode::Granted {
            self.steps.free(&self.clock);
        }
        self.clock.pause(false);
    }

    /// So many simulated seconds a host second from now on.
    ///
    /// # Errors
    /// It is no scale, or the clock is not paced.
    pub fn set_scale(&self, scale: f64) -> Result<(), TimeScaleError> {
        self.clock.set_scale(scale)
    }

    /// Lets time take so many steps and stops it then; the number of the last of them.
    pub fn step(&self, count: u64) -> u64 {
        let last = self.steps.grant(count, &self.clock);
        self.clock.pause(false);
        last
    }

    /// Waits until step number `last` is taken. Cancel safe.
    pub async fn stepped(&self, last: u64) {
        self.steps.reach(last).await;
    }
}
