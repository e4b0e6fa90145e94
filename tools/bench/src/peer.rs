//! The peer: parry3d's bounding volume hierarchy over the same organs, one ray at a time, in single precision as it is meant to be
//! used. Leaves and branches are its primitives, tested by the shortest formulas we know.

use std::cell::Cell;

use parry3d::bounding_volume::Aabb;
use parry3d::math::Vector;
use parry3d::partitioning::{Bvh, BvhBuildStrategy};
use parry3d::query::Ray;
use rowscan_scenes::{Cylinder, Leaf, Orchard};

/// Name and version of the peer.
pub const PARRY: &str = "parry3d 0.31 Bvh";

/// As far as rays are followed, metres.
pub const FARTHEST_M: f32 = 1000.0;

/// Range to the ground, where the peer may stop looking.
pub fn before_ground(z_m: f64, sin: f64) -> f32 {
    if sin < 0.0 { (z_m / -sin) as f32 } else { FARTHEST_M }
}

/// A primitive of the hierarchy.
enum Organ {
    Leaf(FlatLeaf),
    Wood(Rod),
}

/// The organs of an orchard, images across the border of the period included, in a hierarchy.
pub struct Peer {
    bvh: Bvh,
    organs: Vec<Organ>,
    labels: Vec<(u32, u32)>,
}

/// What a ray of the peer met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance, metres.
    pub range_m: f32,
    /// True for wood.
    pub wood: bool,
    /// Tree and organ.
    pub label: (u32, u32),
}

impl Peer {
    /// Builds the hierarchy. Images one period before and after stand for the endless row, where they touch it.
    pub fn new(orchard: &Orchard) -> Self {
        let (mut organs, mut labels, mut boxes) = (Vec::new(), Vec::new(), Vec::new());
        let length = orchard.length_m();
        let mut shifts = vec![0.0];
        if length.is_finite() {
            shifts.extend([-length, length]);
        }
        let reaches = |low: f64, high: f64| !length.is_finite() || (low <= length + 1.0 && high >= -1.0);
        for (tree, of) in (0..).zip(orchard.trees()) {
            for shift in &shifts {
                for (organ, leaf) in (0..).zip(&of.leaves) {
                    let ys = || leaf.outline().iter().map(|v| v[1] + shift);
                    if reaches(ys().fold(f64::MAX, f64::min), ys().fold(f64::MIN, f64::max)) {
                        let (flat, aabb) = FlatLeaf::new(leaf, *shift);
                        organs.push(Organ::Leaf(flat));
                        boxes.push(aabb);
                        labels.push((tree, organ));
                    }
                }
                for (organ, piece) in (0..).zip(&of.wood) {
                    let (a, b) = (piece.base()[1] + shift, piece.tip()[1] + shift);
                    if reaches(a.min(b) - piece.radius_m(), a.max(b) + piece.radius_m()) {
                        let (rod, aabb) = Rod::new(piece, *shift);
                        organs.push(Organ::Wood(rod));
                        boxes.push(aabb);
                        labels.push((tree, organ));
                    }
                }
            }
        }
        let bvh = Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes);
        Self { bvh, organs, labels }
    }

    /// The nearest organ along a ray, no farther than `most_m`.
    pub fn nearest(&self, origin: [f64; 3], direction: [f64; 3], most_m: f32) -> Option<Hit> {
        let ray = Ray::new(vector(origin), vector(direction));
        let (number, range_m) =
            self.bvh.cast_ray(&ray, most_m, |number, best| self.meet(number, &ray).filter(|t| *t < best))?;
        Some(self.hit(number, range_m))
    }

    /// True if any leaf but `except` stands within `least_m` to infinity.
    pub fn any_leaf(&self, origin: [f64; 3], direction: [f64; 3], least_m: f32, except: u32) -> bool {
        let ray = Ray::new(vector(origin), vector(direction));
        // The first hit at cost 0 ends the search.
        let met = |number: u32, best: f32| {
            let hit = best > 0.0 && number != except && self.meet(number, &ray).is_some_and(|t| t > least_m);
            hit.then_some(0.0)
        };
        self.bvh.cast_ray(&ray, FARTHEST_M, met).is_some()
    }

    /// The first three leaves before the first wood, as far as `most_m`: how many, and their distances.
    pub fn layers(&self, origin: [f64; 3], direction: [f64; 3], most_m: f32) -> ([f32; 3], f32) {
        let ray = Ray::new(vector(origin), vector(direction));
        let first = Cell::new([f32::INFINITY; 3]);
        let wood = Cell::new(most_m);
        // The cost is that of the third leaf so far, or of the wood: what is farther is not looked at.
        let visit = |number: u32, _| {
            let range = self.meet(number, &ray)?;
            match self.organs.get(number as usize) {
                Some(Organ::Wood(_)) => wood.set(wood.get().min(range)),
                _ => {
                    let mut leaves = first.get();
                    let mut new = range;
                    for slot in &mut leaves {
                        if new < *slot {
                            std::mem::swap(slot, &mut new);
                        }
                    }
                    first.set(leaves);
                }
            }
            Some(first.get()[2].min(wood.get()))
        };
        self.bvh.cast_ray(&ray, most_m, visit);
        (first.get(), wood.get())
    }

    fn hit(&self, number: u32, range_m: f32) -> Hit {
        let wood = matches!(self.organs.get(number as usize), Some(Organ::Wood(_)));
        let label = self.labels.get(number as usize).copied().unwrap_or((u32::MAX, u32::MAX));
        Hit { range_m, wood, label }
    }

    #[inline(always)]
    fn meet(&self, number: u32, ray: &Ray) -> Option<f32> {
        match self.organs.get(number as usize)? {
            Organ::Leaf(leaf) => leaf.meet(ray),
            Organ::Wood(rod) => rod.meet(ray),
        }
    }
}

