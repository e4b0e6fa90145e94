//! Who looks at runs while they go on, and changes nothing in them.

use std::sync::Arc;

use rowscan_emulator::clock::SimClock;
use rowscan_emulator::{RigControl, SeenRig};
use rowscan_recording::Taps;

/// One who looks at every run.
pub trait Onlooker: Send + Sync {
    /// Comes before a run has begun to be set up, whose time is on `clock`.
    fn come(&self, clock: Arc<SimClock>) -> Box<dyn Look>;
}

/// A look at one run.
pub trait Look {
    /// Where copies of all bytes go.
    fn taps(&self) -> Taps;

    /// Looks at the run, whose time does not go yet, until what this returns is dropped. `control` is told of addresses that take no part in lockstep.
    fn begin(self: Box<Self>, rig: SeenRig<'_>, control: RigControl) -> Box<dyn Send>;
}
