//! What the scans themselves say of how wide the beams are.
//!
//! Three neighbouring beams on the ground lie on a line: rays to the resolution of their ranges, also on clods and between blades of grass; real ranges scatter by
//! millimetres, in rain, snow and dust as well. Foliage tells nothing: three rays on three leaves scatter, too.
//! A leaf or a hole that is narrower than the angle between two beams is seen by one of them alone. Rays see many of these. Spots that are wider than that angle
//! see hardly any. So rays with noise are told from spots, and spots without noise from rays.

use std::f64::consts::FRAC_PI_4;

use rowscan_protocol::angle::BeamGrid;
use rowscan_protocol::model::AnyModel;
use rowscan_protocol::optics::Spot;
use rowscan_protocol::rig::{BeamWidth, Mount};

use crate::geometry::{Reading, depth_m, reading};

/// Triples before anything is said.
const LEAST_TRIPLES: u64 = 1000;
/// Share of triples on one surface where surfaces are larger than three beams.
const LEAST_ONE_SURFACE: f64 = 0.5;
/// Edges before anything is said by them.
const LEAST_EDGES: u64 = 300;
/// Farther from the line of its neighbours, a range is of another surface, metres.
const SAME_SURFACE_M: f64 = 0.025;
/// Nearer it is exact: three ranges rounded to a millimetre are 1 mm off at most.
const EXACT_M: f64 = 0.0015;
/// Ranges of whole centimetres tell nothing, metres.
const COARSE_M: f64 = 0.01;
/// Share of triples that are exact: rays 0.95 to 1.0, 0.74 on clods of 0.1 m; shipped models' beams 0.07 to 0.23.
const RAYS_EXACT: f64 = 0.6;
/// Recorded ones of an LMS111, an LMS511 and a TiM781S have 0.12, 0.26 and 0.10.
const BEAMS_EXACT: f64 = 0.4;
/// A step between returns is an edge, metres.
const EDGE_M: f64 = 0.3;
/// Farther away spots are wide, and foliage is of other rows, metres.
const FAR_M: f64 = 8.0;
/// Angle between the beams that are compared with each other, degrees: of finer ones several lie in one spot.
const COMPARED_STEP_DEG: f64 = 1.0 / 3.0;
/// Returns that are nearer to each other than this are of one surface, before and behind a hole, metres.
const SAME_DEPTH_M: f64 = 0.1;
/// Edges whose return stands alone: rays 0.13 to 0.5, beams 0.01 to 0.1, and 0.2 to 0.8 in rain and snow.
const RAYS_ALONE: f64 = 0.1;
/// Rays that scatter have more of both than this: edges whose return stands alone, and holes of one beam over edges. Rain makes no holes.
const NOISY_RAYS_ALONE: f64 = 0.14;
const NOISY_RAYS_HOLES: f64 = 0.12;
/// Ground, or what grows on it, lies lower, metres.
const GROUND_M: f64 = 0.5;

/// Spots are compared with the angle between two beams at this range, metres.
const COMPARED_AT_M: f64 = 2.0;
/// A spot that is so many of these angles wide hides what is narrower than they are.
const OVERLAP: f64 = 1.5;

/// Finer beams of an LMS2xx are of several turns of its mirror, between which the tractor drives on.
const LMS2XX_TURN_DEG: f64 = 1.0;

/// Counts of a pass so far.
#[derive(Clone, Debug)]
pub(crate) struct BeamWitness {
    /// Of the latest scan.
    grid: BeamGrid,
    /// How much higher each of its beams comes a metre.
    rise: Vec<f64>,
    /// Of the scanner's model; `None` where nobody knows.
    spot: Option<Spot>,
    /// Angle between beams of one turn of its mirror at least, degrees.
    turn_step_deg: f64,
    /// Spots of neighbouring beams overlap.
    overlap: bool,
    ground: Triples,
    edges: u64,
    alone: u64,
    holes: u64,
}

/// Three neighbouring returns each.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Triples {
    all: u64,
    /// Those on one surface.
    one_surface: u64,
    /// Those of them on a line.
    exact: u64,
}

impl Triples {
    /// Share of those on one surface that lie on a line; `None` where too few are, or where surfaces are smaller than three beams.
    fn exact(&self) -> Option<f64> {
        let tells = self.one_surface >= LEAST_TRIPLES
            && self.one_surface as f64 > LEAST_ONE_SURFACE * self.all as f64;
        tells.then(|| self.exact as f64 / self.one_surface as f64)
    }
}

/// What speaks against the rig's word on the beams.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct OtherBeams {
    /// What the scans look like.
    pub(crate) found: BeamWidth,
    /// Share of three neighbouring ranges on the ground that lie on a line.
    pub(crate) exact: f64,
}

