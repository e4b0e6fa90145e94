//! How a beam finds wood: exactly, or by the moving dot mesh of Méndez et al. (2012).

use glam::DVec3;
use rowscan_protocol::scan::Pose;
use serde::{Deserialize, Serialize};

use std::borrow::Cow;

use crate::caster::{Beams, Caster, Class, Layers, Return, Scratch};
use crate::orchard::Orchard;
use crate::organ::{Cylinder, Tree};

/// How wood is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WoodTest {
    /// The ray against the finite cylinder.
    #[default]
    Exact,
    /// The paper's, to measure what it does: it widens wood by about the mesh's half width and can step over the thinnest twigs.
    Mesh(Mesh),
}

/// The paper's "small three-dimensional mesh" at the end of the beam: a cube of points, two of its faces square to the beam, that moves
/// out step by step until a point lies within a branch. Its size and step are not in the text.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mesh {
    /// Half of the cube's edge, metres.
    pub half_width_m: f64,
    /// Points along an edge; 1 for the beam's end alone.
    pub points: u32,
    /// How far the mesh moves at a time, metres.
    pub step_m: f64,
}

impl Default for Mesh {
    fn default() -> Self {
        Self { half_width_m: 1e-3, points: 3, step_m: 1e-3 }
    }
}

/// Most points along an edge of the mesh.
const MOST_POINTS: u32 = 31;

/// A mesh that cannot be.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "a mesh needs a half width of 0 to 1 m, 1 to {MOST_POINTS} points an edge and a step of 1e-6 to 1 m, found {}, {} and {}",
    .0.half_width_m, .0.points, .0.step_m
)]
pub struct MeshError(Mesh);

impl Mesh {
    /// Refuses faces that do not form a mesh.
    ///
    /// # Errors
    /// A half width, number of points or step out of its bounds.
    pub fn validate(self) -> Result<Self, MeshError> {
        let half_width = (0.0..=1.0).contains(&self.half_width_m);
        let step = (1e-6..=1.0).contains(&self.step_m);
        let points = (1..=MOST_POINTS).contains(&self.points);
        if half_width && step && points { Ok(self) } else { Err(MeshError(self)) }
    }

    /// Places of the points along an edge, from −half width to +half width.
    fn places(&self) -> Vec<f64> {
        let between = f64::from(self.points.saturating_sub(1).max(1));
        let place = |i: u32| self.half_width_m * (2.0 * f64::from(i) / between - 1.0);
        if self.points == 1 { vec![0.0] } else { (0..self.points).map(place).collect() }
    }

    /// The first stop of the mesh, in metres along the beam, at which one of its points between `from` and `to` along a line parallel to
    /// the beam is within the wood that fills [from, to].
    fn stop_m(&self, places: &[f64], (from, to): (f64, f64)) -> Option<f64> {
        let stops = places.iter().filter_map(|ahead| {
            let stop = ((from - ahead) / self.step_m).ceil().max(1.0) * self.step_m;
            (stop + ahead <= to).then_some(stop)
        });
        stops.min_by(f64::total_cmp)
    }
}

/// What finds the returns of a line.
pub trait Casts: Sync {
    /// As [`Caster::cast_layers`].
    fn cast_layers(&self, origin: Pose, beams: &Beams, k: usize, scratch: &mut Scratch, out: &mut Layers);
}

impl Casts for Caster {
    fn cast_layers(&self, origin: Pose, beams: &Beams, k: usize, scratch: &mut Scratch, out: &mut Layers) {
        self.cast_layers(origin, beams, k, scratch, out);
    }
}

impl WoodTest {
    /// A caster over an orchard that finds wood this way.
    ///
    /// # Errors
    /// A mesh that cannot be.
    pub fn caster(self, orchard: &Orchard) -> Result<Box<dyn Casts>, MeshError> {
        Ok(match self {
            Self::Exact => Box::new(Caster::new(orchard)),
            Self::Mesh(mesh) => Box::new(MeshCaster::new(orchard, mesh.validate()?)),
        })
    }
}

/// Leaves and ground by the exact caster, wood by the mesh. For scanners that stand still while they turn.
#[derive(Clone, Debug)]
struct MeshCaster {
    mesh: Mesh,
    places: Vec<f64>,
    leaves: Caster,
    /// With images, so that none is missing between 0 and the period.
    branches: Vec<Branch>,
    period_m: f64,
}

