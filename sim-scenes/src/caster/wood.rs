//! The wood kernel: the beams that may meet a cylinder, then the exact quadratic. Eight cylinders at a time find their beams, eight
//! beams at a time are solved.

use pulp::{Simd, WithSimd};

use super::lanes::{Lanes, Mask, Row, WIDTH};
use super::leaves::Label;
use super::nearest::{GROUND, Nearest};
use super::row_index::{Extent, RowIndex};
use super::sight::{Part, Points, Sight, Turning};
use crate::organ::Cylinder;

/// A beam this near to the axis's direction (square of the sine) meets ends only.
const ALONG_AXIS: f64 = 1e-20;

/// How far a conservative outline is widened, relative; far above rounding.
const WIDER: f64 = 1.0 + 1e-9;

/// An axis that rises less than this along Y lies in the scan plane.
const LEVEL: f64 = 1e-12;

/// What eight cylinders are like.
#[derive(Clone, Debug)]
struct Shapes {
    base: [Row; 3],
    axis: [Row; 3],
    length: Row,
    radius: Row,
}

impl Shapes {
    const NONE: Self = Self {
        base: [Row::splat(0.0); 3],
        axis: [Row::splat(0.0); 3],
        length: Row::splat(0.0),
        radius: Row::splat(0.0),
    };

    /// One of `from` to another place.
    #[inline(always)]
    fn copy(&mut self, place: usize, from: &Self, lane: usize) {
        for axis in 0..3 {
            self.base[axis].0[place] = from.base[axis].0[lane];
            self.axis[axis].0[place] = from.axis[axis].0[lane];
        }
        self.length.0[place] = from.length.0[lane];
        self.radius.0[place] = from.radius.0[lane];
    }
}

/// Eight cylinders of the field.
#[derive(Clone, Debug)]
struct Poles {
    shapes: Shapes,
    /// How far a disk square to the axis reaches along Y from its middle.
    reach: Row,
    from: Row,
    to: Row,
}

impl Poles {
    /// Nothing anywhere.
    const NONE: Self = Self {
        shapes: Shapes::NONE,
        reach: Row::splat(0.0),
        from: Row::splat(f64::INFINITY),
        to: Row::splat(f64::NEG_INFINITY),
    };

    fn set(&mut self, lane: usize, piece: &Cylinder, shift: f64) {
        let length = piece.length_m();
        let (base, tip) = (piece.base(), piece.tip());
        for axis in 0..3 {
            self.shapes.base[axis].0[lane] = base[axis];
            self.shapes.axis[axis].0[lane] = (tip[axis] - base[axis]) / length;
        }
        self.shapes.base[1].0[lane] += shift;
        let extent = extent(piece);
        self.shapes.length.0[lane] = length;
        self.shapes.radius.0[lane] = piece.radius_m();
        self.reach.0[lane] = reach_m(piece);
        self.from.0[lane] = extent.from_m + shift;
        self.to.0[lane] = extent.to_m + shift;
    }
}

fn reach_m(piece: &Cylinder) -> f64 {
    let (base, tip) = (piece.base(), piece.tip());
    let flat = (tip[0] - base[0]).hypot(tip[2] - base[2]);
    piece.radius_m() * flat / piece.length_m() * WIDER + 1e-12
}

fn extent(piece: &Cylinder) -> Extent {
    let reach = reach_m(piece);
    Extent::around([piece.base()[1], piece.tip()[1]].into_iter().flat_map(|y| [y - reach, y + reach]))
}

/// All wood of an orchard, images over the border of the period included, in the order of the row index.
#[derive(Clone, Debug, Default)]
pub(super) struct WoodField {
    index: RowIndex,
    labels: Vec<Label>,
    poles: Vec<Poles>,
}

