//! Where the tractor is beside its way, and how it goes up and down and rolls.

use std::f64::consts::{PI, TAU};
use std::time::Duration;

use rowscan_protocol::time::SimTime;
use rowscan_settings::fault_table::vehicle::DriveFault;

use super::spans::Spans;

/// How far off its way it is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Sway {
    /// To its right, metres.
    pub(crate) right_m: f64,
    pub(crate) up_m: f64,
    /// Right side down, radians.
    pub(crate) roll_rad: f64,
}

/// The faults that make it sway.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Swaying {
    spans: Spans<DriveFault>,
}

impl Swaying {
    pub(crate) fn begin(&mut self, key: u64, fault: DriveFault, at: SimTime) {
        self.spans.begin(key, fault, at);
    }

    /// False if there is none of this key.
    pub(crate) fn end(&mut self, key: u64, at: SimTime) -> bool {
        self.spans.end(key, at)
    }

    pub(crate) fn at(&self, at: SimTime) -> Sway {
        let mut sway = Sway::default();
        for span in self.spans.0.iter().filter(|span| span.from <= at) {
            match span.fault {
                DriveFault::Lateral { m, over } => {
                    let back = span.to.map_or(0.0, |to| eased(to, at, over));
                    sway.right_m += m * (eased(span.from, at, over) - back);
                }
                DriveFault::Bounce { m, hz, roll_rad } if span.covers(at) => {
                    let wave = libm::sin(TAU * hz * since(span.from, at));
                    sway.up_m += m * wave;
                    sway.roll_rad += roll_rad * wave;
                }
                DriveFault::Bounce { .. } | DriveFault::Speed { .. } => {}
            }
        }
        sway
    }
}

fn since(from: SimTime, at: SimTime) -> f64 {
    Duration::from_nanos(at.0.saturating_sub(from.0)).as_secs_f64()
}

/// From 0 to 1, without a jolt.
fn eased(from: SimTime, at: SimTime, over: Duration) -> f64 {
    if at < from {
        return 0.0;
    }
    let done = since(from, at) / over.as_secs_f64().max(f64::MIN_POSITIVE);
    if done >= 1.0 { 1.0 } else { (1.0 - libm::cos(PI * done)) / 2.0 }
}