#[derive(Clone, Debug)]
struct Branch {
    tree: u32,
    organ: u32,
    base: DVec3,
    axis: DVec3,
    length: f64,
    radius: f64,
}

impl MeshCaster {
    fn new(orchard: &Orchard, mesh: Mesh) -> Self {
        let bare = |tree: Cow<'_, Tree>| Tree { leaves: tree.leaves.clone(), ..Tree::default() };
        let period_m = orchard.period_m();
        let leafy = Orchard::from_trees(orchard.trees().map(bare).collect(), period_m, None, None);
        let mut branches = Vec::new();
        for (tree, organs) in (0..).zip(orchard.trees()) {
            for (organ, piece) in (0..).zip(&organs.wood) {
                let branch = Branch::new(tree, organ, piece);
                let reach = branch.radius + branch.length + 2.0 * mesh.half_width_m;
                let (from, to) = (branch.base.y - reach, branch.base.y + reach);
                let shifts = if period_m.is_finite() {
                    (-to / period_m).ceil() as i64..=((period_m - from) / period_m).floor() as i64
                } else {
                    0..=0
                };
                branches.extend(shifts.map(|shift| {
                    let by = if shift == 0 { 0.0 } else { shift as f64 * period_m };
                    Branch { base: branch.base + DVec3::Y * by, ..branch.clone() }
                }));
            }
        }
        Self { mesh, places: mesh.places(), leaves: Caster::new(&leafy), branches, period_m }
    }

    /// The branches that the mesh may touch in the plane at `y`.
    fn near(&self, y: f64) -> Vec<&Branch> {
        let margin = 2.0 * self.mesh.half_width_m;
        let near = |branch: &&Branch| {
            let ends = [branch.base.y, branch.base.y + branch.axis.y * branch.length];
            let reach = branch.radius + margin;
            ends[0].min(ends[1]) - reach <= y && y <= ends[0].max(ends[1]) + reach
        };
        self.branches.iter().filter(near).collect()
    }

    /// The first stop of the mesh along a beam.
    fn wood(&self, near: &[&Branch], start: DVec3, direction: DVec3) -> Return {
        let (aside, across) = (DVec3::Y, direction.cross(DVec3::Y));
        let mut nearest = Return::MISS;
        for branch in
            near.iter().filter(|branch| branch.is_near(start, direction, 2.0 * self.mesh.half_width_m))
        {
            for (a, b) in self.places.iter().flat_map(|a| self.places.iter().map(move |b| (*a, *b))) {
                let from = start + aside * a + across * b;
                let Some((within, cos)) = branch.chord(from, direction) else { continue };
                let Some(range_m) = self.mesh.stop_m(&self.places, within) else { continue };
                if range_m < nearest.range_m {
                    let cos_incidence = cos as f32;
                    let Branch { tree, organ, .. } = **branch;
                    nearest = Return { range_m, class: Class::Wood, tree, organ, cos_incidence };
                }
            }
        }
        nearest
    }
}

impl Casts for MeshCaster {
    fn cast_layers(&self, origin: Pose, beams: &Beams, k: usize, scratch: &mut Scratch, out: &mut Layers) {
        let y_m = if self.period_m.is_finite() { origin.y_m.rem_euclid(self.period_m) } else { origin.y_m };
        let origin = Pose { y_m, ..origin };
        let mut leaves = Layers::default();
        self.leaves.cast_layers(origin, beams, k, scratch, &mut leaves);
        out.reset(beams.len(), k);
        let near = self.near(y_m);
        for (beam, ((start, direction), first)) in beams.rays(origin).zip(leaves.nearest()).enumerate() {
            let wood = self.wood(&near, DVec3::from_array(start), DVec3::from_array(direction));
            let behind = leaves.leaves(beam).iter().skip(1);
            let before = std::iter::once(first).chain(behind).copied();
            out.set(beam, before.take_while(|hit| hit.range_m < wood.range_m).chain([wood]));
        }
    }
}

impl Branch {
    fn new(tree: u32, organ: u32, piece: &Cylinder) -> Self {
        let (base, tip) = (DVec3::from_array(piece.base()), DVec3::from_array(piece.tip()));
        let length = piece.length_m();
        Self { tree, organ, base, axis: (tip - base) / length, length, radius: piece.radius_m() }
    }

    /// False only where the line passes the ball around the branch by more than `margin`.
    fn is_near(&self, start: DVec3, direction: DVec3, margin: f64) -> bool {
        let to_middle = self.base + self.axis * (self.length / 2.0) - start;
        let reach = self.length / 2.0 + self.radius + margin;
        (to_middle - direction * to_middle.dot(direction)).length_squared() <= reach * reach
    }

