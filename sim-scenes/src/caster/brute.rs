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

/// What [`super::Caster::cast`] gives, one ray at a time.
pub fn cast(orchard: &Orchard, origin: Pose, fan: &BeamFan) -> Vec<Return> {
    let beams = Beams::from(fan.clone());
    beams.rays(origin).map(|(start, direction)| ray(orchard, start, direction)).collect()
}

/// The nearest surface along any ray: leaf, wood, or the ground. `direction` is a unit vector.
pub fn ray(orchard: &Orchard, origin: [f64; 3], direction: [f64; 3]) -> Return {
    surfaces(orchard, origin, direction).first().copied().unwrap_or(Return::MISS)
}

/// What [`super::Layers::leaves`] gives of any ray: the first `k` leaves before the first wood and the ground.
pub fn leaves(orchard: &Orchard, origin: [f64; 3], direction: [f64; 3], k: usize) -> Vec<Return> {
    let all = surfaces(orchard, origin, direction);
    all.into_iter().take_while(|hit| hit.class == Class::Leaf).take(k).collect()
}

/// All surfaces along a ray, each organ once, nearest first.
fn surfaces(orchard: &Orchard, origin: [f64; 3], direction: [f64; 3]) -> Vec<Return> {
    let (o, d) = (DVec3::from_array(origin), DVec3::from_array(direction));
    let mut found: Vec<Return> = ground(o, d, orchard.ground().plane_m).into_iter().collect();
    let mut offer = |hit: Option<(f64, f64)>, class, tree, organ| {
        if let Some((range_m, cos)) = hit {
            found.push(Return { range_m, class, tree, organ, cos_incidence: cos as f32 });
        }
    };
    for (tree, organs) in (0..).zip(orchard.trees()) {
        for (organ, leaf) in (0..).zip(&organs.leaves) {
            let ys = leaf.outline().iter().map(|[_, y, _]| *y);
            let (low, high) =
                (ys.clone().fold(f64::INFINITY, f64::min), ys.fold(f64::NEG_INFINITY, f64::max));
            for start in images(o, d, low, high, orchard) {
                offer(meet_leaf(leaf, start, d), Class::Leaf, tree, organ);
            }
        }
        for (organ, facet) in (organs.wood.len() as u32..).zip(&organs.facets) {
            let class = Class::from(facet.surface);
            let ys = facet.polygon.outline().iter().map(|[_, y, _]| *y);
            let (low, high) =
                (ys.clone().fold(f64::INFINITY, f64::min), ys.fold(f64::NEG_INFINITY, f64::max));
            for start in images(o, d, low, high, orchard) {
                offer(meet_leaf(&facet.polygon, start, d), class, tree, organ);
            }
        }
        for (organ, piece) in (0..).zip(&organs.wood) {
            let (a, b, r) = (piece.base()[1], piece.tip()[1], piece.radius_m());
            for start in images(o, d, a.min(b) - r, a.max(b) + r, orchard) {
                offer(meet_cylinder(piece, start, d), Class::Wood, tree, organ);
            }
        }
    }
    for (organ, support) in (0..).zip(orchard.supports()) {
        let (a, b, r) = (support.shape.base()[1], support.shape.tip()[1], support.shape.radius_m());
        let class = Class::from(support.kind);
        for start in images(o, d, a.min(b) - r, a.max(b) + r, orchard) {
            offer(meet_cylinder(&support.shape, start, d), class, Return::NO_LABEL, organ);
        }
    }
    for facet in &orchard.ground().facets {
        let ys = facet.polygon.outline().iter().map(|[_, y, _]| *y);
        let (low, high) = (ys.clone().fold(f64::INFINITY, f64::min), ys.fold(f64::NEG_INFINITY, f64::max));
        for start in images(o, d, low, high, orchard) {
            let class = Class::from(facet.surface);
            offer(meet_leaf(&facet.polygon, start, d), class, Return::NO_LABEL, Return::NO_LABEL);
        }
    }
    found.sort_by(|a, b| a.range_m.total_cmp(&b.range_m));
    found
}

fn ground(o: DVec3, d: DVec3, plane_m: f64) -> Option<Return> {
    (d.z < 0.0 && o.z > plane_m).then(|| Return {
        range_m: -(o.z - plane_m) / d.z,
        class: Class::Ground,
        cos_incidence: -d.z as f32,
        ..Return::MISS
    })
}

/// The origin moved by every whole number of periods for which the ray may come near Y from `low` to `high`.
fn images(o: DVec3, d: DVec3, low: f64, high: f64, orchard: &Orchard) -> impl Iterator<Item = DVec3> {
    let (near, far) = (o.y.min(o.y + d.y * FARTHEST_M), o.y.max(o.y + d.y * FARTHEST_M));
    let period = orchard.length_m();
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
