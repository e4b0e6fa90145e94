//! The wood kernel: the beams that may meet a cylinder, then the exact quadratic.

use glam::DVec3;

use super::leaves::Label;
use super::nearest::Nearest;
use super::row_index::{Extent, RowIndex};
use super::sight::Sight;
use crate::organ::Cylinder;

/// A beam this near to the axis's direction (square of the sine) meets ends only.
const ALONG_AXIS: f64 = 1e-20;

/// How far a conservative outline is widened, relative; far above rounding.
const WIDER: f64 = 1.0 + 1e-9;

/// A cylinder with what every beam needs.
#[derive(Clone, Copy, Debug)]
struct Pole {
    base: DVec3,
    axis: DVec3,
    length_m: f64,
    radius_m: f64,
}

/// Where a beam meets a cylinder, and |beam · surface normal| there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PoleHit {
    pub(super) range_m: f64,
    pub(super) cos_incidence: f64,
}

/// All wood of an orchard, images over the border of the period included, in the order of the row index.
#[derive(Clone, Debug, Default)]
pub(super) struct WoodField {
    index: RowIndex,
    labels: Vec<Label>,
    poles: Vec<Pole>,
}

impl WoodField {
    pub(super) fn new<'a>(wood: impl Iterator<Item = (Label, &'a Cylinder)>, period_m: f64) -> Self {
        let images: Vec<(Label, Pole, Extent)> = wood
            .flat_map(|(label, piece)| {
                let pole = Pole::of(piece);
                pole.extent().images(period_m).map(move |shift| {
                    let pole = Pole { base: pole.base + DVec3::Y * shift, ..pole };
                    (label, pole, pole.extent())
                })
            })
            .collect();
        let (index, order) = RowIndex::new(&images.iter().map(|(.., extent)| *extent).collect::<Vec<_>>());
        let sorted = || order.iter().filter_map(|number| images.get(*number));
        let (labels, poles) = sorted().map(|(label, pole, _)| (*label, *pole)).unzip();
        Self { index, labels, poles }
    }

    pub(super) fn label(&self, entry: usize) -> Option<Label> {
        self.labels.get(entry).copied()
    }

    /// The hit of one beam on one entry.
    pub(super) fn hit(&self, entry: usize, start: DVec3, direction: DVec3) -> Option<PoleHit> {
        self.poles.get(entry)?.hit(start, direction)
    }

    /// Enters every branch that the plane y = `origin[1]` cuts; owners are counted from `first_owner`.
    pub(super) fn cast<S: Sight>(
        &self,
        origin: [f64; 3],
        sight: &S,
        first_owner: usize,
        nearest: &mut Nearest,
    ) {
        let origin = DVec3::from_array(origin);
        for entry in self.index.at(origin.y) {
            let Some(pole) = self.poles.get(entry) else { continue };
            let owner = (first_owner + entry) as u32;
            pole.runs(origin, sight, |beams| {
                for beam in beams {
                    let (start, direction) = sight.ray(beam);
                    if let Some(hit) = pole.hit(origin + start, direction) {
                        nearest.offer_floor(beam, S::key(hit.range_m), owner);
                    }
                }
            });
        }
    }
}

impl Pole {
    fn of(piece: &Cylinder) -> Self {
        let (base, tip) = (DVec3::from_array(piece.base()), DVec3::from_array(piece.tip()));
        let (length_m, radius_m) = (piece.length_m(), piece.radius_m());
        Self { base, axis: (tip - base) / length_m, length_m, radius_m }
    }

    /// How far a disk square to the axis reaches along Y from its middle.
    fn reach_m(&self) -> f64 {
        self.radius_m * self.axis.x.hypot(self.axis.z) * WIDER + 1e-12
    }

    fn extent(&self) -> Extent {
        let ends = [self.base.y, self.base.y + self.axis.y * self.length_m];
        let reach = self.reach_m();
        Extent::around(ends.into_iter().flat_map(|y| [y - reach, y + reach]))
    }

    /// The beams that may meet it. What the plane cuts lies within a capsule: disks about that part of the axis that is within
    /// reach of the plane.
    fn runs<S: Sight>(&self, origin: DVec3, sight: &S, mut visit: impl FnMut(std::ops::Range<usize>)) {
        let (from, to) = self.part_near(origin.y);
        let seen = |along: f64| {
            let p = self.base + self.axis * along - origin;
            (p.x, p.z)
        };
        match sight.swept(seen(from), seen(to), self.radius_m * WIDER + 1e-12) {
            Some((low, width)) => sight.runs(low, width, visit),
            None => visit(0..sight.count()),
        }
    }

    /// Part of the axis (metres from the base) whose disks reach the plane.
    fn part_near(&self, y_m: f64) -> (f64, f64) {
        let (reach, rise) = (self.reach_m(), self.axis.y);
        if rise.abs() < 1e-12 {
            return (0.0, self.length_m);
        }
        let (one, other) = ((y_m - reach - self.base.y) / rise, (y_m + reach - self.base.y) / rise);
        let spare = self.length_m * 1e-9;
        let within = |along: f64| along.clamp(0.0, self.length_m);
        (within(one.min(other) - spare), within(one.max(other) + spare))
    }

    /// First surface along `direction` (unit, square to Y) from `origin`: where the beam enters, or leaves if it starts inside.
    ///
    /// The solid is an infinite cylinder between two planes: both convex, so the beam is inside both from the later entry to the
    /// earlier exit. The quadratic is taken about the point nearest the axis, where nothing cancels.
    fn hit(&self, origin: DVec3, direction: DVec3) -> Option<PoleHit> {
        let from_base = origin - self.base;
        let along = direction.dot(self.axis);
        let height = from_base.dot(self.axis);
        let (enter_slab, leave_slab) = if along != 0.0 {
            let (low, high) = (-height / along, (self.length_m - height) / along);
            (low.min(high), low.max(high))
        } else if (0.0..=self.length_m).contains(&height) {
            (f64::NEG_INFINITY, f64::INFINITY)
        } else {
            return None;
        };
        let across = direction - self.axis * along;
        let offset = from_base - self.axis * height;
        let square = across.length_squared();
        let (middle, half) = if square > ALONG_AXIS {
            let middle = -offset.dot(across) / square;
            let nearest = offset + across * middle;
            let inside = self.radius_m * self.radius_m - nearest.length_squared();
            if inside < 0.0 {
                return None;
            }
            (middle, (inside / square).sqrt())
        } else if offset.length_squared() <= self.radius_m * self.radius_m {
            (0.0, f64::INFINITY)
        } else {
            return None;
        };
        let (enter_side, leave_side) = (middle - half, middle + half);
        let (enter, leave) = (enter_side.max(enter_slab), leave_side.min(leave_slab));
        if enter > leave || leave <= 0.0 {
            return None;
        }
        let (range_m, on_side) =
            if enter > 0.0 { (enter, enter_side > enter_slab) } else { (leave, leave_side < leave_slab) };
        let cos_incidence = if on_side { square * half / self.radius_m } else { along.abs() };
        Some(PoleHit { range_m, cos_incidence })
    }
}
