//! The envelope prune: what a hedger and a tidy grower would cut.

use glam::DVec3;

use super::parameters::TreeParameters;
use crate::angle::cos_sin_deg;
use crate::generator::draft::{Draft, Segment};

/// A length below which a stump is not worth a cylinder, metres.
const SHORTEST_STUMP_M: f64 = 1e-6;

/// The room a pruned tree keeps to, in tree coordinates: within half-spaces, and outside a hollow cone where there is one.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Envelope {
    walls: Vec<HalfSpace>,
    bottom_m: f64,
    hollow: Option<Hollow>,
}

/// Points p with p · normal ≤ level.
#[derive(Clone, Copy, Debug, PartialEq)]
struct HalfSpace {
    normal: DVec3,
    level: f64,
}

/// A cone about the vertical through the foot, open to the sky.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Hollow {
    apex_m: f64,
    tan_square: f64,
}

impl Envelope {
    /// The envelope of a tree; None where it is not pruned.
    pub(crate) fn of(parameters: &TreeParameters) -> Option<Self> {
        if !parameters.pruned {
            return None;
        }
        let (bottom_m, top_m) = (parameters.clear_trunk_m, parameters.envelope_top_m);
        let half_m = parameters.envelope_half_width_m;
        let top_half_m = match parameters.envelope_top_half_width_m {
            0.0 => half_m,
            tapered_m => tapered_m,
        };
        // |x| ≤ half + slope · (z − bottom)
        let slope = (top_half_m - half_m) / (top_m - bottom_m);
        let side =
            |sign: f64| HalfSpace { normal: DVec3::new(sign, 0.0, -slope), level: half_m - slope * bottom_m };
        let mut walls = vec![side(1.0), side(-1.0), HalfSpace { normal: DVec3::Z, level: top_m }];
        if parameters.envelope_half_length_m > 0.0 {
            let level = parameters.envelope_half_length_m;
            walls.extend([DVec3::Y, DVec3::NEG_Y].map(|normal| HalfSpace { normal, level }));
        }
        let hollow = (parameters.hollow_deg > 0.0).then(|| {
            let (cos, sin) = cos_sin_deg(parameters.hollow_deg);
            Hollow { apex_m: parameters.hollow_from_m, tan_square: (sin / cos) * (sin / cos) }
        });
        Some(Self { walls, bottom_m, hollow })
    }

    /// True within the envelope, borders included.
    pub(crate) fn contains(&self, point: [f64; 3]) -> bool {
        let point = DVec3::from_array(point);
        point.z >= self.bottom_m
            && self.walls.iter().all(|wall| point.dot(wall.normal) <= wall.level)
            && self.hollow.is_none_or(|hollow| !hollow.holds(point))
    }

    /// How far one can go from `base` in `direction` before leaving; the bottom does not bound the trunk.
    fn reach_m(&self, base: DVec3, direction: DVec3, is_trunk: bool) -> f64 {
        let bottom = HalfSpace { normal: DVec3::NEG_Z, level: -self.bottom_m };
        let walls = self.walls.iter().chain((!is_trunk).then_some(&bottom));
        let inside = walls.fold(f64::INFINITY, |reach, wall| {
            let (here, along) = (base.dot(wall.normal), direction.dot(wall.normal));
            let until = if here > wall.level {
                0.0
            } else if along > 0.0 {
                (wall.level - here) / along
            } else {
                f64::INFINITY
            };
            reach.min(until)
        });
        self.hollow.map_or(inside, |hollow| inside.min(hollow.entry_m(base, direction)))
    }
}

impl Hollow {
    fn holds(&self, point: DVec3) -> bool {
        let up = point.z - self.apex_m;
        up > 0.0 && point.x * point.x + point.y * point.y < self.tan_square * up * up
    }

    /// How far from `base` one can go in `direction` before entering.
    fn entry_m(&self, base: DVec3, direction: DVec3) -> f64 {
        if self.holds(base) {
            return 0.0;
        }
        // x² + y² − tan² (z − apex)² along the ray: a s² + 2 b s + c.
        let form = |p: DVec3, q: DVec3| p.x * q.x + p.y * q.y - self.tan_square * p.z * q.z;
        let from = base - DVec3::Z * self.apex_m;
        let (a, b, c) = (form(direction, direction), form(from, direction), form(from, from));
        let root = (b * b - a * c).max(0.0).sqrt();
        let mut borders = if a == 0.0 { [-c / (2.0 * b); 2] } else { [(-b - root) / a, (-b + root) / a] };
        borders.sort_by(f64::total_cmp);
        // A border is an entry if just beyond it lies the hollow.
        let enters = |at: &f64| *at >= 0.0 && self.holds(base + direction * (at + SHORTEST_STUMP_M));
        borders.into_iter().find(enters).unwrap_or(f64::INFINITY)
    }
}

/// Cuts a draft back. A branch is cut where it leaves the envelope, and all that stands beyond the cut falls with it, so that
/// nothing floats; a leaf falls with its metamer, or if a vertex of it lies outside.
pub(crate) fn cut(draft: &mut Draft, envelope: Option<&Envelope>) {
    let Some(envelope) = envelope else { return };
    let kept_m = kept_lengths(&draft.segments, envelope);
    draft.blades.retain(|blade| {
        kept_m.get(blade.segment).is_some_and(|kept| blade.along_m <= *kept)
            && blade.leaf.outline().iter().all(|vertex| envelope.contains(*vertex))
    });
    draft.fruits.retain(|fruit| {
        kept_m.get(fruit.segment).is_some_and(|kept| fruit.along_m <= *kept)
            && envelope.contains(fruit.middle.to_array())
    });
    for (segment, kept) in draft.segments.iter_mut().zip(kept_m) {
        segment.length_m = kept;
    }
}

