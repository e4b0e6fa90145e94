//! The wood kernel: the beams that may meet a cylinder, then the exact quadratic. Eight cylinders at a time find their beams, eight
//! beams at a time are solved.

use pulp::{Simd, WithSimd};

use super::nearest::{GROUND, Nearest, marked};
use super::shapes::Vertex;
use super::sight::{Part, Points, Sight};
use super::spans::{Spans, for_beams};
use super::turned::Frame;
use super::wood_field::{LEVEL, Poles, WIDER, WoodField};
use crate::lanes::{Lanes, Mask, Row};

/// A beam this near to the axis's direction (square of the sine) meets ends only.
const ALONG_AXIS: f64 = 1e-20;

/// A beam that comes no nearer to the axis's direction than this (cosine) never meets ends.
const SQUARE_ON: f64 = 1e-300;

/// How much farther a disk is looked for in a plane that leans, metres: far above rounding.
const SPARE_M: f64 = 1e-9;

/// Enters the level plane under all where beams that start above it look down.
pub(super) struct GroundPass<'a, T> {
    pub(super) sight: &'a T,
    pub(super) part: Part,
    /// Its height.
    pub(super) plane_m: f64,
    pub(super) nearest: &'a mut Nearest,
}

impl<T: Sight> WithSimd for GroundPass<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { sight, part, plane_m, nearest } = self;
        let (p, q) = sight.parameters();
        let (Some(q), Some((mut floor, _))) = (q.get(..p.len()), nearest.floor(p.len())) else { return };
        let zero = Lanes::splat(simd, 0.0);
        let owner = marked(GROUND);
        for beam in (0..sight.count()).step_by(S::F64_LANES) {
            let (Some(p), Some(q)) = (Lanes::read(simd, p, beam), Lanes::read(simd, q, beam)) else { break };
            let rays = sight.rays(simd, p, q);
            let height = Lanes::splat(simd, part.origin[2] - plane_m) + rays.start.1;
            let cos = if T::LEANS {
                let [.., to_row] = sight.axes().to_row;
                let [.., up] = sight.axes().up;
                -(rays.direction.0 * zero.of(to_row) + rays.direction.1 * zero.of(up))
            } else {
                -rays.direction.1
            };
            let met = zero.lt(height).and(zero.lt(cos));
            if !met.is_empty() {
                floor.end(simd, beam, met, T::key(simd, height / cos), owner, cos);
            }
        }
    }
}

/// Enters what ends beams: every branch that the plane of a line cuts.
pub(super) struct FloorPass<'a, T> {
    pub(super) field: &'a WoodField,
    pub(super) sight: &'a T,
    pub(super) part: Part,
    /// Whose the organs are, if a copy's.
    pub(super) copy: Option<u32>,
    pub(super) nearest: &'a mut Nearest,
}

impl<T: Sight> WithSimd for FloorPass<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { field, sight, part, copy, nearest } = self;
        let (p, q) = sight.parameters();
        let (Some(q), Some((mut floor, owners))) = (q.get(..p.len()), nearest.floor(p.len())) else { return };
        let (mut aspects, mut spans) = (Aspects::NONE, Spans::of(sight.turn(), sight.count()));
        let advance = Lanes::splat(simd, sight.advance_m());
        let still = T::ONE_START && sight.advance_m() == 0.0;
        // A metre of it.
        let [x_a_metre, y_a_metre, z_a_metre] = sight.axes().seen([0.0, 1.0, 0.0]);
        for eights in field.index.eights(part.y_m) {
            for eight in eights {
                let eight = *eight as usize;
                let Some(poles) = field.eight(eight) else { continue };
                if !aspects.look(simd, poles, sight, part, &mut spans) {
                    continue;
                }
                let first_owner = owners.list(field.tags(eight), copy);
                for lane in spans.asked().iter() {
                    let owner = marked(first_owner + lane);
                    let pole = Pole::load::<T>(simd, poles, &aspects, lane);
                    for_beams!(S, spans, lane, |beam, last| {
                        let (Some(p), Some(q)) = (Lanes::read(simd, p, beam), Lanes::read(simd, q, beam))
                        else {
                            break;
                        };
                        let rays = sight.rays(simd, p, q);
                        let (height, offset) = if still {
                            (pole.height, pole.offset)
                        } else {
                            let moved = Lanes::count_from(simd, beam) * advance;
                            // Term by term: a closure over an array is not compiled for these registers.
                            let along = |metre| Lanes::splat(simd, metre) * moved;
                            pole.seen_from(if T::LEANS {
                                Vector(along(x_a_metre), along(y_a_metre), along(z_a_metre))
                            } else {
                                Vector(rays.start.0, moved, rays.start.1)
                            })
                        };
                        let (met, range, cos) = pole.hit(height, offset, rays.direction);
                        floor.end(simd, beam, met, T::key(simd, range), owner, cos);
                    });
                }
            }
        }
    }
}

