//! What every estimator is given, and what it must do.

use std::fmt;

use super::measure::{Measure, Quantity};
use crate::geometry::{Beam, Frame};
use crate::parameters::Parameters;
use crate::profile::Section;
use crate::voxels::Voxels;

/// A way to measure a canopy, for lists and for the command line.
pub struct EstimatorInfo {
    /// Its name: `--estimators NAME`.
    pub name: &'static str,
    /// What it measures, and the assumption it makes.
    pub title: &'static str,
    /// Where the formula comes from.
    pub source: &'static str,
    /// What it reports.
    pub quantities: &'static [Quantity],
    pub(super) make: fn(&Setting) -> Box<dyn Estimator>,
}

impl fmt::Debug for EstimatorInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("EstimatorInfo").field("name", &self.name).finish_non_exhaustive()
    }
}

/// What an estimator is made for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Setting {
    pub(crate) frame: Frame,
    pub(crate) parameters: Parameters,
    pub(crate) row_spacing_m: Option<f64>,
}

/// One scan line.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SightedLine<'a> {
    /// Metres of row it stands for.
    pub(crate) weight_m: f64,
    /// The beams that look ahead and gave a range or a miss.
    pub(crate) sightings: &'a [Sighting],
}

/// What one beam came to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sighting {
    pub(crate) beam: Beam,
    /// Where the canopy stopped it; None if it went through: on the ground, on the next row, or nowhere.
    pub(crate) canopy: Option<Contact>,
}

/// A canopy return.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Contact {
    pub(crate) range_m: f64,
    pub(crate) x_m: f64,
    pub(crate) z_m: f64,
    /// False if the beam before, or this beam on the line before, met the same patch of surface.
    pub(crate) fresh: bool,
}

/// A slice of the row that ends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slice<'a> {
    pub(crate) voxels: &'a Voxels,
}

/// The piece of row that measures are requested for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stretch {
    /// Metres of it that were scanned.
    pub(crate) scanned_m: f64,
    /// Ground it stands on, m²: row spacing × metres scanned.
    pub(crate) ground_m2: Option<f64>,
}

impl Stretch {
    pub(crate) fn new(scanned_m: f64, row_spacing_m: Option<f64>) -> Self {
        let ground_m2 = row_spacing_m.map(|spacing_m| spacing_m * scanned_m).filter(|m2| *m2 > 0.0);
        Self { scanned_m, ground_m2 }
    }
}

/// Sums over a stretch of row, and the formula over them.
pub(crate) trait Estimator: fmt::Debug + Send + Sync {
    /// A line passes.
    fn line(&mut self, _line: &SightedLine<'_>) {}

    /// A section of the outline ends.
    fn section(&mut self, _section: &Section<'_>) {}

    /// A slice of voxels ends.
    fn slice(&mut self, _slice: &Slice<'_>) {}

    /// The numbers so far.
    fn measures(&self, stretch: &Stretch, out: &mut Vec<Measure>);

    /// Begins a new stretch.
    fn clear(&mut self);

    /// A copy, for an estimate in mid-stream.
    fn boxed(&self) -> Box<dyn Estimator>;
}

impl Clone for Box<dyn Estimator> {
    fn clone(&self) -> Self {
        self.as_ref().boxed()
    }
}
