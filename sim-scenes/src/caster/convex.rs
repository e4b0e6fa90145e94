//! Leaves as convex pieces.

use glam::{DVec2, DVec3};

use crate::organ::Leaf;

/// A turn less than this part of the outline's square is straight.
const STRAIGHT: f64 = 1e-12;

/// The outline itself where it is convex; triangles that fill it where it is not.
pub(crate) fn pieces(leaf: &Leaf) -> Vec<Vec<[f64; 3]>> {
    parts(leaf).unwrap_or_else(|| vec![leaf.outline().to_vec()])
}

/// Triangles that fill the outline; none where it is convex. They use the outline's own vertices, so that two that share an edge share every
/// crossing of it to the last bit.
pub(crate) fn parts(leaf: &Leaf) -> Option<Vec<Vec<[f64; 3]>>> {
    let outline = leaf.outline();
    let normal = DVec3::from_array(leaf.normal());
    let (u_axis, v_axis) = normal.any_orthonormal_pair();
    let flat: Vec<DVec2> = outline
        .iter()
        .map(|vertex| DVec3::from_array(*vertex))
        .map(|vertex| DVec2::new(vertex.dot(u_axis), vertex.dot(v_axis)))
        .collect();
    let largest = flat.iter().fold(DVec2::ZERO, |sum, at| sum.max((*at - flat[0]).abs()));
    let straight = STRAIGHT * largest.length_squared();
    let corner = |i: usize, j: usize, k: usize| (flat[j] - flat[i]).perp_dot(flat[k] - flat[j]);
    let n = flat.len();
    // Counter-clockwise about the normal by its definition. One turn in all, or it would be a star that crosses itself.
    let left = (0..n).all(|i| corner((i + n - 1) % n, i, (i + 1) % n) >= -straight);
    if left && (1..n - 1).all(|i| corner(0, i, i + 1) >= -straight) {
        return None;
    }
    let mut rest: Vec<usize> = (0..n).collect();
    let mut pieces = Vec::with_capacity(n - 2);
    while rest.len() > 3 {
        let m = rest.len();
        let around = |i: usize| (rest[(i + m - 1) % m], rest[i], rest[(i + 1) % m]);
        let is_ear = |i: usize| {
            let (a, b, c) = around(i);
            let holds = |p: usize| corner(a, b, p) >= 0.0 && corner(b, c, p) >= 0.0 && corner(c, a, p) >= 0.0;
            corner(a, b, c) > 0.0 && !rest.iter().any(|p| ![a, b, c].contains(p) && holds(*p))
        };
        // The ear that is least of a sliver; a simple polygon has one, rounding aside.
        let ears = (0..m).filter(|i| is_ear(*i));
        let area = |i: usize| {
            let (a, b, c) = around(i);
            corner(a, b, c)
        };
        let best = ears.max_by(|i, j| area(*i).total_cmp(&area(*j))).unwrap_or(0);
        let (a, b, c) = around(best);
        pieces.push(vec![outline[a], outline[b], outline[c]]);
        rest.remove(best);
    }
    pieces.push(rest.iter().map(|i| outline[*i]).collect());
    Some(pieces)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(outline: &[[f64; 3]]) -> f64 {
        Leaf::new(outline.to_vec()).map_or(0.0, |leaf| leaf.area_m2())
    }

    #[test]
    fn a_convex_leaf_is_one_piece_and_a_notched_one_is_filled_by_triangles() {
        let square = [[0.0, 0.0, 0.0], [2.0, 0.0, 1.0], [2.0, 2.0, 2.0], [0.0, 2.0, 1.0]];
        assert_eq!(pieces(&Leaf::new(square).unwrap()), [square.to_vec()]);
        let u = [(0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)];
        for clockwise in [false, true] {
            let mut outline: Vec<[f64; 3]> =
                u.iter().map(|&(x, z)| [f64::from(x), f64::from(x), f64::from(z)]).collect();
            if clockwise {
                outline.reverse();
            }
            let leaf = Leaf::new(outline).unwrap();
            let pieces = pieces(&leaf);
            assert_eq!(pieces.len(), 6);
            let sum: f64 = pieces.iter().map(|piece| area(piece)).sum();
            assert!((sum - leaf.area_m2()).abs() < 1e-12, "{sum}");
        }
    }
}