/// Eight cylinders as seen from the line's origin.
struct Aspects {
    /// How far along the axis the origin lies from the base.
    height: Row,
    /// From the point of the axis there to the origin.
    offset: [Row; 3],
    /// The axes, where the plane leans.
    axis: [Row; 3],
}

impl Aspects {
    const NONE: Self =
        Self { height: Row::splat(0.0), offset: [Row::splat(0.0); 3], axis: [Row::splat(0.0); 3] };

    /// How the eight are seen, and the beams that may meet each; false if none may. What the plane cuts lies within disks about that part
    /// of the axis that is within reach of the plane, and all of them within one about its middle.
    #[inline(always)]
    fn look<S: Simd, T: Sight>(
        &mut self,
        simd: S,
        poles: &Poles,
        sight: &T,
        of: Part,
        spans: &mut Spans,
    ) -> bool {
        let [x_m, y_m, z_m] = of.origin;
        let (x_m, y_m, z_m) = (Lanes::splat(simd, x_m), Lanes::splat(simd, y_m), Lanes::splat(simd, z_m));
        let (least_m, most_m) = (Lanes::splat(simd, of.y_m.0), Lanes::splat(simd, of.y_m.1));
        let zero = Lanes::splat(simd, 0.0);
        let [first_m, last_m] = plane_y_m(sight, of).map(|y_m| zero.of(y_m));
        let mut any = false;
        for part in 0..Row::parts::<S>() {
            let near = poles.from.load(simd, part).le(most_m).and(least_m.le(poles.to.load(simd, part)));
            any |= !near.is_empty();
            let base = Vector::load(simd, part, &poles.base);
            let mut axis = Vector::load(simd, part, &poles.axis);
            let mut from_base = Vector(x_m - base.0, y_m - base.1, z_m - base.2);
            let radius = poles.radius.load(simd, part);
            let (mut reach, mut pitch) = (poles.reach.load(simd, part), poles.pitch.load(simd, part));
            // Where the axis begins along the plane's Y, as the ends of what beams start at count it.
            let mut base_y = base.1;
            if T::LEANS {
                let frame = Frame::of(simd, sight.axes());
                (axis, from_base) = (axis.seen(frame), from_base.seen(frame));
                for (row, value) in self.axis.iter_mut().zip([axis.0, axis.1, axis.2]) {
                    row.store(part, value);
                }
                (reach, pitch) = leaning_pole(axis, radius);
                base_y = -from_base.1;
            }
            let height = from_base.dot(axis);
            let offset = from_base.plus(axis, -height);
            self.height.store(part, height);
            self.offset[0].store(part, offset.0);
            self.offset[1].store(part, offset.1);
            self.offset[2].store(part, offset.2);
            // Part of the axis (metres from the base) whose disks reach the plane, or any of the planes of a moving scanner.
            let length = poles.length.load(simd, part);
            let (one, other) = ((first_m - reach - base_y) * pitch, (last_m + reach - base_y) * pitch);
            let spare = length * zero.of(1e-9);
            let rises = pitch.abs().lt(zero.of(f64::INFINITY));
            let from = rises.select((one.min(other) - spare).max(zero).min(length), zero);
            let to = rises.select((one.max(other) + spare).max(zero).min(length), length);
            let (middle, half) = ((from + to) * zero.of(0.5), (to - from) * zero.of(0.5));
            let around = Points(axis.0 * middle - from_base.0, axis.2 * middle - from_base.2);
            // No shorter than the part as seen along Y.
            let length = half * (axis.0.abs() + axis.2.abs());
            let radius = (length + radius) * zero.of(WIDER) + zero.of(1e-12);
            let (first, last) = sight.meeting(around, radius);
            spans.set(part, near.select(first, zero.of(f64::INFINITY)), last);
        }
        any
    }
}

/// Where along the plane's own Y beams start first and last; for a level one that is the scene's.
fn plane_y_m<T: Sight>(sight: &T, of: Part) -> [f64; 2] {
    let (first_m, last_m) = of.starts_m;
    if !T::LEANS {
        return [first_m, last_m];
    }
    let [_, ahead, _] = sight.axes().ahead;
    [first_m, last_m].map(|start_m| (start_m - of.origin[1]) * ahead)
}

/// How far a disk square to the axis reaches along a leaning plane's Y, and metres along the axis for a metre along it.
#[inline(always)]
fn leaning_pole<S: Simd>(axis: Vector<S>, radius: Lanes<S>) -> (Lanes<S>, Lanes<S>) {
    let one = radius.of(1.0);
    let flat = (one - axis.1 * axis.1).max(one.of(0.0)).sqrt();
    let level = axis.1.abs().le(one.of(LEVEL));
    let pitch = level.select(one.of(f64::INFINITY), one / axis.1);
    (radius * flat * one.of(WIDER) + one.of(SPARE_M), pitch)
}

/// A register of vectors.
#[derive(Clone, Copy)]
struct Vector<S: Simd>(Lanes<S>, Lanes<S>, Lanes<S>);