impl WoodField {
    pub(super) fn new<'a>(wood: impl Iterator<Item = (Label, &'a Cylinder)>, period_m: f64) -> Self {
        let images: Vec<(Label, &Cylinder, f64)> = wood
            .flat_map(|(label, piece)| extent(piece).images(period_m).map(move |shift| (label, piece, shift)))
            .collect();
        let extents: Vec<Extent> = images
            .iter()
            .map(|(_, piece, shift)| {
                let Extent { from_m, to_m } = extent(piece);
                Extent { from_m: from_m + shift, to_m: to_m + shift }
            })
            .collect();
        let (index, order) = RowIndex::new(&extents);
        let mut field = Self { index, ..Self::default() };
        for eight in order.chunks(WIDTH) {
            let mut poles = Poles::NONE;
            for (lane, number) in eight.iter().enumerate() {
                let image = number.and_then(|number| images.get(number));
                field.labels.push(image.map_or(Label { tree: u32::MAX, organ: u32::MAX }, |image| image.0));
                if let Some((_, piece, shift)) = image {
                    poles.set(lane, piece, *shift);
                }
            }
            field.poles.push(poles);
        }
        field
    }

    /// Number of entries.
    pub(super) fn len(&self) -> usize {
        self.labels.len()
    }

    pub(super) fn label(&self, entry: usize) -> Option<Label> {
        self.labels.get(entry).copied()
    }
}

/// Enters the ground.
pub(super) struct GroundPass<'a, T> {
    pub(super) sight: &'a T,
    pub(super) part: Part,
    pub(super) nearest: &'a mut Nearest,
}

impl<T: Sight> WithSimd for GroundPass<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        ground(simd, self.sight, self.part, self.nearest);
    }
}

/// Enters what ends beams: every branch that the plane of `origin` cuts. Owners are counted from `first_owner`.
pub(super) struct FloorPass<'a, T> {
    pub(super) field: &'a WoodField,
    pub(super) sight: &'a T,
    pub(super) part: Part,
    pub(super) first_owner: usize,
    pub(super) nearest: &'a mut Nearest,
}

impl<T: Sight> WithSimd for FloorPass<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { field, sight, part: of, first_owner, nearest } = self;
        let mut meetings = Meetings::NONE;
        let turning = Turning::of(sight);
        let (mut low, mut high) = (Row::splat(0.0), Row::splat(0.0));
        for eights in field.index.rows(of.y_m.0, of.y_m.1) {
            for eight in eights {
                let Some(poles) = field.poles.get(eight) else { continue };
                intervals(simd, poles, sight, of, (&mut low, &mut high));
                for lane in 0..WIDTH {
                    let owner = (first_owner + eight * WIDTH + lane) as f64;
                    let mut runs = turning.runs::<1>(low.0[lane], high.0[lane]);
                    while let Some(beams) = runs.next() {
                        for beam in beams.start.max(of.beams.0)..beams.end.min(of.beams.1) {
                            meetings.push((&poles.shapes, lane), owner, beam, sight);
                            if meetings.count == WIDTH {
                                meetings.settle(simd, of.origin, sight, nearest);
                            }
                        }
                    }
                }
            }
        }
        meetings.settle(simd, of.origin, sight, nearest);
    }
}

/// Up to eight beams, each with a cylinder that it may meet. Most cylinders are a beam or two wide: a register of beams for each would
/// be nearly empty.
struct Meetings {
    shapes: Shapes,
    p: Row,
    q: Row,
    /// How far the scanner has come when the beam starts.
    moved: Row,
    owner: [f64; WIDTH],
    beam: [usize; WIDTH],
    count: usize,
}

impl Meetings {
    const NONE: Self = Self {
        shapes: Shapes::NONE,
        p: Row::splat(0.0),
        q: Row::splat(0.0),
        moved: Row::splat(0.0),
        owner: [0.0; WIDTH],
        beam: [0; WIDTH],
        count: 0,
    };

    #[inline(always)]
    fn push<T: Sight>(&mut self, (shapes, lane): (&Shapes, usize), owner: f64, beam: usize, sight: &T) {
        let (p, q) = sight.parameters();
        let (Some(p), Some(q)) = (p.get(beam / WIDTH), q.get(beam / WIDTH)) else { return };
        let place = self.count % WIDTH;
        self.shapes.copy(place, shapes, lane);
        self.p.0[place] = p.0[beam % WIDTH];
        self.q.0[place] = q.0[beam % WIDTH];
        self.moved.0[place] = beam as f64 * sight.advance_m();
        self.owner[place] = owner;
        self.beam[place] = beam;
        self.count += 1;
    }

