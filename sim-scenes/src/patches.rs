//! Organs as small patches of surface: what is asked of a surface point by point, such as whether a beam reaches it.

use glam::DVec3;

use crate::organ::{Cylinder, Leaf};

/// Length of a patch that is as wide as long, metres; the greatest of a piece of a branch.
const PATCH_M: f64 = 0.02;
/// Most steps along an edge: an organ of odd size may not exhaust the time.
const MOST_STEPS: f64 = 500.0;
/// Fewest patches about a branch.
const AROUND: usize = 12;

/// A small piece of surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// Its middle, metres.
    pub at: [f64; 3],
    /// Its unit normal: outwards on a branch, either way on a blade.
    pub normal: [f64; 3],
    /// Its area, m²; negative where a blade that is not convex is counted back.
    pub area_m2: f64,
    /// The point of the axis that it belongs to; on a blade the middle itself.
    pub foot: [f64; 3],
}

/// Hands out the patches of a blade (one face). Triangles about the first vertex carry their sign, so that a notch counts nothing.
pub fn of_blade(blade: &Leaf, mut each: impl FnMut(Patch)) {
    let normal = DVec3::from_array(blade.normal());
    let Some((first, rest)) = blade.outline().split_first() else { return };
    let first = DVec3::from_array(*first);
    for pair in rest.windows(2) {
        let [a, b] = pair else { continue };
        let (a, b) = (DVec3::from_array(*a) - first, DVec3::from_array(*b) - first);
        let (longest_m, twice_m2) = (a.length().max(b.length()).max(a.distance(b)), a.cross(b).dot(normal));
        // By its area; a sliver, which is long for its area, somewhat finer.
        let steps = steps_of(twice_m2.abs().sqrt()).max(steps_of(longest_m / 4.0));
        let area_m2 = twice_m2 / 2.0 / (steps * steps) as f64;
        for [u, v] in middles(steps) {
            let at = (first + u * a + v * b).to_array();
            each(Patch { at, normal: normal.to_array(), area_m2, foot: at });
        }
    }
}

/// Hands out the patches of a branch's lateral surface.
pub fn of_branch(piece: &Cylinder, mut each: impl FnMut(Patch)) {
    let (base, tip) = (DVec3::from_array(piece.base()), DVec3::from_array(piece.tip()));
    let (aside, ahead) = ((tip - base) / piece.length_m()).any_orthonormal_pair();
    let steps = steps_of(piece.length_m());
    let around = steps_of(std::f64::consts::TAU * piece.radius_m()).max(AROUND);
    let area_m2 = piece.area_m2() / (steps * around) as f64;
    for step in 0..steps {
        let foot = base.lerp(tip, (step as f64 + 0.5) / steps as f64);
        for place in 0..around {
            let angle = std::f64::consts::TAU * (place as f64 + 0.5) / around as f64;
            let normal = aside * libm::cos(angle) + ahead * libm::sin(angle);
            let at = (foot + normal * piece.radius_m()).to_array();
            each(Patch { at, normal: normal.to_array(), area_m2, foot: foot.to_array() });
        }
    }
}

fn steps_of(length_m: f64) -> usize {
    (length_m / PATCH_M).ceil().clamp(1.0, MOST_STEPS) as usize
}

/// Middles of the n² triangles of equal size that a triangle is cut into, as shares of its two edges.
fn middles(n: usize) -> impl Iterator<Item = [f64; 2]> {
    let at = move |i: usize, j: usize, thirds: f64| {
        [(i as f64 + thirds / 3.0) / n as f64, (j as f64 + thirds / 3.0) / n as f64]
    };
    (0..n).flat_map(move |i| {
        let upright = (0..n - i).map(move |j| at(i, j, 1.0));
        let upside_down = (0..(n - i).saturating_sub(1)).map(move |j| at(i, j, 2.0));
        upright.chain(upside_down)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn middles_are_of_all_the_parts_and_average_to_the_centroid() {
        for n in [1, 2, 7] {
            let all: Vec<_> = middles(n).collect();
            assert_eq!(all.len(), n * n);
            for k in 0..2 {
                let mean = all.iter().map(|m| m[k]).sum::<f64>() / all.len() as f64;
                assert!((mean - 1.0 / 3.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn patches_add_up_to_the_organ_and_a_notch_counts_nothing() {
        // A U of area 7 in the plane x = 0.
        let flat =
            [(0.0, 0.0), (3.0, 0.0), (3.0, 3.0), (2.0, 3.0), (2.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0)];
        let outline: Vec<[f64; 3]> = flat.iter().map(|&(y, z)| [0.0, y, z]).collect();
        let blade = Leaf::new(outline).unwrap();
        let (mut area_m2, mut in_notch_m2) = (0.0, 0.0);
        of_blade(&blade, |patch| {
            area_m2 += patch.area_m2;
            let [_, y, z] = patch.at;
            if (1.1..1.9).contains(&y) && z > 1.1 {
                in_notch_m2 += patch.area_m2;
            }
        });
        assert!((area_m2 - 7.0).abs() < 1e-9 && in_notch_m2.abs() < 0.05, "{area_m2} {in_notch_m2}");
        let piece = Cylinder::new([0.0, 0.0, 1.0], [1.0, 1.0, 2.0], 0.05).unwrap();
        let mut area_m2 = 0.0;
        of_branch(&piece, |patch| {
            area_m2 += patch.area_m2;
            let off = DVec3::from_array(patch.at).distance(DVec3::from_array(patch.foot));
            assert!((off - 0.05).abs() < 1e-12);
        });
        assert!((area_m2 / piece.area_m2() - 1.0).abs() < 1e-12);
    }
}
