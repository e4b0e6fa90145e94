//! The projection of a leaf along a line.

use pulp::Simd;

use super::blades::{Blade, Blades, Plane};
use super::cells::Bounds;
use crate::lanes::{Lanes, Mask, Row, WIDTH, padded};

/// An edge of a projected outline.
#[derive(Clone, Copy)]
struct Edge {
    from: (f64, f64),
    to: (f64, f64),
    /// How far u goes for each v.
    slope: f64,
}

/// The projection of one leaf after the other.
pub(super) struct Shadow {
    u: Vec<f64>,
    v: Vec<f64>,
    slope: Vec<f64>,
    edges: Vec<Edge>,
    pub(super) bounds: Bounds,
}

impl Shadow {
    pub(super) fn new() -> Self {
        let list = || padded(vec![0.0; WIDTH]);
        Self { u: list(), v: list(), slope: list(), edges: vec![], bounds: Bounds::of(std::iter::empty()) }
    }

    /// Projects a leaf.
    #[inline(always)]
    pub(super) fn cast<S: Simd>(&mut self, simd: S, plane: &Plane, blades: &Blades, blade: &Blade) {
        let Self { u: all_u, v: all_v, slope: slopes, edges, bounds } = self;
        let rows = blades.rows(blade);
        let count = rows.len();
        if all_u.len() < (count + 1) * WIDTH {
            for list in [&mut *all_u, &mut *all_v, &mut *slopes] {
                *list = padded(vec![0.0; count * WIDTH]);
            }
        }
        let none = Lanes::splat(simd, f64::INFINITY);
        let (mut low_u, mut low_v, mut high_u, mut high_v) = (none, none, -none, -none);
        for (k, [x, y, z]) in rows.iter().enumerate() {
            for part in 0..Row::parts::<S>() {
                let (x, y, z) = (x.load(simd, part), y.load(simd, part), z.load(simd, part));
                let u = x * x.of(plane.u.x) + y * x.of(plane.u.y) + z * x.of(plane.u.z);
                let v = x * x.of(plane.v.x) + y * x.of(plane.v.y) + z * x.of(plane.v.z);
                (low_u, high_u) = (low_u.min(u), high_u.max(u));
                (low_v, high_v) = (low_v.min(v), high_v.max(v));
                let at = k * WIDTH + part * S::F64_LANES;
                u.write(all_u, at);
                v.write(all_v, at);
            }
        }
        *bounds = Bounds { low: (low_u.least(), low_v.least()), high: (high_u.most(), high_v.most()) };
        // The last vertex joins the first.
        for list in [&mut *all_u, &mut *all_v] {
            if let Some(first) = list.first().copied()
                && let Some(last) = list.get_mut(count * WIDTH)
            {
                *last = first;
            }
        }
        for at in (0..count * WIDTH).step_by(S::F64_LANES) {
            if let (Some(from_u), Some(from_v), Some(to_u), Some(to_v)) = (
                Lanes::read(simd, all_u, at),
                Lanes::read(simd, all_v, at),
                Lanes::read(simd, all_u, at + 1),
                Lanes::read(simd, all_v, at + 1),
            ) {
                ((to_u - from_u) / (to_v - from_v)).write(slopes, at);
            }
        }
        edges.clear();
        for ((u, v), slope) in all_u.windows(2).zip(all_v.windows(2)).zip(&*slopes).take(blade.vertices) {
            if let ([from_u, to_u], [from_v, to_v]) = (u, v) {
                edges.push(Edge { from: (*from_u, *from_v), to: (*to_u, *to_v), slope: *slope });
            }
        }
    }

    /// Which points lie within: even-odd rule; each edge owns its lower end.
    #[inline(always)]
    pub(super) fn holds<S: Simd>(&self, u: Lanes<S>, v: Lanes<S>) -> Mask<S> {
        let mut within = u.lt(u);
        let Some(Edge { from, .. }) = self.edges.first() else { return within };
        let mut below = v.lt(u.of(from.1));
        for Edge { from, to, slope } in &self.edges {
            let before = std::mem::replace(&mut below, v.lt(u.of(to.1)));
            let crossing = u.of(from.0) + (v - u.of(from.1)) * u.of(*slope);
            within = within.xor(before.xor(below).and(u.lt(crossing)));
        }
        within
    }

    /// Which squares of half a side `half` about these middles lie to the left of all edges, to the right if `turned`: no edge crosses
    /// them.
    #[inline(always)]
    pub(super) fn clear<S: Simd>(&self, u: Lanes<S>, v: f64, half: f64, turned: bool) -> Mask<S> {
        let sign = if turned { -1.0 } else { 1.0 };
        let mut clear = u.le(u);
        for Edge { from, to, .. } in &self.edges {
            let (along_u, along_v) = (sign * (to.0 - from.0), sign * (to.1 - from.1));
            // Left of the edge by more than the farthest corner: along × (middle − from) > half (|along_u| + |along_v|).
            let rest = along_u * (v - from.1) - half * (along_u.abs() + along_v.abs());
            clear = clear.and(((u - u.of(from.0)) * u.of(along_v)).lt(u.of(rest)));
        }
        clear
    }
}