    /// Where a line is within the branch, metres along it, and |line · surface normal| where it enters the mantle.
    fn chord(&self, start: DVec3, direction: DVec3) -> Option<((f64, f64), f64)> {
        let from_base = start - self.base;
        let (height, climb) = (from_base.dot(self.axis), direction.dot(self.axis));
        let (off, drift) = (from_base - self.axis * height, direction - self.axis * climb);
        let (a, b) = (drift.length_squared(), off.dot(drift));
        let c = off.length_squared() - self.radius * self.radius;
        let (mut from, mut to) = (f64::NEG_INFINITY, f64::INFINITY);
        if a > 1e-20 {
            let root = (b * b - a * c).max(-1.0);
            if root < 0.0 {
                return None;
            }
            (from, to) = ((-b - root.sqrt()) / a, (-b + root.sqrt()) / a);
        } else if c > 0.0 {
            return None;
        }
        let cos =
            if from.is_finite() { ((off + drift * from) / self.radius).dot(direction).abs() } else { 1.0 };
        let ends = [-height / climb, (self.length - height) / climb];
        if climb.abs() > 1e-15 {
            (from, to) = (from.max(ends[0].min(ends[1])), to.min(ends[0].max(ends[1])));
        } else if !(0.0..=self.length).contains(&height) {
            return None;
        }
        (from <= to && to > 0.0).then_some(((from, to), cos.min(1.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::{ScanKind, ScanPlan, ScanSettings, Target};

    fn post(diameter_m: f64) -> Orchard {
        let post = Cylinder::new([0.0, 0.5, 0.0], [0.0, 0.5, 1.0], diameter_m / 2.0).unwrap();
        Orchard::from_organs(Vec::new(), vec![post], f64::INFINITY)
    }

    fn width_m(orchard: &Orchard, wood: WoodTest) -> f64 {
        let target = Target {
            extent: Some(crate::scan::Extent { low: [-0.1, 0.4, 0.0], high: [0.1, 0.6, 1.0] }),
            ..Target::whole(orchard)
        };
        let settings = ScanSettings {
            kind: ScanKind::LateralOrthogonal,
            dy_m: 1e-4,
            pitch_m: 0.1,
            wood,
            ..ScanSettings::default()
        };
        let plan = ScanPlan::new(&target, &settings).unwrap();
        plan.areas(wood.caster(orchard).unwrap().as_ref()).total_m2
    }

    #[test]
    fn a_mesh_widens_a_post_by_its_own_width() {
        for (diameter_m, half_width_m) in [(0.02, 1e-3), (0.01, 2e-3), (0.05, 0.0)] {
            let mesh = WoodTest::Mesh(Mesh { half_width_m, ..Mesh::default() });
            let post = post(diameter_m);
            let (exact, widened) = (width_m(&post, WoodTest::Exact), width_m(&post, mesh));
            assert!((exact - diameter_m).abs() < 2.1e-4, "{exact}");
            assert!((widened - diameter_m - 2.0 * half_width_m).abs() < 4e-4, "{diameter_m}: {widened}");
        }
    }

    #[test]
    fn a_coarse_step_goes_over_a_thin_twig() {
        // The twig stands at 2.5 m: a multiple of 0.05 m, not of 0.07 m.
        let point = |step_m| WoodTest::Mesh(Mesh { half_width_m: 0.0, points: 1, step_m });
        let twig = post(0.002);
        assert!(width_m(&twig, point(1e-4)) > 0.0015);
        assert!(width_m(&twig, point(0.05)) > 0.0015);
        assert!(width_m(&twig, point(0.07)) <= 0.0);
    }

    #[test]
    fn what_is_no_mesh_is_refused() {
        let good = Mesh::default();
        for bad in [
            Mesh { half_width_m: -1.0, ..good },
            Mesh { points: 0, ..good },
            Mesh { half_width_m: 1e308, step_m: 1e-300, ..good },
            Mesh { half_width_m: 1.1, ..good },
            Mesh { step_m: 1e-7, ..good },
            Mesh { points: 100, ..good },
            Mesh { step_m: 0.0, ..good },
            Mesh { step_m: f64::NAN, ..good },
        ] {
            assert_eq!(bad.validate().map_err(|error| error.to_string().contains("mesh needs")), Err(true));
        }
    }
}