impl BeamWitness {
    /// Of a scanner on this mount.
    pub(crate) fn of(mount: &Mount) -> Self {
        let model = AnyModel::by_name(&mount.model);
        let spot = model.map(|model| model.optics().spot);
        let turn_step_deg = match model {
            Some(AnyModel::Lms2xx(_)) => LMS2XX_TURN_DEG,
            Some(AnyModel::Cola(_)) | None => 0.0,
        };
        Self {
            grid: BeamGrid::default(),
            rise: Vec::new(),
            spot,
            turn_step_deg,
            overlap: true,
            ground: Triples::default(),
            edges: 0,
            alone: 0,
            holes: 0,
        }
    }

    /// Adds a scan's ranges, metres.
    pub(crate) fn add(&mut self, mount: &Mount, grid: BeamGrid, range_m: &[f64]) {
        let step = grid.step_deg().to_radians();
        if !(step > 0.0 && step < FRAC_PI_4) {
            return;
        }
        if grid != self.grid {
            self.grid = grid;
            self.rise.clear();
            self.rise.extend((0..grid.len()).map(|i| mount.theta_deg(grid.angle_deg(i)).to_radians().sin()));
            let turn_step = step.max(self.turn_step_deg.to_radians());
            let spot_m = self.spot.map_or(f64::INFINITY, |spot| 2.0 * spot.radius_m(COMPARED_AT_M));
            self.overlap = spot_m > OVERLAP * turn_step * COMPARED_AT_M;
        }
        self.add_triples(mount.height_m, step, range_m);
        self.add_edges(range_m.iter().step_by(compared_step(grid, self.turn_step_deg)));
    }

    fn add_triples(&mut self, height_m: f64, step: f64, range_m: &[f64]) {
        let twice_cos = 2.0 * step.cos();
        for (three, rise) in range_m.windows(3).zip(self.rise.iter().skip(1)) {
            let &[before_m, at_m, after_m] = three else { continue };
            if !three.iter().all(|range_m| reading(*range_m) == Reading::Return && *range_m < FAR_M) {
                continue;
            }
            // Steeper surfaces make more of a range's rounding.
            let is_steep = (after_m - before_m).abs() > 4.0 * step * at_m;
            let is_ground = height_m + at_m * rise < GROUND_M;
            if is_steep || !is_ground || three.iter().copied().all(is_coarse) {
                continue;
            }
            let off_m = (at_m - twice_cos * before_m * after_m / (before_m + after_m)).abs();
            self.ground.all += 1;
            self.ground.one_surface += u64::from(off_m < SAME_SURFACE_M);
            self.ground.exact += u64::from(off_m < EXACT_M);
        }
    }

    fn add_edges<'a>(&mut self, range_m: impl Iterator<Item = &'a f64>) {
        let mut last_m = [f64::NAN; 2];
        for range_m in range_m {
            let after_m = depth_m(*range_m);
            let [before_m, at_m] = last_m;
            last_m = [at_m, after_m];
            if at_m < FAR_M && before_m - at_m > EDGE_M {
                self.edges += 1;
                self.alone += u64::from(after_m - at_m > EDGE_M);
            }
            let is_hole = (after_m - before_m).abs() < SAME_DEPTH_M && at_m - before_m > EDGE_M;
            self.holes += u64::from(is_hole && before_m < FAR_M);
        }
    }

    /// What the scans look like, where that is not what the rig says.
    pub(crate) fn against(&self, rig: Option<BeamWidth>) -> Option<OtherBeams> {
        let exact = self.ground.exact()?;
        let of_edges = |count: u64| (self.edges >= LEAST_EDGES).then(|| count as f64 / self.edges as f64);
        let (alone, holes) = (of_edges(self.alone), of_edges(self.holes));
        let more = |share: Option<f64>, than: f64| share.is_some_and(|share| share > than);
        let may_be_noisy_rays =
            self.overlap && more(alone, NOISY_RAYS_ALONE) && more(holes, NOISY_RAYS_HOLES);
        let found = match rig? {
            BeamWidth::Ideal if exact < BEAMS_EXACT && !may_be_noisy_rays => BeamWidth::Device,
            BeamWidth::Device if exact > RAYS_EXACT && more(alone, RAYS_ALONE) => BeamWidth::Ideal,
            BeamWidth::Ideal | BeamWidth::Device => return None,
        };
        Some(OtherBeams { found, exact })
    }
}

/// Every so many-th beam is compared with its neighbours, which are this far apart at least, degrees.
pub(crate) fn compared_step(grid: BeamGrid, least_deg: f64) -> usize {
    (COMPARED_STEP_DEG.max(least_deg) / grid.step_deg()).round().max(1.0) as usize
}

