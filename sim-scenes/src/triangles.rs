//! Polygons as triangles, and whether they are simple.

use glam::{DVec2, DVec3};

/// The triangles of a simple polygon by the numbers of its corners, convex or not, plane or a little bent: as they lie in the plane with this normal.
///
/// Ears are cut off one by one. A polygon that crosses itself gives a fan of what is left, so that something is drawn.
pub fn triangulate(outline: &[[f64; 3]], normal: [f64; 3]) -> Vec<[usize; 3]> {
    let flat = flatten(outline, DVec3::from_array(normal));
    let mut left: Vec<usize> = (0..flat.len()).collect();
    let mut triangles = Vec::with_capacity(flat.len().saturating_sub(2));
    while left.len() > 3 {
        let Some(ear) = (0..left.len()).find(|&at| is_ear(&flat, &left, at)) else { break };
        triangles.push(around(&left, ear));
        left.remove(ear);
    }
    let rest = left.windows(2).skip(1).filter_map(|pair| Some([*left.first()?, pair[0], pair[1]]));
    triangles.extend(rest);
    triangles
}

/// True if two edges of the polygon cross where they share no corner, seen along `normal`: it has no one area then.
pub fn crosses_itself(outline: &[[f64; 3]], normal: [f64; 3]) -> bool {
    let flat = flatten(outline, DVec3::from_array(normal));
    let edges: Vec<[DVec2; 2]> =
        flat.iter().zip(flat.iter().cycle().skip(1)).map(|(a, b)| [*a, *b]).collect();
    let parts = |[a, b]: [DVec2; 2], [c, d]: [DVec2; 2]| {
        let side = |p: DVec2| (b - a).perp_dot(p - a);
        side(c) * side(d) < 0.0
    };
    let crosses = |one: [DVec2; 2], other: [DVec2; 2]| parts(one, other) && parts(other, one);
    edges
        .iter()
        .enumerate()
        .any(|(number, one)| edges.iter().skip(number + 2).any(|other| crosses(*one, *other)))
}

/// The polygon in its plane, counter-clockwise.
fn flatten(outline: &[[f64; 3]], normal: DVec3) -> Vec<DVec2> {
    let u = normal.any_orthonormal_vector();
    let v = normal.cross(u);
    outline.iter().map(|vertex| DVec3::from_array(*vertex)).map(|p| DVec2::new(p.dot(u), p.dot(v))).collect()
}

fn around(left: &[usize], at: usize) -> [usize; 3] {
    let count = left.len();
    [left[(at + count - 1) % count], left[at], left[(at + 1) % count]]
}

fn is_ear(flat: &[DVec2], left: &[usize], at: usize) -> bool {
    let ear = around(left, at);
    let [a, b, c] = ear.map(|corner| flat[corner]);
    let side = |a: DVec2, b: DVec2, p: DVec2| (b - a).perp_dot(p - a);
    let inside = |p: DVec2| side(a, b, p) >= 0.0 && side(b, c, p) >= 0.0 && side(c, a, p) >= 0.0;
    side(a, b, c) > 0.0 && left.iter().all(|corner| ear.contains(corner) || !inside(flat[*corner]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_triangles_of_a_notched_polygon_have_its_area_and_leave_the_notch_out() {
        let flat =
            [(0.0, 0.0), (3.0, 0.0), (3.0, 3.0), (2.0, 3.0), (2.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0)];
        let outline: Vec<[f64; 3]> = flat.iter().map(|&(x, y)| [x, y, 0.0]).collect();
        let triangles = triangulate(&outline, [0.0, 0.0, 1.0]);
        let area = |[a, b, c]: &[usize; 3]| {
            let at = |k: &usize| DVec2::new(flat[*k].0, flat[*k].1);
            0.5 * (at(b) - at(a)).perp_dot(at(c) - at(a))
        };
        assert_eq!(triangles.len(), 6);
        assert!(triangles.iter().all(|triangle| area(triangle) > 0.0));
        assert!((triangles.iter().map(area).sum::<f64>() - 7.0).abs() < 1e-12);
    }
}
