//! The shady index: how much of the sphere around a leaf other leaves hide.

mod blades;
mod cells;
mod cover;
mod open;
mod pass;
mod shadow;

use glam::DVec3;
use rayon::prelude::*;

use self::blades::{Blades, Plane};
use self::pass::ShadePass;
pub use super::options::{RaySet, RayWeight, ShadeScope};
use super::parameters::TreeParameters;
use crate::angle::cos_sin_deg;
use crate::organ::Leaf;

/// A line through every leaf's middle, with the weights of its two half-lines.
#[derive(Clone, Copy, Debug, PartialEq)]
struct RayPair {
    direction: DVec3,
    ahead: f64,
    behind: f64,
}

/// Which leaves stay: those shaded less than the threshold. Above 100 % all do, and nothing is computed.
pub(crate) fn survivors(leaves: &[&Leaf], parameters: &TreeParameters) -> Vec<bool> {
    if parameters.shady_percent > 100.0 {
        return vec![true; leaves.len()];
    }
    let ratios = shaded_percent(leaves, parameters.shady_rays, parameters.shady_weight);
    ratios.iter().map(|ratio| *ratio < parameters.shady_percent).collect()
}

/// How much of its surroundings other leaves hide from each leaf: 100 · (weight of the half-lines from its centroid that
/// meet another leaf) / (weight of all). Wood does not count. Every leaf is judged with all others in place.
pub fn shaded_percent(leaves: &[&Leaf], rays: RaySet, weight: RayWeight) -> Vec<f64> {
    let lines = lines(rays, weight);
    let all: f64 = lines.iter().map(|line| line.ahead + line.behind).sum();
    let blades = Blades::new(leaves);
    let met: Vec<Vec<[bool; 2]>> = lines
        .par_iter()
        .map(|line| ShadePass { plane: Plane::square_to(line.direction), blades: &blades }.run())
        .collect();
    let mut hidden = vec![0.0; leaves.len()];
    // Line by line in order: the sum is the same on any number of threads.
    for (line, met) in lines.iter().zip(&met) {
        for (blade, [ahead, behind]) in blades.blades.iter().zip(met) {
            let Some(sum) = hidden.get_mut(blade.number) else { continue };
            *sum += f64::from(u8::from(*ahead)) * line.ahead + f64::from(u8::from(*behind)) * line.behind;
        }
    }
    // A full sum in another order could exceed the whole by a rounding.
    hidden.iter().map(|sum| (100.0 * sum / all).min(100.0)).collect()
}

/// The half-lines of a set, opposite ones joined: 45 lines.
fn lines(rays: RaySet, weight: RayWeight) -> Vec<RayPair> {
    let mut lines = Vec::with_capacity(45);
    let mut push = |elevation_deg: i32, bearing_deg: i32, ahead: f64, behind: f64| {
        let (cos_e, sin_e) = cos_sin_deg(f64::from(elevation_deg));
        let (cos_b, sin_b) = cos_sin_deg(f64::from(bearing_deg));
        let direction = DVec3::new(cos_e * cos_b, cos_e * sin_b, sin_e);
        lines.push(RayPair { direction, ahead, behind });
    };
    // How often the literal loops meet a direction. Both loop ends count 0° and 360° as two bearings.
    let seam =
        |bearing_deg: i32| if rays == RaySet::Literal117 && bearing_deg % 360 == 0 { 2.0 } else { 1.0 };
    let pole = match rays {
        RaySet::Literal117 => 9.0,
        RaySet::Literal104 => 8.0,
        RaySet::Distinct90 | RaySet::Upper49 => 1.0,
    };
    let below = if rays == RaySet::Upper49 { 0.0 } else { 1.0 };
    let (solid, cap) = match weight {
        RayWeight::Count => (None, 1.0),
        // A cell of the grid 45° × 15° and the cap of half a step at a pole, over the same factor π/4.
        RayWeight::Cos => (Some(2.0 * cos_sin_deg(7.5).1), 8.0 * (1.0 - cos_sin_deg(7.5).0)),
    };
    let cell = |elevation_deg: i32| solid.map_or(1.0, |step| step * cos_sin_deg(f64::from(elevation_deg)).0);
    for elevation_deg in (15..=75).step_by(15) {
        for bearing_deg in (0..360).step_by(45) {
            let each = cell(elevation_deg);
            // The opposite half-line looks down at the bearing half a turn on.
            push(
                elevation_deg,
                bearing_deg,
                each * seam(bearing_deg),
                each * below * seam(bearing_deg + 180),
            );
        }
    }
    for bearing_deg in (0..180).step_by(45) {
        push(0, bearing_deg, cell(0) * seam(bearing_deg), cell(0) * seam(bearing_deg + 180));
    }
    push(90, 0, cap * pole, cap * pole * below);
    lines
}

