//! What the scans themselves say of how wide the beams are.
//!
//! Two things tell rays from a real scanner's beams. Three neighbouring beams on one surface lie on a line: a ray to the resolution of its range, a real
//! range scatters by millimetres. And a return that stands alone before what lies behind it is narrower than the angle between two beams: leaves are so to a
//! ray, hardly to a spot that is wider than that angle.
//! Only where both say the same do they speak: rays with noise, and spots without, are neither. Where spots lie apart (an LMS2xx's) returns stand alone, too,
//! and the first decides.

use std::f64::consts::FRAC_PI_4;

use rowscan_protocol::angle::BeamGrid;
use rowscan_protocol::model::AnyModel;
use rowscan_protocol::optics::Spot;
use rowscan_protocol::rig::BeamWidth;

use crate::geometry::{Reading, reading};

/// Triples and edges before anything is said.
const LEAST_TRIPLES: u64 = 2000;
const LEAST_EDGES: u64 = 300;
/// Farther from the line of its neighbours, a range is of another surface, metres.
const SAME_SURFACE_M: f64 = 0.025;
/// Nearer it is exact: three ranges rounded to a millimetre are 1 mm off at most.
const EXACT_M: f64 = 0.0015;
/// Ranges of whole centimetres tell nothing, metres.
const COARSE_M: f64 = 0.01;
/// Share of triples that are exact: rays 0.95 to 1.0, shipped models' beams 0.08 to 0.22.
const RAYS_EXACT: f64 = 0.6;
/// Recorded ones of an LMS111, an LMS511 and a TiM781S have 0.12, 0.26 and 0.10.
const BEAMS_EXACT: f64 = 0.4;
/// A step between returns is an edge, metres.
const EDGE_M: f64 = 0.3;
/// Farther away spots are wide, and foliage is of other rows, metres.
const FAR_M: f64 = 8.0;
/// Angle between the beams that edges are looked for at, degrees: of finer ones every n-th.
const EDGE_STEP_DEG: f64 = 1.0 / 3.0;
/// Edges whose return stands alone: rays 0.13 to 0.48, beams 0.01 to 0.06.
const RAYS_ALONE: f64 = 0.1;
const BEAMS_ALONE: f64 = 0.08;

/// Spots are compared with the angle between two beams at this range, metres.
const COMPARED_AT_M: f64 = 2.0;
/// A spot that is so many of these angles wide hides what is narrower than they are.
const OVERLAP: f64 = 1.2;

/// Finer beams of an LMS2xx are of several turns of its mirror, between which the tractor drives on.
const LMS2XX_TURN_DEG: f64 = 1.0;

/// Counts of a pass so far.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BeamWitness {
    /// Of the scanner's model; `None` where nobody knows.
    spot: Option<Spot>,
    /// Angle between beams of one turn of its mirror at least, degrees.
    turn_step_deg: f64,
    /// Spots of neighbouring beams overlap.
    overlap: bool,
    triples: u64,
    exact: u64,
    edges: u64,
    alone: u64,
}

/// What speaks against the rig's word on the beams.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct OtherBeams {
    /// What the scans look like.
    pub(crate) found: BeamWidth,
    /// Share of three neighbouring ranges on one surface that lie on a line.
    pub(crate) exact: f64,
    /// Share of edges whose return stands alone.
    pub(crate) alone: f64,
}

impl BeamWitness {
    /// Of a scanner of this model.
    pub(crate) fn of(model: &str) -> Self {
        let model = AnyModel::by_name(model);
        let spot = model.map(|model| model.optics().spot);
        let turn_step_deg = match model {
            Some(AnyModel::Lms2xx(_)) => LMS2XX_TURN_DEG,
            Some(AnyModel::Cola(_)) | None => 0.0,
        };
        Self { spot, turn_step_deg, overlap: true, triples: 0, exact: 0, edges: 0, alone: 0 }
    }

    /// Adds a scan's ranges, metres.
    pub(crate) fn add(&mut self, grid: BeamGrid, range_m: &[f64]) {
        let step = grid.step_deg().to_radians();
        if !(step > 0.0 && step < FRAC_PI_4) {
            return;
        }
        let turn_step = step.max(self.turn_step_deg.to_radians());
        let spot_m = self.spot.map_or(f64::INFINITY, |spot| 2.0 * spot.radius_m(COMPARED_AT_M));
        self.overlap = spot_m > OVERLAP * turn_step * COMPARED_AT_M;
        let twice_cos = 2.0 * step.cos();
        for three in range_m.windows(3) {
            let &[before_m, at_m, after_m] = three else { continue };
            if !three.iter().all(|range_m| reading(*range_m) == Reading::Return && *range_m < FAR_M) {
                continue;
            }
            // Steeper surfaces make more of a range's rounding.
            if (after_m - before_m).abs() > 4.0 * step * at_m {
                continue;
            }
            let off_m = (at_m - twice_cos * before_m * after_m / (before_m + after_m)).abs();
            if off_m < SAME_SURFACE_M && !three.iter().copied().all(is_coarse) {
                self.triples += 1;
                self.exact += u64::from(off_m < EXACT_M);
            }
        }
        let stride = (EDGE_STEP_DEG.max(self.turn_step_deg) / grid.step_deg()).round().max(1.0) as usize;
        let mut last_m = [f64::NAN; 2];
        for range_m in range_m.iter().step_by(stride) {
            let behind_m = depth_m(*range_m);
            let [before_m, at_m] = last_m;
            last_m = [at_m, behind_m];
            if at_m < FAR_M && before_m - at_m > EDGE_M {
                self.edges += 1;
                self.alone += u64::from(behind_m - at_m > EDGE_M);
            }
        }
    }