/// Length (metres) of every segment that is left.
fn kept_lengths(segments: &[Segment], envelope: &Envelope) -> Vec<f64> {
    let mut kept: Vec<f64> = Vec::with_capacity(segments.len());
    for segment in segments {
        let stands = segment
            .bearer
            .is_none_or(|bearer| kept.get(bearer).is_some_and(|kept| segment.bearer_m <= *kept));
        let length = if stands {
            segment.length_m.min(envelope.reach_m(segment.base, segment.direction, segment.is_trunk))
        } else {
            0.0
        };
        kept.push(if length < SHORTEST_STUMP_M { 0.0 } else { length });
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generator::GeneratorKind;
    use crate::generator::draft::Age;
    use crate::generator::plant::grow_lone_tree;
    use crate::orchard::Preset;

    #[test]
    fn nothing_but_the_trunk_leaves_the_envelope() {
        let parameters = TreeParameters { iterations: 9, ..Preset::Spindle.tree(GeneratorKind::Hmt) };
        let mut cut = 0;
        for seed in 1..=6 {
            let tree = grow_lone_tree(&parameters, seed);
            let whole = grow_lone_tree(&TreeParameters { pruned: false, ..parameters.clone() }, seed);
            cut += whole.leaves.len() - tree.leaves.len();
            let inside =
                |[x, _, z]: [f64; 3]| x.abs() <= 1.1 + 1e-9 && (0.5 - 1e-9..=3.6 + 1e-9).contains(&z);
            assert!(tree.leaves.iter().flat_map(|leaf| leaf.outline()).all(|v| inside(*v)));
            // The trunk rises from the ground; all other wood lies within.
            assert_eq!(tree.wood[0].base(), [0.0; 3]);
            assert!(tree.wood[1..].iter().all(|piece| inside(piece.base()) && inside(piece.tip())));
            assert!(whole.leaves.len() >= tree.leaves.len() && whole.wood.len() >= tree.wood.len());
        }
        assert!(cut > 100, "the shears did something: {cut}");
    }

    fn segment(bearer: Option<usize>, bearer_m: f64, base: DVec3, direction: DVec3) -> Segment {
        let is_trunk = bearer.is_none();
        Segment {
            bearer,
            bearer_m,
            base,
            direction,
            length_m: 2.0,
            radius_m: 0.01,
            is_trunk,
            age: Age::Unknown,
        }
    }

    #[test]
    fn wood_ends_at_its_crossing_and_what_it_bore_falls() {
        let shears = TreeParameters {
            pruned: true,
            envelope_half_width_m: 1.0,
            clear_trunk_m: 0.5,
            envelope_top_m: 3.0,
            ..TreeParameters::default()
        };
        let segments = [
            segment(None, 0.0, DVec3::ZERO, DVec3::Z),
            segment(Some(0), 2.0, DVec3::new(0.0, 0.0, 2.0), DVec3::X),
            segment(Some(1), 1.0, DVec3::new(1.0, 0.0, 2.0), DVec3::NEG_X),
            segment(Some(1), 1.1, DVec3::new(1.1, 0.0, 2.0), DVec3::NEG_X),
            segment(Some(0), 0.2, DVec3::new(0.0, 0.0, 0.2), DVec3::X),
            segment(Some(0), 1.9, DVec3::new(0.0, 0.0, 1.9), DVec3::Y),
        ];
        let kept = |parameters: &TreeParameters| kept_lengths(&segments, &Envelope::of(parameters).unwrap());
        // Trunk whole; branch to x = 1; its last living node bears; one node on does not; below the clear height nothing; along
        // the row nothing is cut.
        assert_eq!(kept(&shears), [2.0, 1.0, 2.0, 0.0, 0.0, 2.0]);
        // Half as wide at the top: at z = 2, three fifths of the way up, 0.7 are left, and what stood beyond falls.
        let tapered = kept(&TreeParameters { envelope_top_half_width_m: 0.5, ..shears.clone() });
        assert!((tapered[1] - 0.7).abs() < 1e-12 && tapered[2] == 0.0, "{tapered:?}");
        let short = kept(&TreeParameters { envelope_half_length_m: 0.25, ..shears.clone() });
        assert_eq!(short[5], 0.25);
        assert!(Envelope::of(&TreeParameters { pruned: false, ..shears }).is_none());
    }

    #[test]
    fn the_hollow_stops_what_grows_into_it_and_nothing_beside_it() {
        let hollow = Hollow { apex_m: 1.0, tan_square: 1.0 };
        // Level towards the middle at z = 2: the cone begins at x = 1.
        assert!((hollow.entry_m(DVec3::new(1.5, 0.0, 2.0), DVec3::NEG_X) - 0.5).abs() < 1e-9);
        assert_eq!(hollow.entry_m(DVec3::new(1.5, 0.0, 2.0), DVec3::X), f64::INFINITY);
        // Up the axis from below: to the apex. At 60° from the vertical from below the apex: never. Inside: not at all.
        assert!((hollow.entry_m(DVec3::ZERO, DVec3::Z) - 1.0).abs() < 1e-5);
        let (cos, sin) = cos_sin_deg(60.0);
        assert_eq!(hollow.entry_m(DVec3::Z * 0.9, DVec3::new(sin, 0.0, cos)), f64::INFINITY);
        assert_eq!(hollow.entry_m(DVec3::Z * 1.5, DVec3::X), 0.0);
        assert!(!hollow.holds(DVec3::new(0.0, 0.0, 0.5)) && hollow.holds(DVec3::new(0.5, 0.0, 2.0)));
    }
}
