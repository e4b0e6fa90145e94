//! Who looks at runs while they go on, and changes nothing in them.

use std::sync::Arc;

use rowscan_emulator::clock::SimClock;
use rowscan_emulator::stage::Stage;
use rowscan_emulator::{Counting, LineWatch, RigControl};
use rowscan_protocol::model::AnyModel;
use rowscan_recording::Taps;
use rowscan_vehicle::Tractor;

/// One who looks at every run.
pub trait Onlooker: Send + Sync {
    /// Comes before a run has begun to be set up, whose time is on `clock`.
    fn come(&self, clock: Arc<SimClock>) -> Box<dyn Look>;
}

/// A look at one run.
pub trait Look {
    /// Where copies of all bytes go.
    fn taps(&self) -> Taps;

    /// Looks at the run until what this returns is dropped.
    fn begin(self: Box<Self>, run: SeenRun<'_>) -> Box<dyn Send>;
}

/// A run that is set up, and whose time does not go yet.
#[derive(Debug)]
pub struct SeenRun<'a> {
    /// The scenario, and the seed.
    pub title: String,
    /// Where it takes place.
    pub stage: &'a Stage,
    /// What the scanners ride on.
    pub tractor: Tractor,
    /// Its clock.
    pub clock: Arc<SimClock>,
    /// Told of addresses that take no part in lockstep.
    pub control: RigControl,
    /// Its scanners.
    pub scanners: Vec<SeenScanner>,
}

/// A scanner of a run.
#[derive(Debug)]
pub struct SeenScanner {
    /// Its name in the scenario.
    pub id: String,
    /// The rig's scanner it is, from 0.
    pub number: usize,
    /// What it is.
    pub model: AnyModel,
    /// Where its lines can be watched.
    pub lines: LineWatch,
    /// What it has done.
    pub counting: Counting,
}