    /// What the scans look like, where that is not what the rig says.
    pub(crate) fn against(&self, rig: Option<BeamWidth>) -> Option<OtherBeams> {
        if self.triples < LEAST_TRIPLES || self.edges < LEAST_EDGES {
            return None;
        }
        let exact = self.exact as f64 / self.triples as f64;
        let alone = self.alone as f64 / self.edges as f64;
        let found = match rig? {
            BeamWidth::Ideal if exact < BEAMS_EXACT && (alone < BEAMS_ALONE || !self.overlap) => {
                BeamWidth::Device
            }
            BeamWidth::Device if exact > RAYS_EXACT && alone > RAYS_ALONE => BeamWidth::Ideal,
            BeamWidth::Ideal | BeamWidth::Device => return None,
        };
        Some(OtherBeams { found, exact, alone })
    }
}

/// How far a beam goes, metres: endless where it met nothing, not a number where nobody knows.
fn depth_m(range_m: f64) -> f64 {
    match reading(range_m) {
        Reading::Return => range_m,
        Reading::Miss => f64::INFINITY,
        Reading::Invalid => f64::NAN,
    }
}

fn is_coarse(range_m: f64) -> bool {
    let steps = range_m / COARSE_M;
    (steps - steps.round()).abs() < 1e-6
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: BeamGrid = BeamGrid { start: 0, step: 5000, count: 361 };

    /// A wall 2 m away that is `off_m` off, beam by beam, where `is_met` by the beam's number of twelve.
    fn fence(
        model: &str,
        off_m: impl Fn(usize) -> f64,
        is_met: impl Fn(usize) -> bool,
        unit_m: f64,
    ) -> BeamWitness {
        let mut witness = BeamWitness::of(model);
        for _ in 0..40 {
            let ranges_m: Vec<f64> = (0..GRID.len())
                .map(|i| {
                    let wall_m = 2.0 / (GRID.angle_deg(i) - 90.0).to_radians().cos() + off_m(i);
                    let is_met = is_met(i % 12) && (0.0..7.0).contains(&wall_m);
                    if is_met { (wall_m / unit_m).round() * unit_m } else { f64::INFINITY }
                })
                .collect();
            witness.add(GRID, &ranges_m);
        }
        witness
    }

    /// Some millimetres, no two neighbours alike.
    fn scatter_m(i: usize) -> f64 {
        ((i * 7919) % 31) as f64 * 6e-4 - 9e-3
    }

    fn exact_m(_: usize) -> f64 {
        0.0
    }

    /// One wide hole of twelve beams: nothing stands alone.
    fn wide(i: usize) -> bool {
        i >= 4
    }

    /// Of two edges, one returns alone.
    fn lone(i: usize) -> bool {
        i >= 6 || i == 3
    }

    fn found(witness: &BeamWitness, rig: BeamWidth) -> Option<BeamWidth> {
        witness.against(Some(rig)).map(|other| other.found)
    }

    #[test]
    fn beams_are_told_where_both_witnesses_say_the_same_and_the_rig_another() {
        use BeamWidth::{Device, Ideal};
        type Told = (fn(usize) -> f64, fn(usize) -> bool, Option<BeamWidth>, Option<BeamWidth>);
        let cases: [Told; 4] = [
            (scatter_m, wide, Some(Device), None),
            (exact_m, lone, None, Some(Ideal)),
            // Rays with noise, and a spot without any.
            (scatter_m, lone, None, None),
            (exact_m, wide, None, None),
        ];
        for (off_m, is_met, by_rays, by_device) in cases {
            let witness = fence("lms111", off_m, is_met, 1e-3);
            assert_eq!(
                (found(&witness, Ideal), found(&witness, Device)),
                (by_rays, by_device),
                "{witness:?}"
            );
            assert_eq!(witness.against(None), None, "the rig says nothing");
        }
    }

    #[test]
    fn where_spots_lie_apart_the_scatter_decides() {
        let apart = fence("lms291", scatter_m, lone, 1e-3);
        assert_eq!(found(&apart, BeamWidth::Ideal), Some(BeamWidth::Device));
        assert_eq!(found(&fence("lms291", exact_m, lone, 1e-3), BeamWidth::Ideal), None);
    }

    #[test]
    fn whole_centimetres_and_too_few_scans_say_nothing() {
        assert_eq!(found(&fence("lms111", scatter_m, wide, 1e-2), BeamWidth::Ideal), None);
        assert_eq!(found(&fence("lms111", exact_m, lone, 1e-2), BeamWidth::Device), None);
        assert_eq!(found(&BeamWitness::of("lms111"), BeamWidth::Ideal), None);
    }

    #[test]
    fn no_ranges_break_it() {
        let mut witness = BeamWitness::of("nobody's");
        witness.add(BeamGrid { start: 0, step: 0, count: 3 }, &[1.0, 1.0, 1.0]);
        witness.add(GRID, &[]);
        witness.add(GRID, &[f64::NAN, -1.0, f64::INFINITY, 0.0, 1e300]);
        assert_eq!((witness.triples, witness.edges), (0, 0));
    }
}
