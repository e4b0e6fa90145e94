//! A virtual rig as those see it who look on and change nothing.

use std::fmt;
use std::sync::Arc;

use rowscan_protocol::model::AnyModel;
use rowscan_vehicle::Tractor;

use crate::clock::SimClock;
use crate::counting::CountReader;
use crate::line_watch::LineWatch;
use crate::stage::Stage;

/// A rig that is set up.
#[derive(Debug)]
pub struct SeenRig<'a> {
    /// What runs it, for people.
    pub title: String,
    /// Where it stands.
    pub stage: &'a Stage,
    /// What its scanners ride on.
    pub tractor: Tractor,
    /// Its clock.
    pub clock: Arc<SimClock>,
    /// Its scanners.
    pub scanners: Vec<SeenScanner>,
    /// What its sprayer has done so far, if it has one.
    pub map: Option<LiveMap>,
}

/// A picture of what a rig has done so far, drawn when somebody asks for it: that may take a second.
#[derive(Clone)]
pub struct LiveMap(Arc<dyn Fn() -> Option<String> + Send + Sync>);

impl LiveMap {
    /// One that is drawn like this, as SVG; none while there is nothing to draw.
    pub fn new(draw: impl Fn() -> Option<String> + Send + Sync + 'static) -> Self {
        Self(Arc::new(draw))
    }

    /// Draws it.
    pub fn svg(&self) -> Option<String> {
        (self.0)()
    }
}

impl fmt::Debug for LiveMap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("LiveMap")
    }
}

/// A scanner of such a rig.
#[derive(Debug)]
pub struct SeenScanner {
    /// As faults and state call it.
    pub name: String,
    /// Its number in the rig, from 0.
    pub number: usize,
    /// What it is.
    pub model: AnyModel,
    /// Where its lines can be watched.
    pub lines: LineWatch,
    /// What it has done.
    pub counts: CountReader,
}
