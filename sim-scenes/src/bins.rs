//! Bins along one coordinate, and how organs are cut at their faces.

use std::borrow::Cow;

use crate::organ::{Leaf, Surface, Tree};
use crate::polygon;

/// Most bins of one axis: a scene of odd size may not exhaust the memory.
pub(crate) const MOST_BINS: f64 = 1e6;

/// What a bin's number counts along.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Axis {
    /// Along the row.
    Y = 1,
    /// Up.
    Z = 2,
}

impl Axis {
    /// A point's coordinate.
    pub(crate) fn of(self, point: &[f64; 3]) -> f64 {
        point.get(self as usize).copied().unwrap_or(0.0)
    }
}

/// Bins along one coordinate: bin `k` lies between faces `k` and `k + 1`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bins {
    axis: Axis,
    step_m: f64,
    /// Bins of a period and its length, where the scene repeats.
    period: Option<(i64, f64)>,
}

impl Bins {
    /// Bins along a row that repeats every `length_m`; the last one of a period ends with it, and may be thinner. None where there are none, or
    /// too many.
    pub(crate) fn along_row(length_m: f64, step_m: f64) -> Option<Self> {
        let count = (length_m / step_m - 1e-9).ceil();
        let sound = step_m > 0.0 && (1.0..=MOST_BINS).contains(&count);
        sound.then_some(Self { axis: Axis::Y, step_m, period: Some((count as i64, length_m)) })
    }

    /// Bins about 0 without end. None for a step that is none.
    pub(crate) fn even(axis: Axis, step_m: f64) -> Option<Self> {
        (step_m > 0.0 && step_m.is_finite()).then_some(Self { axis, step_m, period: None })
    }

    /// Bins of a period; 0 where nothing repeats.
    pub(crate) fn count(&self) -> i64 {
        self.period.map_or(0, |(count, _)| count)
    }

    /// The bin of the first period that bin `k` repeats.
    pub(crate) fn in_period(&self, k: i64) -> i64 {
        self.period.map_or(k, |(count, _)| k.rem_euclid(count))
    }

    /// Lower and upper face of a bin, metres.
    pub(crate) fn faces_m(&self, k: i64) -> [f64; 2] {
        [self.face_m(k), self.face_m(k + 1)]
    }

    /// Faces are counted through all periods: the last bin of each may be thinner than the others.
    pub(crate) fn face_m(&self, k: i64) -> f64 {
        match self.period {
            Some((count, length_m)) => {
                k.div_euclid(count) as f64 * length_m + k.rem_euclid(count) as f64 * self.step_m
            }
            None => k as f64 * self.step_m,
        }
    }

    /// The bin that holds a coordinate.
    pub(crate) fn bin_of(&self, at_m: f64) -> i64 {
        match self.period {
            Some((count, length_m)) => {
                let period = (at_m / length_m).floor();
                period as i64 * count + (((at_m - period * length_m) / self.step_m) as i64).min(count - 1)
            }
            None => (at_m / self.step_m).floor() as i64,
        }
    }

    /// Calls `add(bin, leaf area, wood area)` for every part of every organ. The parts of an organ add up to the organ.
    pub(crate) fn fill(&self, trees: &[Cow<'_, Tree>], mut add: impl FnMut(i64, f64, f64)) {
        let mut scratch = Vec::new();
        let mut polygon = |leaf: &Leaf, add: &mut dyn FnMut(i64, f64)| {
            let below =
                |face_m| polygon::area_below(leaf.outline(), self.axis as usize, face_m, &mut scratch);
            self.cut(self.extent_m(leaf.outline()), leaf.area_m2(), below, add);
        };
        for leaf in trees.iter().flat_map(|tree| &tree.leaves) {
            polygon(leaf, &mut |bin, area| add(bin, area, 0.0));
        }
        let facets = trees.iter().flat_map(|tree| &tree.facets);
        for bark in facets.filter(|facet| facet.surface == Surface::Bark) {
            polygon(&bark.polygon, &mut |bin, area| add(bin, 0.0, area));
        }
        for piece in trees.iter().flat_map(|tree| &tree.wood) {
            let [low, high] = self.extent_m(&[piece.base(), piece.tip()]);
            let below = |face_m: f64| piece.area_m2() * (face_m - low) / (high - low);
            self.cut([low, high], piece.area_m2(), below, |bin, area| add(bin, 0.0, area));
        }
    }

    /// Lowest and highest coordinate of some points.
    pub(crate) fn extent_m(&self, points: &[[f64; 3]]) -> [f64; 2] {
        points.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], point| {
            let at_m = self.axis.of(point);
            [low.min(at_m), high.max(at_m)]
        })
    }

    /// The part of a polygon that lies in bin `k`, in `part`.
    pub(crate) fn clip(
        &self,
        outline: &[[f64; 3]],
        k: i64,
        scratch: &mut Vec<[f64; 3]>,
        part: &mut Vec<[f64; 3]>,
    ) {
        let ([low, high], axis) = (self.faces_m(k), self.axis as usize);
        polygon::clip(outline, axis, high, polygon::Keep::Below, scratch);
        polygon::clip(scratch, axis, low, polygon::Keep::Above, part);
    }

    /// Cuts what reaches from `low` to `high` at the faces; `below` gives the area under a face between the two.
    pub(crate) fn cut(
        &self,
        [low, high]: [f64; 2],
        total_m2: f64,
        mut below: impl FnMut(f64) -> f64,
        mut add: impl FnMut(i64, f64),
    ) {
        let (first, last) = (self.bin_of(low), self.bin_of(high));
        let mut below_m2 = 0.0;
        for bin in first..last {
            let up_to_m2 = below(self.face_m(bin + 1));
            add(bin, up_to_m2 - below_m2);
            below_m2 = up_to_m2;
        }
        add(last, total_m2 - below_m2);
    }
}
