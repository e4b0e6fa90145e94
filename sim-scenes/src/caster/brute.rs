//! The test oracle: one ray against every organ of every period, by the plain formulas. Slow, and shares nothing with the caster
//! but the organs.

use glam::DVec3;
use rowscan_protocol::scan::Pose;

use super::{BeamFan, Beams, Class, Return};
use crate::orchard::Orchard;
use crate::organ::{Cylinder, Leaf};

/// A leaf seen more edge-on than this returns nothing.
const EDGE_ON: f64 = 1e-12;

/// As far as a ray is followed, metres: period images beyond are not looked at.
const FARTHEST_M: f64 = 1000.0;

/// An orchard as the oracle asks it: every organ by itself, with the sphere it lies in. A ray that passes the sphere of an organ passes the organ.
pub struct Oracle<'a> {
    orchard: &'a Orchard,
    organs: Vec<Organ>,
    /// A sphere around each [`GROUP`] of organs; neighbours in a tree's list are neighbours in its crown.
    groups: Vec<Sphere>,
}

/// Organs that share a sphere.
const GROUP: usize = 32;

/// What lies in it is missed by every ray that misses it.
#[derive(Clone, Copy)]
struct Sphere {
    middle: DVec3,
    radius: f64,
}

impl Sphere {
    fn around(spheres: impl Iterator<Item = Self> + Clone) -> Self {
        let low = spheres.clone().fold(DVec3::INFINITY, |low, one| low.min(one.middle - one.radius));
        let high = spheres.clone().fold(DVec3::NEG_INFINITY, |high, one| high.max(one.middle + one.radius));
        let middle = (low + high) / 2.0;
        let radius = spheres.map(|one| one.middle.distance(middle) + one.radius).fold(0.0, f64::max);
        Self { middle, radius }
    }

    /// True if the ray misses it and all its images. They differ in Y only, so they are one circle when seen along Y.
    fn beside(&self, o: DVec3, d: DVec3) -> bool {
        let (across, flat) = (d.with_y(0.0), (self.middle - o).with_y(0.0));
        flat.cross(across).length() > self.radius * across.length()
    }
}

/// One surface of the orchard.
struct Organ {
    shape: Shape,
    class: Class,
    tree: u32,
    organ: u32,
    sphere: Sphere,
}

enum Shape {
    Polygon(Leaf),
    Cylinder(Cylinder),
}

impl Organ {
    fn new(shape: Shape, class: Class, tree: u32, organ: u32) -> Self {
        let (middle, radius) = match &shape {
            Shape::Polygon(polygon) => {
                let corners = || polygon.outline().iter().map(|corner| DVec3::from_array(*corner));
                let low = corners().fold(DVec3::INFINITY, DVec3::min);
                let high = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
                let middle = (low + high) / 2.0;
                (middle, corners().map(|corner| corner.distance(middle)).fold(0.0, f64::max))
            }
            Shape::Cylinder(piece) => {
                let (base, tip) = (DVec3::from_array(piece.base()), DVec3::from_array(piece.tip()));
                ((base + tip) / 2.0, (base.distance(tip) / 2.0).hypot(piece.radius_m()))
            }
        };
        let sphere = Sphere { middle, radius: radius * (1.0 + 1e-9) + 1e-9 };
        Self { shape, class, tree, organ, sphere }
    }

    /// Range and |d·n| of every image that the ray meets.
    fn met(&self, o: DVec3, d: DVec3, period_m: f64) -> impl Iterator<Item = (f64, f64)> {
        let Sphere { middle, radius } = self.sphere;
        let first =
            if self.sphere.beside(o, d) { None } else { Some(images(o, d, middle.y, radius, period_m)) };
        first.into_iter().flatten().filter_map(move |start| {
            if (middle - start).cross(d).length() > radius {
                return None;
            }
            match &self.shape {
                Shape::Polygon(polygon) => meet_leaf(polygon, start, d),
                Shape::Cylinder(piece) => meet_cylinder(piece, start, d),
            }
        })
    }
}

impl<'a> Oracle<'a> {
    /// Of this orchard.
    pub fn new(orchard: &'a Orchard) -> Self {
        let mut organs = Vec::new();
        for (tree, grown) in (0..).zip(orchard.trees()) {
            let mut add =
                |shape, class, organ: usize| organs.push(Organ::new(shape, class, tree, organ as u32));
            for (organ, leaf) in grown.leaves.iter().enumerate() {
                add(Shape::Polygon(leaf.clone()), Class::Leaf, organ);
            }
            for (organ, facet) in (grown.wood.len()..).zip(&grown.facets) {
                add(Shape::Polygon(facet.polygon.clone()), Class::from(facet.surface), organ);
            }
            for (organ, piece) in grown.wood.iter().enumerate() {
                add(Shape::Cylinder(*piece), Class::Wood, organ);
            }
        }
        for (organ, support) in (0..).zip(orchard.supports()) {
            let shape = Shape::Cylinder(support.shape);
            organs.push(Organ::new(shape, Class::from(support.kind), Return::NO_LABEL, organ));
        }
        for facet in &orchard.ground().facets {
            let (shape, class) = (Shape::Polygon(facet.polygon.clone()), Class::from(facet.surface));
            organs.push(Organ::new(shape, class, Return::NO_LABEL, Return::NO_LABEL));
        }
        let groups = organs
            .chunks(GROUP)
            .map(|group| Sphere::around(group.iter().map(|organ| organ.sphere)))
            .collect();
        Self { orchard, organs, groups }
    }

