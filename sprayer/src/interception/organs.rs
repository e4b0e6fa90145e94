//! What stops a ray, and where: plane polygons and cylinders, exactly.

use glam::DVec3;
use rowscan_scenes::{Cylinder, Leaf};

/// A polygon seen more edge-on than this stops nothing.
const EDGE_ON: f64 = 1e-12;

/// A ray from a nozzle. Its direction need not be of length 1: distances count in it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ray {
    pub(super) from: DVec3,
    pub(super) along: DVec3,
}

impl Ray {
    pub(super) fn at(self, t: f64) -> DVec3 {
        self.from + self.along * t
    }
}

/// A surface.
#[derive(Clone, Debug)]
pub(super) enum Shape {
    Polygon(Polygon),
    Cylinder(Cylinder),
}

/// A plane polygon, as its corners in the two axes that it fills most.
#[derive(Clone, Debug)]
pub(super) struct Polygon {
    corner: DVec3,
    normal: DVec3,
    axes: (usize, usize),
    flat: Box<[[f64; 2]]>,
}

impl Polygon {
    pub(super) fn of(leaf: &Leaf) -> Self {
        let normal = DVec3::from_array(leaf.normal());
        let most = normal.abs().to_array();
        let axes = if most[0] >= most[1] && most[0] >= most[2] {
            (1, 2)
        } else if most[1] >= most[2] {
            (0, 2)
        } else {
            (0, 1)
        };
        let corner = leaf.outline().first().map_or(DVec3::ZERO, |first| DVec3::from_array(*first));
        let flat = leaf.outline().iter().map(|v| [pick(v, axes.0), pick(v, axes.1)]).collect();
        Self { corner, normal, axes, flat }
    }

    /// How far along the ray it is met; none where it is not.
    fn met(&self, ray: Ray) -> Option<f64> {
        let towards = self.normal.dot(ray.along);
        if towards.abs() < EDGE_ON {
            return None;
        }
        let t = self.normal.dot(self.corner - ray.from) / towards;
        if t <= 0.0 {
            return None;
        }
        let at = ray.at(t).to_array();
        self.holds([pick(&at, self.axes.0), pick(&at, self.axes.1)]).then_some(t)
    }

    /// True if an odd number of its edges is above the point: right for polygons that are not convex, too.
    fn holds(&self, [u, v]: [f64; 2]) -> bool {
        let mut is_inside = false;
        let Some(mut from) = self.flat.last() else { return false };
        for to in &self.flat {
            if (from[1] > v) != (to[1] > v) {
                let at = from[0] + (v - from[1]) / (to[1] - from[1]) * (to[0] - from[0]);
                is_inside ^= u < at;
            }
            from = to;
        }
        is_inside
    }
}

fn pick(v: &[f64; 3], axis: usize) -> f64 {
    v.get(axis).copied().unwrap_or(0.0)
}

impl Shape {
    /// How far along the ray it is met first; none where it is not.
    pub(super) fn met(&self, ray: Ray) -> Option<f64> {
        match self {
            Self::Polygon(polygon) => polygon.met(ray),
            Self::Cylinder(piece) => cylinder(piece, ray),
        }
    }
}

/// Where a ray meets the side or an end of a cylinder first.
fn cylinder(piece: &Cylinder, ray: Ray) -> Option<f64> {
    let base = DVec3::from_array(piece.base());
    let (long_m, radius_m) = (piece.length_m(), piece.radius_m());
    let axis = (DVec3::from_array(piece.tip()) - base) / long_m;
    let from = ray.from - base;
    let (d, f) = (ray.along - axis * axis.dot(ray.along), from - axis * axis.dot(from));
    let (a, b, c) = (d.length_squared(), d.dot(f), f.length_squared() - radius_m * radius_m);
    let height = |t: f64| axis.dot(from + ray.along * t);
    let mut first = None;
    let mut take = |t: f64| {
        if t > 0.0 && first.is_none_or(|known| t < known) {
            first = Some(t);
        }
    };
    let square = b * b - a * c;
    if a > 0.0 && square >= 0.0 {
        for t in [(-b - square.sqrt()) / a, (-b + square.sqrt()) / a] {
            if (0.0..=long_m).contains(&height(t)) {
                take(t);
            }
        }
    }
    let climbs = axis.dot(ray.along);
    if climbs != 0.0 {
        for end in [0.0, long_m] {
            let t = (end - axis.dot(from)) / climbs;
            if (f + d * t).length_squared() <= radius_m * radius_m {
                take(t);
            }
        }
    }
    first
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ray(from: [f64; 3], along: [f64; 3]) -> Ray {
        Ray { from: from.into(), along: along.into() }
    }

    #[test]
    fn polygons_stop_what_passes_within_their_outline() {
        // A U from above: the notch lets through.
        let outline =
            [(0.0, 0.0), (3.0, 0.0), (3.0, 3.0), (2.0, 3.0), (2.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0)];
        for turn in 0..3 {
            let place = |u: f64, v: f64, w: f64| {
                let mut at = [u, v, w];
                at.rotate_right(turn);
                at
            };
            let corners: Vec<[f64; 3]> = outline.iter().map(|(u, v)| place(*u, *v, 0.0)).collect();
            let shape = Shape::Polygon(Polygon::of(&Leaf::new(corners).expect("a leaf")));
            let met = |u: f64, v: f64| shape.met(ray(place(u, v, -2.0), place(0.0, 0.0, 0.5)));
            assert_eq!((met(0.5, 2.0), met(1.5, 2.0), met(1.5, 0.5)), (Some(4.0), None, Some(4.0)));
            assert_eq!(shape.met(ray(place(0.5, 2.0, 1.0), place(0.0, 0.0, 1.0))), None, "it is behind");
            assert_eq!(shape.met(ray(place(-1.0, 0.5, 0.0), place(1.0, 0.0, 0.0))), None, "edge-on");
        }
    }

    #[test]
    fn cylinders_are_met_at_the_side_and_at_their_ends() {
        let piece = Cylinder::new([0.0, 0.0, 1.0], [0.0, 0.0, 3.0], 0.5).expect("wood");
        let met = |from, along| Shape::Cylinder(piece).met(ray(from, along));
        assert_eq!(met([-2.0, 0.0, 2.0], [1.0, 0.0, 0.0]), Some(1.5));
        assert_eq!(met([-2.0, 0.0, 3.5], [1.0, 0.0, 0.0]), None);
        assert_eq!(met([0.25, 0.0, 5.0], [0.0, 0.0, -1.0]), Some(2.0));
        assert_eq!(met([-2.0, 0.6, 2.0], [1.0, 0.0, 0.0]), None);
        let leaning = met([-1.0, 0.0, 4.0], [1.0, 0.0, -1.0]).expect("its upper end");
        assert!((leaning - 1.0).abs() < 1e-12, "{leaning}");
    }
}
