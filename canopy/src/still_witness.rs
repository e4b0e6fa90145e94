//! What the scans themselves say of the way: a tractor that stands sees the same picture again and again, and the way may go on all the same, by a rig's
//! constant speed or by a wheel that slips.
//!
//! Scans that the way puts [`APART_M`] apart are compared where they met canopy, beam by beam, and so are the neighbouring beams of each. Foliage differs as
//! much along the row as from beam to beam; a picture that differs between its beams and does not change is of one place. Leaves in the wind swing back: of
//! one place, a picture is like one of the last [`KEPT`], and along a row like none. Past what is smooth (a wall, bare ground) neither differs: then nothing
//! is known, and nothing is said.

use std::collections::VecDeque;

use rowscan_protocol::angle::BeamGrid;

use crate::beam_witness::compared_step;
use crate::geometry::{Beam, BeamTable, Frame, depth_m};

/// Ranges that differ by more are of two surfaces, metres: several standard deviations of any scanner here.
const OTHER_M: f64 = 0.1;
/// Way between two scans that are compared, metres: wider than leaves.
const APART_M: f64 = 0.15;
/// Lines that a line is compared with: over less way than from tree to tree, for trees may be of one mould.
const KEPT: usize = 6;
/// Beams of a pair that must have met something.
const LEAST_BEAMS: u32 = 30;
/// Share of neighbouring beams that differ from which on a picture tells anything.
const LEAST_ROUGH: f64 = 0.1;
/// A picture changes less than so many times what its beams differ by where it stands still: 0 of rays, up to 0.6 of seven models' beams, less
/// than 0.7 half of the time in a wind of 5 m/s, and 1.1 to 9 along ten rows.
const STILL: f64 = 0.7;
/// Lines of one place, and their share of all, from which on they are told.
const LEAST_LINES: u64 = 3;
const LEAST_SHARE: f64 = 0.02;
/// Their share from which on the way is unknown.
const MOST_SHARE: f64 = 0.05;

/// Compares each line with those that the way puts farther back.
#[derive(Clone, Debug, Default)]
pub(crate) struct StillWitness {
    grid: BeamGrid,
    y_m: f64,
    /// What the beams met in the latest lines, the oldest first.
    kept: VecDeque<Vec<Met>>,
    /// Lines that tell something, and those of them that are of one place with one before.
    lines: u64,
    still: u64,
}

impl StillWitness {
    /// Adds a line that was taken there by the way, metres.
    pub(crate) fn add(&mut self, frame: &Frame, table: &BeamTable, y_m: f64, range_m: &[f64]) {
        let grid = table.grid();
        let is_same_grid = self.grid == grid;
        if is_same_grid && (y_m - self.y_m).abs() < APART_M {
            return;
        }
        if !is_same_grid {
            self.kept.clear();
        }
        (self.grid, self.y_m) = (grid, y_m);
        let oldest = if self.kept.len() >= KEPT { self.kept.pop_front() } else { None };
        let mut now = oldest.unwrap_or_default();
        now.clear();
        let beams = table.beams().iter().zip(range_m).step_by(compared_step(grid, 0.0));
        now.extend(beams.map(|(beam, range_m)| Met::of(frame, beam.as_ref(), *range_m)));
        let rough = rough(&now).filter(|rough| *rough >= LEAST_ROUGH);
        let least_changed = self.kept.iter().filter_map(|before| changed(before, &now)).reduce(f64::min);
        if let (Some(rough), Some(changed)) = (rough, least_changed) {
            self.lines += 1;
            self.still += u64::from(changed < STILL * rough);
        }
        self.kept.push_back(now);
    }

    /// Scans of one place that the way puts apart, where they are many.
    pub(crate) fn found(&self) -> Option<StoodStill> {
        let share = self.still as f64 / self.lines.max(1) as f64;
        let is_told = self.still >= LEAST_LINES && share >= LEAST_SHARE;
        is_told.then_some(StoodStill { share, withheld: share > MOST_SHARE })
    }
}

/// Scans of one place that the way puts apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StoodStill {
    /// Their share of all that tell anything.
    pub(crate) share: f64,
    /// Whether leaf areas are withheld for it.
    pub(crate) withheld: bool,
}

/// What a beam met.
#[derive(Clone, Copy, Debug)]
struct Met {
    /// How far it went to canopy, metres: endless where it met none, not a number where nobody knows.
    depth_m: f64,
    /// How far across the row.
    x_m: f64,
}

impl Met {
    fn of(frame: &Frame, beam: Option<&Beam>, range_m: f64) -> Self {
        let nothing = Self { depth_m: f64::INFINITY, x_m: f64::INFINITY };
        let Some(beam) = beam else { return nothing };
        let depth_m = depth_m(range_m);
        match frame.crown_x_m(beam, depth_m) {
            Some(x_m) => Self { depth_m, x_m },
            None if depth_m.is_nan() => Self { depth_m, x_m: f64::NAN },
            None => nothing,
        }
    }

    /// Whether two beams ended elsewhere; `None` where neither met canopy, or nobody knows.
    fn differs(&self, other: &Self) -> Option<bool> {
        let (one_m, other_m) = (self.depth_m, other.depth_m);
        let is_known = !one_m.is_nan() && !other_m.is_nan() && (one_m.is_finite() || other_m.is_finite());
        is_known.then(|| (one_m - other_m).abs() > OTHER_M)
    }
}