    /// What [`super::Caster::cast`] gives, one ray at a time.
    pub fn cast(&self, origin: Pose, fan: &BeamFan) -> Vec<Return> {
        let beams = Beams::from(fan.clone());
        beams.rays(origin).map(|(start, direction)| self.ray(start, direction)).collect()
    }

    /// The nearest surface along any ray: leaf, wood, or the ground. `direction` is a unit vector.
    pub fn ray(&self, origin: [f64; 3], direction: [f64; 3]) -> Return {
        self.surfaces(origin, direction).first().copied().unwrap_or(Return::MISS)
    }

    /// What [`super::Layers::leaves`] gives of any ray: the first `k` leaves before the first wood and the ground.
    pub fn leaves(&self, origin: [f64; 3], direction: [f64; 3], k: usize) -> Vec<Return> {
        let all = self.surfaces(origin, direction);
        all.into_iter().take_while(|hit| hit.class == Class::Leaf).take(k).collect()
    }

    /// All surfaces along a ray, each organ's images once, nearest first.
    fn surfaces(&self, origin: [f64; 3], direction: [f64; 3]) -> Vec<Return> {
        let (o, d) = (DVec3::from_array(origin), DVec3::from_array(direction));
        let mut found: Vec<Return> = ground(o, d, self.orchard.ground().plane_m).into_iter().collect();
        let near = self.organs.chunks(GROUP).zip(&self.groups).filter(|(_, group)| !group.beside(o, d));
        for organ in near.flat_map(|(organs, _)| organs) {
            found.extend(organ.met(o, d, self.orchard.period_m()).map(|(range_m, cos)| Return {
                range_m,
                class: organ.class,
                tree: organ.tree,
                organ: organ.organ,
                cos_incidence: cos as f32,
            }));
        }
        found.sort_by(|a, b| a.range_m.total_cmp(&b.range_m));
        found
    }
}

fn ground(o: DVec3, d: DVec3, plane_m: f64) -> Option<Return> {
    (d.z < 0.0 && o.z > plane_m).then(|| Return {
        range_m: -(o.z - plane_m) / d.z,
        class: Class::Ground,
        cos_incidence: -d.z as f32,
        ..Return::MISS
    })
}

/// The origin moved by every whole number of periods for which the ray may come within `radius` of `y`.
fn images(o: DVec3, d: DVec3, y: f64, radius: f64, period: f64) -> impl Iterator<Item = DVec3> {
    let (low, high) = (y - radius, y + radius);
    let (near, far) = (o.y.min(o.y + d.y * FARTHEST_M), o.y.max(o.y + d.y * FARTHEST_M));
    let periods = if period.is_finite() {
        ((near - high) / period - 1e-9).ceil() as i64..=((far - low) / period + 1e-9).floor() as i64
    } else {
        0..=i64::from(near <= high && low <= far) - 1
    };
    periods.map(move |k| if k == 0 { o } else { o - DVec3::Y * (k as f64 * period) })
}

/// Range and |d·n|: the plane for the range, and even-odd as seen along the ray for the rest. All polygons are seen in the same axes, and an
/// edge from its lower end, so that no ray passes between two that share one; each edge owns its lower end.
fn meet_leaf(leaf: &Leaf, o: DVec3, d: DVec3) -> Option<(f64, f64)> {
    let normal = DVec3::from_array(leaf.normal());
    let facing = d.dot(normal);
    let corner = DVec3::from_array(*leaf.outline().first()?);
    let range = (corner - o).dot(normal) / facing;
    if facing.abs() < EDGE_ON || range <= 0.0 {
        return None;
    }
    let (u_axis, v_axis) = d.any_orthonormal_pair();
    let flat = |v: &[f64; 3]| {
        let from_start = DVec3::from_array(*v) - o;
        (from_start.dot(u_axis), from_start.dot(v_axis))
    };
    let mut odd = false;
    let mut from = flat(leaf.outline().last()?);
    for to in leaf.outline().iter().map(flat) {
        if (from.1 > 0.0) != (to.1 > 0.0) {
            let (low, high) = if to.1 > 0.0 { (from, to) } else { (to, from) };
            odd ^= low.0 - low.1 * (high.0 - low.0) / (high.1 - low.1) > 0.0;
        }
        from = to;
    }
    odd.then_some((range, facing.abs()))
}

/// Range and |d·n|: both roots of the side that lie between the ends, both end disks; the smallest positive.
fn meet_cylinder(piece: &Cylinder, o: DVec3, d: DVec3) -> Option<(f64, f64)> {
    let (base, tip, r) = (DVec3::from_array(piece.base()), DVec3::from_array(piece.tip()), piece.radius_m());
    let axis = (tip - base).normalize();
    let length = base.distance(tip);
    let from = o - base;
    let (d_side, o_side) = (d - axis * d.dot(axis), from - axis * from.dot(axis));
    let (a, b, c) = (d_side.length_squared(), o_side.dot(d_side), o_side.length_squared() - r * r);
    let root = (b * b - a * c).sqrt();
    let sides = [(-b - root) / a, (-b + root) / a].into_iter().filter_map(|t| {
        let height = (from + d * t).dot(axis);
        let cos = (o_side + d_side * t).dot(d).abs() / r;
        (0.0..=length).contains(&height).then_some((t, cos))
    });
    let ends = [base, tip].into_iter().filter_map(|end| {
        let t = (end - o).dot(axis) / d.dot(axis);
        ((o + d * t).distance(end) <= r).then_some((t, d.dot(axis).abs()))
    });
    sides.chain(ends).filter(|(t, _)| *t > 0.0 && t.is_finite()).min_by(|x, y| x.0.total_cmp(&y.0))
}