    /// Ends the beams that meet theirs, in the order they came in, and forgets them all.
    #[inline(always)]
    fn settle<S: Simd, T: Sight>(&mut self, simd: S, origin: [f64; 3], sight: &T, nearest: &mut Nearest) {
        let (mut keys, mut cosines) = (Row::splat(0.0), Row::splat(0.0));
        for part in 0..Row::parts::<S>() {
            let rays = sight.rays(simd, self.p.load(simd, part), self.q.load(simd, part));
            let start = Vector(rays.start.0, self.moved.load(simd, part), rays.start.1);
            let pole = Pole::load(simd, part, &self.shapes, origin);
            let (met, range, cos) = pole.hit(start, rays.direction);
            let never = Lanes::splat(simd, f64::NEG_INFINITY);
            keys.store(part, met.select(T::key(simd, range), never));
            cosines.store(part, cos);
        }
        for place in 0..self.count.min(WIDTH) {
            nearest.end_beam(self.beam[place], keys.0[place], self.owner[place], cosines.0[place]);
        }
        self.count = 0;
    }
}

/// Enters the plane Z = 0 where beams that start above it look down.
#[inline(always)]
fn ground<S: Simd, T: Sight>(simd: S, sight: &T, of: Part, nearest: &mut Nearest) {
    let (p, q) = sight.parameters();
    let zero = Lanes::splat(simd, 0.0);
    for (row, (p, q)) in p.iter().zip(q).enumerate() {
        for part in 0..Row::parts::<S>() {
            let rays = sight.rays(simd, p.load(simd, part), q.load(simd, part));
            let height = Lanes::splat(simd, of.origin[2]) + rays.start.1;
            let (_, own) = of.beams_of(simd, 0.0, row, part);
            let cos = -rays.direction.1;
            let met = zero.lt(height).and(zero.lt(cos)).and(own);
            floor(simd, nearest, (row, part), met, T::key(simd, height / cos), GROUND, cos);
        }
    }
}

/// Enters what ends eight beams where `met` and nearer than what does so far.
#[inline(always)]
fn floor<S: Simd>(
    simd: S,
    nearest: &mut Nearest,
    (row, part): (usize, usize),
    met: Mask<S>,
    key: Lanes<S>,
    owner: f64,
    cos: Lanes<S>,
) {
    let Nearest { floor_key, floor_owner, floor_cos, .. } = nearest;
    let (Some(keys), Some(owners), Some(cosines)) =
        (floor_key.get_mut(row), floor_owner.get_mut(row), floor_cos.get_mut(row))
    else {
        return;
    };
    let old = keys.load(simd, part);
    let nearer = met.and(old.lt(key));
    keys.store(part, nearer.select(key, old));
    owners.store(part, nearer.select(Lanes::splat(simd, owner), owners.load(simd, part)));
    cosines.store(part, nearer.select(cos, cosines.load(simd, part)));
}

/// The beams that may meet each of eight cylinders. What the plane cuts lies within a capsule: disks about that part of the axis
/// that is within reach of the plane.
#[inline(always)]
fn intervals<S: Simd, T: Sight>(
    simd: S,
    poles: &Poles,
    sight: &T,
    of: Part,
    (low, high): (&mut Row, &mut Row),
) {
    let (x_m, z_m) = (Lanes::splat(simd, of.origin[0]), Lanes::splat(simd, of.origin[2]));
    let (least_m, most_m) = (Lanes::splat(simd, of.y_m.0), Lanes::splat(simd, of.y_m.1));
    let zero = Lanes::splat(simd, 0.0);
    for part in 0..Row::parts::<S>() {
        let Shapes { base, axis, length, radius } = &poles.shapes;
        let (base, axis) = (Vector::load(simd, part, base), Vector::load(simd, part, axis));
        let (length, reach) = (length.load(simd, part), poles.reach.load(simd, part));
        let near = poles.from.load(simd, part).le(most_m).and(least_m.le(poles.to.load(simd, part)));
        if near.is_empty() {
            low.store(part, zero.of(f64::INFINITY));
            continue;
        }
        // Part of the axis (metres from the base) whose disks reach the plane, or any of the planes of a moving scanner.
        let (one, other) = ((least_m - reach - base.1) / axis.1, (most_m + reach - base.1) / axis.1);
        let spare = length * zero.of(1e-9);
        let level = axis.1.abs().lt(zero.of(LEVEL));
        let from = level.select(zero, (one.min(other) - spare).max(zero).min(length));
        let to = level.select(length, (one.max(other) + spare).max(zero).min(length));
        let from = Points(base.0 + axis.0 * from - x_m, base.2 + axis.2 * from - z_m);
        let to = Points(base.0 + axis.0 * to - x_m, base.2 + axis.2 * to - z_m);
        let radius = radius.load(simd, part) * zero.of(WIDER) + zero.of(1e-12);
        let (first, last) = sight.swept(simd, from, to, radius);
        low.store(part, near.select(first, zero.of(f64::INFINITY)));
        high.store(part, last);
    }
}