#[cfg(test)]
mod tests {
    use pulp::WithSimd;

    use super::open::START_M;
    use super::pass::{DENSE, EDGE_ON};
    use super::*;
    use crate::generator::plant::grow_lone_tree;
    use crate::seed::Purpose;

    fn square(middle: [f64; 3], half: f64) -> Leaf {
        let [x, y, z] = middle;
        let at = |u: f64, v: f64| [x + u * half, y + v * half, z];
        Leaf::new(vec![at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)]).unwrap()
    }

    fn weight(rays: RaySet, weight: RayWeight) -> f64 {
        lines(rays, weight).iter().map(|line| line.ahead + line.behind).sum()
    }

    #[test]
    fn ray_sets_hold_the_rays_they_are_named_for() {
        for (rays, count) in [
            (RaySet::Distinct90, 90.0),
            (RaySet::Literal117, 117.0),
            (RaySet::Literal104, 104.0),
            (RaySet::Upper49, 49.0),
        ] {
            assert_eq!(weight(rays, RayWeight::Count), count, "{rays}");
        }
        // The cells and caps of the sphere: 4π over the common factor π/4.
        assert!((weight(RaySet::Distinct90, RayWeight::Cos) - 16.0).abs() < 1e-12);
    }

    #[test]
    fn a_lone_leaf_is_not_shaded_and_a_roof_shades_the_cone_under_it() {
        let roof = square([0.0, 0.0, 1.0], 1.01);
        let below = square([0.0, 0.0, 0.0], 0.01);
        assert_eq!(shaded_percent(&[&below], RaySet::Distinct90, RayWeight::Count), [0.0]);
        // The roof's sides stand at elevation 44.7° and its corners at 35°: at each of eight bearings it hides 45°, 60° and
        // 75°, and the zenith.
        let ratios = shaded_percent(&[&below, &roof], RaySet::Distinct90, RayWeight::Count);
        let hidden = 8 * 3 + 1;
        assert!((ratios[0] - 100.0 * f64::from(hidden) / 90.0).abs() < 1e-9, "{ratios:?}");
        assert!((ratios[1] - 100.0 / 90.0).abs() < 1e-9, "only straight down: {ratios:?}");
    }

    #[test]
    fn the_grid_agrees_with_asking_every_leaf() {
        let tree = grow_lone_tree(&TreeParameters { iterations: 8, ..TreeParameters::default() }, 3);
        let leaves: Vec<&Leaf> = tree.leaves.iter().collect();
        assert!(leaves.len() > 150, "{}", leaves.len());
        assert_agrees_with_asking_every_leaf(&leaves);
    }

    /// Leaves at random in a ball so small that some ten lie behind each other: three vertices, five with a notch, eight, and eleven.
    fn dense_crown() -> Vec<Leaf> {
        let mut stream = Purpose::Growth.stream(7, 0, 0);
        let mut unit = || 2.0 * stream.unit() - 1.0;
        let leaf = |number: usize| {
            let mut within = || loop {
                let at = DVec3::new(unit(), unit(), unit());
                if at.length_squared() <= 1.0 {
                    return at;
                }
            };
            let (foot, along) = (0.14 * within(), within().normalize());
            let across = along.cross(within()).normalize();
            let vertices = [3, 5, 8, 11][number % 4];
            let vertex = |k: usize| {
                let (cos, sin) = cos_sin_deg(360.0 * k as f64 / vertices as f64);
                let radius = if vertices == 5 && k == 0 { -0.01 } else { 0.03 };
                (foot + radius * (cos * along + 0.7 * sin * across)).to_array()
            };
            Leaf::new((0..vertices).map(vertex).collect::<Vec<_>>()).unwrap()
        };
        (0..2000).map(leaf).collect()
    }

    #[test]
    fn the_cover_of_a_dense_crown_agrees_with_asking_every_leaf() {
        let leaves = dense_crown();
        let leaves: Vec<&Leaf> = leaves.iter().collect();
        let width_m = 2.0 * (0.14 + 0.03);
        assert!(0.5 * Blades::new(&leaves).area_m2 > DENSE * width_m * width_m, "no cover");
        assert_agrees_with_asking_every_leaf(&leaves);
    }

    #[test]
    fn one_number_at_a_time_gives_the_same_bits() {
        let leaves = dense_crown();
        let blades = Blades::new(&leaves.iter().collect::<Vec<_>>());
        for line in lines(RaySet::Distinct90, RayWeight::Count) {
            let pass = || ShadePass { plane: Plane::square_to(line.direction), blades: &blades };
            assert_eq!(pass().run(), pass().with_simd(pulp::Scalar::new()));
        }
    }

    fn assert_agrees_with_asking_every_leaf(leaves: &[&Leaf]) {
        let fast = shaded_percent(leaves, RaySet::Distinct90, RayWeight::Count);
        let origin = |leaf: &Leaf| DVec3::from_array(leaf.centroid());
        let (mut met, mut all) = (vec![0u32; leaves.len()], 0);
        for line in lines(RaySet::Distinct90, RayWeight::Count) {
            for direction in [line.direction, -line.direction] {
                all += 1;
                for (i, leaf) in leaves.iter().enumerate() {
                    let start = origin(leaf);
                    let others = leaves.iter().enumerate().filter(|(j, _)| *j != i);
                    met[i] += u32::from(others.into_iter().any(|(_, other)| meets(other, start, direction)));
                }
            }
        }
        assert_eq!(all, 90);
        for (ratio, met) in fast.iter().zip(met) {
            assert!((ratio - 100.0 * f64::from(met) / 90.0).abs() < 1e-9);
        }
    }

    /// Half-line against polygon by winding angle in the leaf's own plane: another way than the grid's.
    fn meets(leaf: &Leaf, start: DVec3, direction: DVec3) -> bool {
        let normal = DVec3::from_array(leaf.normal());
        let facing = direction.dot(normal);
        if facing.abs() < EDGE_ON {
            return false;
        }
        let vertices: Vec<DVec3> = leaf.outline().iter().map(|v| DVec3::from_array(*v)).collect();
        let distance = (vertices[0] - start).dot(normal) / facing;
        let at = start + direction * distance;
        let far = vertices.iter().map(|vertex| vertex.distance(vertices[0])).fold(0.0, f64::max);
        if distance <= START_M || at.distance(vertices[0]) > far {
            return false;
        }
        let turn: f64 = (0..vertices.len())
            .map(|k| {
                let (a, b) = (vertices[k] - at, vertices[(k + 1) % vertices.len()] - at);
                a.cross(b).dot(normal).atan2(a.dot(b))
            })
            .sum();
        turn.abs() > 3.0
    }

    #[test]
    fn a_leaf_more_never_lowers_the_shade_of_another() {
        let tree = grow_lone_tree(&TreeParameters { iterations: 7, ..TreeParameters::default() }, 5);
        let leaves: Vec<&Leaf> = tree.leaves.iter().collect();
        let fewer = leaves.get(..leaves.len() / 2).unwrap();
        for (rays, weight) in [(RaySet::Literal117, RayWeight::Count), (RaySet::Upper49, RayWeight::Cos)] {
            let (few, all) = (shaded_percent(fewer, rays, weight), shaded_percent(&leaves, rays, weight));
            assert!(few.iter().zip(&all).all(|(a, b)| a <= b));
            assert!(all.iter().all(|ratio| (0.0..=100.0).contains(ratio)));
        }
    }
}
