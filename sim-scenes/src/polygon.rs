//! Plane polygons in space: area, centroid, and the part below a level of one coordinate.

use glam::DVec3;

/// Area times unit normal, right-handed about the outline (Newell). Exact for any simple polygon, convex or not.
pub fn vector_area(outline: &[[f64; 3]]) -> DVec3 {
    fan(outline).map(|(a, b)| 0.5 * a.cross(b)).sum()
}

/// Area centroid; the first vertex where the polygon has no area.
pub(crate) fn centroid(outline: &[[f64; 3]]) -> DVec3 {
    let Some(origin) = outline.first().map(|v| DVec3::from_array(*v)) else { return DVec3::ZERO };
    let total = vector_area(outline);
    let square = total.length_squared();
    if square == 0.0 {
        return origin;
    }
    let moment: DVec3 = fan(outline).map(|(a, b)| (a + b) / 3.0 * (0.5 * a.cross(b).dot(total))).sum();
    origin + moment / square
}

/// One-sided area (m²) of the part of the polygon whose coordinate `axis` (0, 1, 2 = X, Y, Z) is below `level`.
pub(crate) fn area_below(outline: &[[f64; 3]], axis: usize, level: f64, scratch: &mut Vec<[f64; 3]>) -> f64 {
    clip(outline, axis, level, Keep::Below, scratch);
    vector_area(scratch).length()
}

/// The side of a level that a polygon keeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keep {
    /// What is lower.
    Below,
    /// What is higher.
    Above,
}

/// The part of the polygon whose coordinate `axis` is on that side of `level`, in `part`.
///
/// Sutherland-Hodgman against one half-space; the bridges it leaves on a non-convex polygon enclose no area.
pub fn clip(outline: &[[f64; 3]], axis: usize, level: f64, keep: Keep, part: &mut Vec<[f64; 3]>) {
    part.clear();
    let Some(last) = outline.last() else { return };
    let height = |v: &[f64; 3]| {
        let height = v.get(axis).copied().unwrap_or(0.0) - level;
        if keep == Keep::Below { height } else { -height }
    };
    let mut from = *last;
    for to in outline {
        let (h0, h1) = (height(&from), height(to));
        if (h0 < 0.0) != (h1 < 0.0) {
            let (a, b) = (DVec3::from_array(from), DVec3::from_array(*to));
            part.push(a.lerp(b, h0 / (h0 - h1)).to_array());
        }
        if h1 < 0.0 {
            part.push(*to);
        }
        from = *to;
    }
}

/// The outline's triangles about its first vertex, as edge vectors from that vertex.
fn fan(outline: &[[f64; 3]]) -> impl Iterator<Item = (DVec3, DVec3)> + '_ {
    let origin = outline.first().map_or(DVec3::ZERO, |v| DVec3::from_array(*v));
    outline.windows(2).skip(1).filter_map(move |pair| match pair {
        [a, b] => Some((DVec3::from_array(*a) - origin, DVec3::from_array(*b) - origin)),
        _ => None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A U: the unit square less a notch from above, in the plane x = y (so areas carry a factor √2 along Y).
    fn notched() -> Vec<[f64; 3]> {
        let flat =
            [(0.0, 0.0), (3.0, 0.0), (3.0, 3.0), (2.0, 3.0), (2.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0)];
        flat.iter().map(|&(u, v)| [u, u, v]).collect()
    }

    #[test]
    fn area_and_centroid_of_a_non_convex_polygon() {
        let outline = notched();
        let root2 = std::f64::consts::SQRT_2;
        assert!((vector_area(&outline).length() - 7.0 * root2).abs() < 1e-12);
        // Lower bar 3 x 1 at v = 0.5, two posts 1 x 2 at v = 2.
        let c = centroid(&outline);
        assert!((c.z - (3.0 * 0.5 + 4.0 * 2.0) / 7.0).abs() < 1e-12);
        assert!((c.x - 1.5).abs() < 1e-12 && (c.y - 1.5).abs() < 1e-12);
    }

    #[test]
    fn vertices_on_the_level_belong_to_the_part_below_and_cost_no_area() {
        let diamond: Vec<[f64; 3]> =
            [(0.0, -1.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)].iter().map(|&(u, v)| [0.0, u, v]).collect();
        let square: Vec<[f64; 3]> =
            [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].iter().map(|&(u, v)| [0.0, u, v]).collect();
        let mut scratch = Vec::new();
        for turn in 0..4 {
            for reversed in [false, true] {
                let mut below = |outline: &[[f64; 3]], level: f64| {
                    let mut outline = outline.to_vec();
                    outline.rotate_left(turn);
                    if reversed {
                        outline.reverse();
                    }
                    area_below(&outline, 2, level, &mut scratch)
                };
                assert!((below(&diamond, 0.0) - 1.0).abs() < 1e-12, "half a diamond");
                assert!((below(&diamond, 1.0) - 2.0).abs() < 1e-12, "all but its tip");
                assert_eq!(below(&diamond, -1.0), 0.0);
                assert!((below(&square, 1.0) - 1.0).abs() < 1e-12, "up to its upper edge");
                assert_eq!(below(&square, 0.0), 0.0);
                assert!((below(&square, 0.25) - 0.25).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn a_notch_is_not_counted_below_a_level() {
        let outline = notched();
        let root2 = std::f64::consts::SQRT_2;
        let mut scratch = Vec::new();
        // Z below 2: bar (3) and half of each post (2 x 1).
        assert!((area_below(&outline, 2, 2.0, &mut scratch) - 5.0 * root2).abs() < 1e-12);
        // Y below 1.5: left post column (1 x 3) and half the bridge (0.5 x 1).
        assert!((area_below(&outline, 1, 1.5, &mut scratch) - 3.5 * root2).abs() < 1e-12);
        assert_eq!(area_below(&outline, 1, 0.0, &mut scratch), 0.0);
        assert!((area_below(&outline, 1, 9.0, &mut scratch) - 7.0 * root2).abs() < 1e-12);
    }
}