fn vector(v: [f64; 3]) -> Vector {
    Vector::new(v[0] as f32, v[1] as f32, v[2] as f32)
}

/// A convex octagon: its plane, and its outline in it, counter-clockwise.
struct FlatLeaf {
    foot: Vector,
    normal: Vector,
    u: Vector,
    v: Vector,
    outline: [[f32; 2]; 8],
}

impl FlatLeaf {
    fn new(leaf: &Leaf, shift: f64) -> (Self, Aabb) {
        let points: Vec<[f64; 3]> = leaf.outline().iter().map(|[x, y, z]| [*x, y + shift, *z]).collect();
        let foot = points[0];
        let normal = leaf.normal();
        let least = if normal[0].abs() < 0.6 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
        let u = unit(cross(least, normal));
        let v = cross(normal, u);
        let flat = |p: &[f64; 3]| -> [f32; 2] {
            let d: [f64; 3] = std::array::from_fn(|i| p[i] - foot[i]);
            [u, v].map(|axis| (d[0] * axis[0] + d[1] * axis[1] + d[2] * axis[2]) as f32)
        };
        let last = points.len() - 1;
        let outline = std::array::from_fn(|i| flat(&points[i.min(last)]));
        let (mut low, mut high) = (vector(foot), vector(foot));
        for p in &points {
            (low, high) = (low.min(vector(*p)), high.max(vector(*p)));
        }
        let this = Self { foot: vector(foot), normal: vector(normal), u: vector(u), v: vector(v), outline };
        // A hair for the rounding of the coordinates.
        let hair = Vector::splat(2e-5);
        (this, Aabb::new(low - hair, high + hair))
    }

    #[inline(always)]
    fn meet(&self, ray: &Ray) -> Option<f32> {
        let range = (self.foot - ray.origin).dot(self.normal) / ray.dir.dot(self.normal);
        if !(range > 0.0 && range < FARTHEST_M) {
            return None;
        }
        let from_foot = ray.origin + ray.dir * range - self.foot;
        let (a, b) = (from_foot.dot(self.u), from_foot.dot(self.v));
        let mut inside = true;
        for i in 0..8 {
            let ([u0, v0], [u1, v1]) = (self.outline[i], self.outline[(i + 1) % 8]);
            inside &= (u1 - u0) * (b - v0) - (v1 - v0) * (a - u0) >= 0.0;
        }
        inside.then_some(range)
    }
}

/// A cylinder.
struct Rod {
    base: Vector,
    axis: Vector,
    length: f32,
    radius: f32,
}

impl Rod {
    fn new(piece: &Cylinder, shift: f64) -> (Self, Aabb) {
        let move_by = |[x, y, z]: [f64; 3]| vector([x, y + shift, z]);
        let (base, tip) = (move_by(piece.base()), move_by(piece.tip()));
        let (length, radius) = (piece.length_m() as f32, piece.radius_m() as f32);
        let axis = (tip - base) / length;
        let reach = (Vector::splat(1.0) - axis * axis).max(Vector::splat(0.0));
        let reach =
            Vector::new(reach.x.sqrt(), reach.y.sqrt(), reach.z.sqrt()) * radius + Vector::splat(2e-5);
        (Self { base, axis, length, radius }, Aabb::new(base.min(tip) - reach, base.max(tip) + reach))
    }

    #[inline(always)]
    fn meet(&self, ray: &Ray) -> Option<f32> {
        let from_base = ray.origin - self.base;
        let along = ray.dir.dot(self.axis);
        let height = from_base.dot(self.axis);
        let across = ray.dir - self.axis * along;
        let offset = from_base - self.axis * height;
        let square = across.length_squared();
        let middle = -offset.dot(across) / square;
        let nearest = offset + across * middle;
        let inside = self.radius * self.radius - nearest.length_squared();
        if inside < 0.0 {
            return None;
        }
        let half = (inside / square).sqrt();
        let (a, b) = (-height / along, (self.length - height) / along);
        let enter = (middle - half).max(a.min(b));
        let leave = (middle + half).min(a.max(b));
        (enter <= leave && leave > 0.0).then_some(if enter > 0.0 { enter } else { leave })
    }
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn unit(v: [f64; 3]) -> [f64; 3] {
    let length = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    v.map(|c| c / length)
}
