//! Leaves as the lines see them: close to each other in memory where they are in space, vertices in rows of eight.

use glam::DVec3;

use super::cells::Bounds;
use crate::growth::rotation::square_to;
use crate::lanes::{Row, WIDTH};
use crate::organ::Leaf;

/// More than what rounding moves a leaf by, metres.
pub(super) const HAIR_M: f64 = 1e-9;

/// A line's direction, and the plane square to it.
#[derive(Clone, Copy)]
pub(super) struct Plane {
    pub(super) direction: DVec3,
    pub(super) u: DVec3,
    pub(super) v: DVec3,
}

impl Plane {
    pub(super) fn square_to(direction: DVec3) -> Self {
        let u = square_to(direction);
        Self { direction, u, v: direction.cross(u) }
    }

    pub(super) fn flat(&self, point: DVec3) -> (f64, f64) {
        (point.dot(self.u), point.dot(self.v))
    }
}

/// A leaf.
pub(super) struct Blade {
    /// Its place in the list of leaves.
    pub(super) number: usize,
    /// A vertex.
    pub(super) on: DVec3,
    pub(super) normal: DVec3,
    pub(super) middle: DVec3,
    /// How far the farthest vertex is from the middle.
    reach_m: f64,
    /// How far vertices are off the plane.
    warp_m: f64,
    /// Its first row of vertices, and how many vertices there are.
    first: usize,
    pub(super) vertices: usize,
}

/// Where a leaf lies along a line.
#[derive(Clone, Copy)]
pub(super) struct Depth {
    pub(super) near: f64,
    pub(super) far: f64,
}

impl Blade {
    /// Its plane within the outline lies between these, however much a nearly edge-on one magnifies its warp.
    pub(super) fn depth(&self, direction: DVec3) -> Depth {
        let facing = self.normal.dot(direction);
        let reach = self.extent(facing) + (2.0 * self.warp_m + HAIR_M) / facing.abs();
        let depth = self.middle.dot(direction);
        Depth { near: depth - reach, far: depth + reach }
    }

    /// A box around its projection: that of the disc of its reach.
    pub(super) fn bounds(&self, plane: &Plane) -> Bounds {
        let (u, v) = plane.flat(self.middle);
        let around = 2.0 * self.warp_m + HAIR_M;
        let [by_u, by_v] = [plane.u, plane.v].map(|axis| self.extent(self.normal.dot(axis)) + around);
        Bounds { low: (u - by_u, v - by_v), high: (u + by_u, v + by_v) }
    }

    /// How far that disc extends along a direction, whose cosine with the normal is `cos`.
    fn extent(&self, cos: f64) -> f64 {
        self.reach_m * (1.0 - cos * cos).max(0.0).sqrt()
    }
}

/// All leaves, ready to be projected.
pub(super) struct Blades {
    pub(super) blades: Vec<Blade>,
    /// X, Y and Z of eight vertices; the first vertex fills the last row.
    rows: Vec<[Row; 3]>,
    /// Area of all together.
    pub(super) area_m2: f64,
}

impl Blades {
    pub(super) fn new(leaves: &[&Leaf]) -> Self {
        let (mut blades, mut rows) = (Vec::with_capacity(leaves.len()), Vec::with_capacity(leaves.len()));
        for (number, leaf) in near_each_other(leaves) {
            let outline: Vec<DVec3> = leaf.outline().iter().map(|v| DVec3::from_array(*v)).collect();
            let on = outline.first().copied().unwrap_or_default();
            let (middle, normal) = (DVec3::from_array(leaf.centroid()), DVec3::from_array(leaf.normal()));
            let most = |of: &dyn Fn(DVec3) -> f64| outline.iter().map(|v| of(*v)).fold(0.0, f64::max);
            blades.push(Blade {
                number,
                on,
                normal,
                middle,
                reach_m: most(&|v| v.distance(middle)),
                warp_m: most(&|v| (v - on).dot(normal).abs()),
                first: rows.len(),
                vertices: outline.len(),
            });
            for eight in outline.chunks(WIDTH) {
                let vertex = |k: usize| eight.get(k).copied().unwrap_or(on).to_array();
                rows.push([0, 1, 2].map(|axis| Row(std::array::from_fn(|k| vertex(k)[axis]))));
            }
        }
        Self { blades, rows, area_m2: leaves.iter().map(|leaf| leaf.area_m2()).sum() }
    }

    /// The vertices of a leaf.
    pub(super) fn rows(&self, blade: &Blade) -> &[[Row; 3]] {
        self.rows.get(blade.first..blade.first + blade.vertices.div_ceil(WIDTH)).unwrap_or(&[])
    }

    /// Half the length of a leaf, on average.
    pub(super) fn reach_m(&self) -> f64 {
        let sum: f64 = self.blades.iter().map(|blade| blade.reach_m).sum();
        sum / self.blades.len().max(1) as f64
    }
}

/// Leaves with their numbers, those close to each other in space close to each other in the list: what lies side by side is read
/// together. Along a curve of cubes in cubes (Morton).
fn near_each_other<'a>(leaves: &[&'a Leaf]) -> Vec<(usize, &'a Leaf)> {
    const CUBES: f64 = 1023.0;
    let foot = |leaf: &Leaf| leaf.outline().first().map_or(DVec3::ZERO, |v| DVec3::from_array(*v));
    let nothing = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (low, high) =
        leaves.iter().map(|leaf| foot(leaf)).fold(nothing, |(low, high), at| (low.min(at), high.max(at)));
    let per_m = CUBES / (high - low).max_element().max(1e-9);
    let mut list: Vec<(usize, &Leaf)> = leaves.iter().copied().enumerate().collect();
    list.sort_by_cached_key(|(_, leaf)| {
        let cube = ((foot(leaf) - low) * per_m).to_array().map(|cubes| cubes as u32);
        (0..10).fold(0_u32, |key, bit| {
            cube.iter()
                .enumerate()
                .fold(key, |key, (axis, cubes)| key | (cubes >> bit & 1) << (3 * bit + axis))
        })
    });
    list
}