/// The share of `true` of all that is known; `None` where that is little.
fn share(found: impl Iterator<Item = Option<bool>>) -> Option<f64> {
    let (all, some) = found.flatten().fold((0, 0), |(all, some), is| (all + 1, some + u32::from(is)));
    (all >= LEAST_BEAMS).then(|| f64::from(some) / f64::from(all))
}

/// How rough a line's canopy is between its lowest and its highest beam: of neighbours, those that differ. A wall's ranges differ by their angle alone: across the row
/// it is as far everywhere.
fn rough(beams: &[Met]) -> Option<f64> {
    let is_met = |met: &Met| met.depth_m.is_finite();
    let (first, last) = (beams.iter().position(is_met)?, beams.iter().rposition(is_met)?);
    share(beams.get(first..=last)?.windows(2).map(|two| {
        let [one, other] = two else { return None };
        let is_off = (one.x_m - other.x_m).abs() > OTHER_M || one.x_m.is_finite() != other.x_m.is_finite();
        one.differs(other).map(|differs| differs && is_off)
    }))
}

/// How much of the canopy is another from one line to the next.
fn changed(before: &[Met], now: &[Met]) -> Option<f64> {
    share(before.iter().zip(now).map(|(before, now)| before.differs(now)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::leaf_depth::leaf_depth_m;
    use crate::parameters::AreaForm;
    use rowscan_protocol::rig::{Mount, Rig};

    const GRID: BeamGrid = BeamGrid { start: 600_000, step: 5000, count: 121 };

    /// Lines at these places by the way, past depths by beam and by where the tractor really is.
    fn witness(way: impl Iterator<Item = (f64, f64)>, depth_m: impl Fn(i64, f64) -> f64) -> StillWitness {
        let rig = Rig::default();
        let frame = Frame::new(&rig, &Mount::default()).expect("it is one");
        let mut table = BeamTable::default();
        table.update(GRID, &frame, AreaForm::Midpoint);
        let mut witness = StillWitness::default();
        for (way_m, y_m) in way {
            let ranges_m: Vec<f64> = (0..GRID.len()).map(|beam| depth_m(beam as i64, y_m)).collect();
            witness.add(&frame, &table, way_m, &ranges_m);
        }
        witness
    }

    fn smooth(_: i64, _: f64) -> f64 {
        1.5
    }

    fn drive(end_m: f64) -> impl Iterator<Item = (f64, f64)> {
        (0..(end_m / 0.02) as usize).map(|line| (0.02 * line as f64, 0.02 * line as f64))
    }

    #[test]
    fn scans_of_one_place_are_told_where_the_way_goes_on() {
        assert_eq!(witness(drive(12.0), leaf_depth_m).found(), None, "it drives");
        let stands = witness(drive(12.0).map(|(way_m, _)| (way_m, 1.0)), leaf_depth_m).found();
        assert_eq!(stands, Some(StoodStill { share: 1.0, withheld: true }));
        // From 3 m on for the way of 0.55 m, and for 1.5 m of 12 m.
        for (stand_m, withheld) in [(0.55, false), (1.5, true)] {
            let truly = |way_m: f64| way_m.min(3.0) + (way_m - 3.0 - stand_m).max(0.0);
            let found = witness(drive(12.0).map(|(way_m, _)| (way_m, truly(way_m))), leaf_depth_m).found();
            assert_eq!(found.map(|stood| stood.withheld), Some(withheld), "{stand_m}: {found:?}");
        }
        // Leaves that swing by more than they are wide.
        let swing = |way_m: f64| 1.0 + 0.06 * (way_m * std::f64::consts::TAU / 0.7).sin();
        let stands = witness(drive(12.0).map(|(way_m, _)| (way_m, swing(way_m))), leaf_depth_m).found();
        assert_eq!(stands.map(|stood| stood.withheld), Some(true), "in the wind: {stands:?}");
        let drives =
            witness(drive(12.0).map(|(way_m, _)| (way_m, way_m + swing(way_m))), leaf_depth_m).found();
        assert_eq!(drives, None, "it drives in the wind");
        // A stand that the way knows of.
        let known = (0..2000).map(|line| (1.0 + 1e-5 * f64::from(line), 1.0));
        assert_eq!(witness(known, leaf_depth_m).found(), None);
    }

    #[test]
    fn where_all_looks_the_same_nothing_is_said() {
        for depth_m in [smooth, |_: i64, _: f64| f64::INFINITY, |_: i64, _: f64| f64::NAN] {
            let witness = witness(drive(12.0), depth_m);
            assert_eq!((witness.lines, witness.found()), (0, None));
        }
    }

    /// Beams of another grid are compared with nothing.
    #[test]
    fn another_grid_begins_anew() {
        let rig = Rig::default();
        let frame = Frame::new(&rig, &Mount::default()).expect("it is one");
        let mut table = BeamTable::default();
        let mut witness = StillWitness::default();
        for line in 0..100_i32 {
            let grid = BeamGrid { start: 600_000 + 2500 * (line % 2), ..GRID };
            table.update(grid, &frame, AreaForm::Midpoint);
            let ranges_m: Vec<f64> = (0..grid.len()).map(|beam| leaf_depth_m(beam as i64, 1.0)).collect();
            witness.add(&frame, &table, f64::from(line), &ranges_m);
        }
        assert_eq!((witness.lines, witness.found()), (0, None));
    }
}