impl<S: Simd> Vector<S> {
    #[inline(always)]
    fn load(simd: S, part: usize, [x, y, z]: &[Row; 3]) -> Self {
        Self(x.load(simd, part), y.load(simd, part), z.load(simd, part))
    }

    /// In a frame's axes.
    #[inline(always)]
    fn seen(self, frame: Frame<S>) -> Self {
        let Vertex { x, y, z } = frame.seen(Vertex { x: self.0, y: self.1, z: self.2 });
        Self(x, y, z)
    }

    /// The vector of lane `lane` everywhere.
    #[inline(always)]
    fn of_lane(simd: S, lane: usize, [x, y, z]: &[Row; 3]) -> Self {
        Self(x.everywhere(simd, lane), y.everywhere(simd, lane), z.everywhere(simd, lane))
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

/// One cylinder, in every place of a register.
struct Pole<S: Simd> {
    axis: Vector<S>,
    length: Lanes<S>,
    radius: Lanes<S>,
    inverse_radius: Lanes<S>,
    /// As in [`Aspects`].
    height: Lanes<S>,
    offset: Vector<S>,
}

impl<S: Simd> Pole<S> {
    #[inline(always)]
    fn load<T: Sight>(simd: S, poles: &Poles, aspects: &Aspects, lane: usize) -> Self {
        Self {
            axis: Vector::of_lane(simd, lane, if T::LEANS { &aspects.axis } else { &poles.axis }),
            length: poles.length.everywhere(simd, lane),
            radius: poles.radius.everywhere(simd, lane),
            inverse_radius: poles.inverse_radius.everywhere(simd, lane),
            height: aspects.height.everywhere(simd, lane),
            offset: Vector::of_lane(simd, lane, &aspects.offset),
        }
    }

    /// Height and offset for beams that start elsewhere, `start` from the line's origin.
    #[inline(always)]
    fn seen_from(&self, start: Vector<S>) -> (Lanes<S>, Vector<S>) {
        let along = start.dot(self.axis);
        let offset = self.offset.plus(start, along.of(1.0)).plus(self.axis, -along);
        (self.height + along, offset)
    }

    /// First surface along (`x`, 0, `z`): whether met, how far, and |beam · normal| there. Where the beam enters, or leaves if it starts
    /// inside.
    ///
    /// Distances from the axis along a beam are a parabola. What it opens with (`square`) and its least value are taken from products
    /// across the axis, in which nothing cancels. Most beams meet the side, or nothing: only then are ends asked.
    #[inline(always)]
    fn hit(
        &self,
        height: Lanes<S>,
        offset: Vector<S>,
        Points(x, z): Points<S>,
    ) -> (Mask<S>, Lanes<S>, Lanes<S>) {
        let (zero, axis) = (x.of(0.0), self.axis);
        let along = x * axis.0 + z * axis.2;
        // |beam × axis|²
        let turn = z * axis.0 - x * axis.2;
        let square = axis.1 * axis.1 + turn * turn;
        // By how much a beam passes beside the axis, times |beam × axis|.
        let beside =
            x * (axis.1 * offset.2 - axis.2 * offset.1) + z * (axis.0 * offset.1 - axis.1 * offset.0);
        let inside = self.radius * self.radius * square - beside * beside;
        let half = inside.max(zero).sqrt();
        let middle = -(offset.0 * x + offset.2 * z);
        let enter = middle - half;
        // Heights and distances times `square`: the side is met ahead, and between the ends.
        let (at, top) = (height * square + along * enter, self.length * square);
        let near = zero.le(inside).and(zero.le(middle + half));
        let elsewhere = enter.le(zero).or(at.lt(zero)).or(top.lt(at));
        let on_axis = square.le(zero.of(ALONG_AXIS));
        let cos = half * self.inverse_radius;
        if near.and(elsewhere).or(on_axis).is_empty() {
            return (near, enter / square, cos);
        }
        // The solid is an infinite cylinder between two planes: both convex, so the beam is inside both from the later entry to the
        // earlier exit.
        let far = zero.of(f64::INFINITY);
        let aside = (self.radius * self.radius).lt(offset.dot(offset));
        let never = aside.select(far, -far);
        let enter_side = on_axis.select(never, enter / square);
        let leave_side = on_axis.select(-never, (middle + half) / square);
        let (low, high) = (-height / along, (self.length - height) / along);
        let slanted = zero.of(SQUARE_ON).lt(along.abs());
        let between = zero.le(height).and(height.le(self.length));
        let enter_slab = slanted.select(low.min(high), between.select(-far, far));
        let leave_slab = slanted.select(low.max(high), between.select(far, -far));
        let (enter, leave) = (enter_side.max(enter_slab), leave_side.min(leave_slab));
        let met = zero.le(inside).or(on_axis).and(enter.le(leave)).and(zero.lt(leave));
        let outside = zero.lt(enter);
        let by_enter = enter_slab.lt(enter_side).select(cos, along.abs());
        let by_leave = leave_side.lt(leave_slab).select(cos, along.abs());
        (met, outside.select(enter, leave), outside.select(by_enter, by_leave))
    }
}