/// A register of vectors.
#[derive(Clone, Copy)]
struct Vector<S: Simd>(Lanes<S>, Lanes<S>, Lanes<S>);

impl<S: Simd> Vector<S> {
    #[inline(always)]
    fn load(simd: S, part: usize, [x, y, z]: &[Row; 3]) -> Self {
        Self(x.load(simd, part), y.load(simd, part), z.load(simd, part))
    }

    #[inline(always)]
    fn dot(self, other: Self) -> Lanes<S> {
        self.0 * other.0 + self.1 * other.1 + self.2 * other.2
    }

    /// self + other · factor
    #[inline(always)]
    fn plus(self, other: Self, factor: Lanes<S>) -> Self {
        Self(self.0 + other.0 * factor, self.1 + other.1 * factor, self.2 + other.2 * factor)
    }
}

/// A register of cylinders as seen from the line's origin.
struct Pole<S: Simd> {
    /// Origin from the base.
    from_base: Vector<S>,
    axis: Vector<S>,
    length: Lanes<S>,
    radius: Lanes<S>,
}

impl<S: Simd> Pole<S> {
    #[inline(always)]
    fn load(simd: S, part: usize, shapes: &Shapes, [x, y, z]: [f64; 3]) -> Self {
        let Vector(base_x, base_y, base_z) = Vector::load(simd, part, &shapes.base);
        let (x, y, z) = (base_x.of(x), base_x.of(y), base_x.of(z));
        Self {
            from_base: Vector(x - base_x, y - base_y, z - base_z),
            axis: Vector::load(simd, part, &shapes.axis),
            length: shapes.length.load(simd, part),
            radius: shapes.radius.load(simd, part),
        }
    }

    /// First surface along (`x`, 0, `z`) from `start` (counted from the line's origin): whether met, how far, and |beam · normal|
    /// there. Where the beam enters, or leaves if it starts inside.
    ///
    /// The solid is an infinite cylinder between two planes: both convex, so the beam is inside both from the later entry to the
    /// earlier exit. The quadratic is taken about the point nearest the axis, where nothing cancels.
    #[inline(always)]
    fn hit(&self, start: Vector<S>, Points(x, z): Points<S>) -> (Mask<S>, Lanes<S>, Lanes<S>) {
        let (zero, far) = (x.of(0.0), x.of(f64::INFINITY));
        let axis = self.axis;
        let from_base = self.from_base.plus(start, x.of(1.0));
        let beam = Vector(x, zero, z);
        let along = beam.dot(axis);
        let height = from_base.dot(axis);
        let (low, high) = (-height / along, (self.length - height) / along);
        let slanted = zero.lt(along.abs());
        let between = zero.le(height).and(height.le(self.length));
        let enter_slab = slanted.select(low.min(high), between.select(-far, far));
        let leave_slab = slanted.select(low.max(high), between.select(far, -far));
        let across = beam.plus(axis, -along);
        let offset = from_base.plus(axis, -height);
        let square = across.dot(across);
        let turned = square.of(ALONG_AXIS).lt(square);
        let middle = turned.select(-offset.dot(across) / square, zero);
        let nearest = offset.plus(across, middle);
        let inside = self.radius * self.radius - nearest.dot(nearest);
        let half = turned.select((inside.max(zero) / square).sqrt(), far);
        let (enter_side, leave_side) = (middle - half, middle + half);
        let (enter, leave) = (enter_side.max(enter_slab), leave_side.min(leave_slab));
        let met = zero.le(inside).and(enter.le(leave)).and(zero.lt(leave));
        let outside = zero.lt(enter);
        let range = outside.select(enter, leave);
        let on_side = square * half / self.radius;
        let by_enter = enter_slab.lt(enter_side).select(on_side, along.abs());
        let by_leave = leave_side.lt(leave_slab).select(on_side, along.abs());
        (met, range, outside.select(by_enter, by_leave))
    }
}
