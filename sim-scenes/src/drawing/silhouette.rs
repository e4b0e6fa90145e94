//! Silhouettes: the outlines of everything that polygons cover together, in one view.

use i_overlay::core::fill_rule::FillRule;
use i_overlay::float::simplify::SimplifyShape;

/// A closed line; its last point is joined to its first.
pub(super) type Contour = Vec<[f64; 2]>;

/// What polygons cover: its outlines, and those of the holes in it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Silhouette {
    /// Outlines run one way and holes the other; no two cross.
    pub(super) contours: Vec<Contour>,
}

impl Silhouette {
    /// The union of polygons, whichever way each runs.
    pub(super) fn of(polygons: impl Iterator<Item = Contour>) -> Self {
        let polygons: Vec<Contour> =
            polygons.filter(|polygon| polygon.len() > 2).map(counterclockwise).collect();
        // 64-bit coordinates: leaves of some centimetres in rows of some hundred metres.
        let shapes = polygons.simplify_shape_as::<i64>(FillRule::NonZero);
        Self { contours: shapes.into_iter().flatten().collect() }
    }

    /// What is covered, m².
    pub(super) fn area_m2(&self) -> f64 {
        self.contours.iter().map(|contour| signed_area_m2(contour)).sum::<f64>().abs()
    }
}

/// The same polygon, running to the left around what it covers: overlaps of opposite turns would cancel out.
fn counterclockwise(mut polygon: Contour) -> Contour {
    if signed_area_m2(&polygon) < 0.0 {
        polygon.reverse();
    }
    polygon
}

fn signed_area_m2(contour: &[[f64; 2]]) -> f64 {
    let next = contour.iter().cycle().skip(1);
    contour.iter().zip(next).map(|([x1, y1], [x2, y2])| x1 * y2 - x2 * y1).sum::<f64>() / 2.0
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn square(x: f64, y: f64, side: f64) -> Contour {
        vec![[x, y], [x + side, y], [x + side, y + side], [x, y + side]]
    }

    #[test]
    fn overlaps_count_once_and_holes_not_at_all() {
        let mut turned = square(0.5, 0.5, 1.0);
        turned.reverse();
        let two = Silhouette::of([square(0.0, 0.0, 1.0), turned].into_iter());
        assert!((two.area_m2() - 1.75).abs() < 1e-9, "{}", two.area_m2());
        assert_eq!(two.contours.len(), 1);
        // Four bars around an empty middle of 1 m × 1 m.
        let bar = |x: f64, y: f64, wide: f64, high: f64| {
            vec![[x, y], [x + wide, y], [x + wide, y + high], [x, y + high]]
        };
        let frame = [
            bar(0.0, 0.0, 3.0, 1.0),
            bar(0.0, 2.0, 3.0, 1.0),
            bar(0.0, 0.0, 1.0, 3.0),
            bar(2.0, 0.0, 1.0, 3.0),
        ];
        let frame = Silhouette::of(frame.into_iter());
        assert!((frame.area_m2() - 8.0).abs() < 1e-9, "{}", frame.area_m2());
        assert_eq!(frame.contours.len(), 2);
    }

    /// Whether a point lies in contours: a line to the right crosses them an odd number of times.
    fn holds(contours: &[Contour], [x, y]: [f64; 2]) -> bool {
        let edges = contours.iter().flat_map(|contour| contour.iter().zip(contour.iter().cycle().skip(1)));
        let crossed = edges.filter(|([x1, y1], [x2, y2])| {
            (*y1 > y) != (*y2 > y) && x < (x2 - x1) * (y - y1) / (y2 - y1) + x1
        });
        crossed.count() % 2 == 1
    }

    /// Distance of a point from an edge of contours.
    fn distance(contours: &[Contour], [x, y]: [f64; 2]) -> f64 {
        let edges = contours.iter().flat_map(|contour| contour.iter().zip(contour.iter().cycle().skip(1)));
        let of = |([x1, y1], [x2, y2]): (&[f64; 2], &[f64; 2])| {
            let (dx, dy) = (x2 - x1, y2 - y1);
            let along = (((x - x1) * dx + (y - y1) * dy) / (dx * dx + dy * dy).max(1e-30)).clamp(0.0, 1.0);
            f64::hypot(x - x1 - along * dx, y - y1 - along * dy)
        };
        edges.map(of).fold(f64::INFINITY, f64::min)
    }

    proptest! {
        #[test]
        fn a_point_is_covered_if_a_polygon_covers_it(
            triangles in prop::collection::vec(prop::array::uniform3([0.0..1.0f64, 0.0..1.0f64]), 1..20),
            points in prop::collection::vec([0.0..1.0f64, 0.0..1.0f64], 40),
        ) {
            let triangles: Vec<Contour> = triangles.into_iter().map(Vec::from).collect();
            let union = Silhouette::of(triangles.iter().cloned());
            for point in points.into_iter().filter(|point| distance(&triangles, *point) > 1e-6) {
                let covered = triangles.iter().any(|triangle| holds(std::slice::from_ref(triangle), point));
                prop_assert_eq!(holds(&union.contours, point), covered);
            }
        }
    }
}
