//! A tree that is still being worked on: organs with what bears them.

use glam::DVec3;

use crate::organ::{Cylinder, Facet, Leaf};
use crate::support::Support;

/// When a segment last grew.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Age {
    /// Grew in this season from end to end.
    Current,
    /// A spur: its tip grew in this season, on older wood.
    Spur,
    /// Older wood.
    Older,
    /// The generator keeps no seasons.
    Unknown,
}

/// A straight piece of growing wood, in tree coordinates: foot of the tree at the origin, X across the row, Y along it, Z up.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Segment {
    /// The segment it stands on. Always earlier in the list.
    pub(crate) bearer: Option<usize>,
    /// Metres of the bearer below the point where it stands.
    pub(crate) bearer_m: f64,
    pub(crate) base: DVec3,
    /// Of unit length.
    pub(crate) direction: DVec3,
    pub(crate) length_m: f64,
    pub(crate) radius_m: f64,
    /// The trunk is not cut below the clear height.
    pub(crate) is_trunk: bool,
    pub(crate) age: Age,
}

/// A leaf and where it grows.
#[derive(Clone, Debug)]
pub(crate) struct Blade {
    /// Segment that bears it, by number.
    pub(crate) segment: usize,
    /// Metres of the segment below it.
    pub(crate) along_m: f64,
    pub(crate) leaf: Leaf,
    /// None where petioles stop no beam.
    pub(crate) petiole: Option<Cylinder>,
}

/// A fruit and where it hangs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Fruit {
    /// Segment that bears it, by number.
    pub(crate) segment: usize,
    /// Metres of the segment below it.
    pub(crate) along_m: f64,
    pub(crate) middle: DVec3,
    pub(crate) radius_m: f64,
}

/// A tree before it is shaded, pruned, dressed for the season and thinned.
#[derive(Clone, Debug, Default)]
pub(crate) struct Draft {
    pub(crate) segments: Vec<Segment>,
    pub(crate) blades: Vec<Blade>,
    pub(crate) fruits: Vec<Fruit>,
    /// Wood without history: imported or analytic. No shears touch it.
    pub(crate) wood: Vec<Cylinder>,
    /// Facets without history, as `wood`.
    pub(crate) facets: Vec<Facet>,
    /// What is built there and does not grow.
    pub(crate) supports: Vec<Support>,
}

impl Draft {
    /// One-sided area of all leaves, m².
    pub(crate) fn leaf_area_m2(&self) -> f64 {
        self.blades.iter().map(|blade| blade.leaf.area_m2()).sum()
    }

    /// Keeps the blades for which `keep` says so, in order; those without an answer stay.
    pub(crate) fn retain_blades(&mut self, keep: impl IntoIterator<Item = bool>) {
        let mut keep = keep.into_iter();
        self.blades.retain(|_| keep.next().unwrap_or(true));
    }
}