fn is_coarse(range_m: f64) -> bool {
    let steps = range_m / COARSE_M;
    (steps - steps.round()).abs() < 1e-6
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: BeamGrid = BeamGrid { start: 0, step: 5000, count: 361 };

    /// All that its beams meet is ground.
    fn mount(model: &str) -> Mount {
        Mount { model: model.to_owned(), height_m: -20.0, ..Mount::default() }
    }

    /// A wall 2 m away that is `off_m` off, beam by beam, where `is_met` by the beam's number of twelve.
    fn fence(
        model: &str,
        off_m: impl Fn(usize) -> f64,
        is_met: impl Fn(usize) -> bool,
        unit_m: f64,
    ) -> BeamWitness {
        let mount = mount(model);
        let mut witness = BeamWitness::of(&mount);
        for _ in 0..120 {
            let ranges_m: Vec<f64> = (0..GRID.len())
                .map(|i| {
                    let wall_m = 2.0 / (GRID.angle_deg(i) - 90.0).to_radians().cos() + off_m(i);
                    let is_met = is_met(i % 12) && (0.0..7.0).contains(&wall_m);
                    if is_met { (wall_m / unit_m).round() * unit_m } else { f64::INFINITY }
                })
                .collect();
            witness.add(&mount, GRID, &ranges_m);
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

    /// Of two edges one returns alone, and there is a hole of one beam: what rays see of leaves.
    fn leaves(i: usize) -> bool {
        i >= 6 && i != 9 || i == 3
    }

    /// One alone in a wide hole: a drop.
    fn rain(i: usize) -> bool {
        i >= 7 || i == 3
    }

    fn found(witness: &BeamWitness, rig: BeamWidth) -> Option<BeamWidth> {
        witness.against(Some(rig)).map(|other| other.found)
    }

    #[test]
    fn beams_are_told_where_the_rig_says_others() {
        use BeamWidth::{Device, Ideal};
        type Told = (fn(usize) -> f64, fn(usize) -> bool, Option<BeamWidth>, Option<BeamWidth>);
        let cases: [Told; 5] = [
            (scatter_m, wide, Some(Device), None),
            (exact_m, leaves, None, Some(Ideal)),
            (scatter_m, rain, Some(Device), None),
            // Rays with noise, and a spot without any.
            (scatter_m, leaves, None, None),
            (exact_m, wide, None, None),
        ];
        for (off_m, is_met, by_rays, by_device) in cases {
            let witness = fence("lms111", off_m, is_met, 1e-3);
            let told = (found(&witness, Ideal), found(&witness, Device));
            let counts = (witness.ground, witness.edges, witness.alone, witness.holes);
            assert_eq!(told, (by_rays, by_device), "{counts:?}");
            assert_eq!(witness.against(None), None, "the rig says nothing");
        }
    }

    #[test]
    fn where_spots_lie_apart_the_scatter_decides() {
        let apart = fence("lms291", scatter_m, leaves, 1e-3);
        assert_eq!(found(&apart, BeamWidth::Ideal), Some(BeamWidth::Device));
        assert_eq!(found(&fence("lms291", exact_m, leaves, 1e-3), BeamWidth::Ideal), None);
    }

    #[test]
    fn whole_centimetres_and_too_few_scans_say_nothing() {
        assert_eq!(found(&fence("lms111", scatter_m, wide, 1e-2), BeamWidth::Ideal), None);
        assert_eq!(found(&fence("lms111", exact_m, leaves, 1e-2), BeamWidth::Device), None);
        assert_eq!(found(&BeamWitness::of(&mount("lms111")), BeamWidth::Ideal), None);
    }

    /// Leaves scatter by themselves, and so does a thicket on the ground.
    #[test]
    fn foliage_and_thickets_tell_nothing() {
        let high = Mount { height_m: 20.0, ..mount("lms111") };
        let mut witness = BeamWitness::of(&high);
        let ranges_m: Vec<f64> = (0..GRID.len()).map(|i| 2.0 + scatter_m(i)).collect();
        (0..120).for_each(|_| witness.add(&high, GRID, &ranges_m));
        assert_eq!((witness.ground, found(&witness, BeamWidth::Ideal)), (Triples::default(), None));
        let fine_m = |i: usize| ((i * 7919) % 997) as f64 * 5e-4;
        assert_eq!(found(&fence("lms111", fine_m, wide, 1e-3), BeamWidth::Ideal), None);
    }

    #[test]
    fn no_ranges_break_it() {
        let mount = mount("nobody's");
        let mut witness = BeamWitness::of(&mount);
        witness.add(&mount, BeamGrid { start: 0, step: 0, count: 3 }, &[1.0, 1.0, 1.0]);
        witness.add(&mount, GRID, &[]);
        witness.add(&mount, GRID, &[f64::NAN, -1.0, f64::INFINITY, 0.0, 1e300]);
        assert_eq!((witness.ground, witness.edges), (Triples::default(), 0));
    }
}
