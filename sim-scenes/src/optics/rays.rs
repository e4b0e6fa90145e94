//! Rays as beams gather them: in registers of eight beams side by side.
//!
//! The rays that eight beams in a row have at the same angle from their axes are `fold` apart. So rays are kept by their remainder modulo
//! `fold`, and those of a remainder in their order: eight such rays are one register.

use pulp::{Simd, WithSimd};

use super::spot::{Plane, SpotGrid};
use super::swept::{Swept, SweptRow};
use crate::caster::Return;
use crate::lanes::{Lanes, Row, WIDTH};

/// The rays of all planes, ready for the beams that they lie in. What met nothing has no share.
#[derive(Clone, Debug)]
pub(super) struct Rays {
    fold: usize,
    /// Rays before ray 0, so that the first beam's ray begins a register.
    lead: usize,
    /// Places for the rays of one remainder.
    stride: usize,
    range_m: Vec<f64>,
    /// Power that comes back of a share of 1.
    gain: Vec<f64>,
    reach_rad: Vec<f64>,
    flat_rad: Vec<f64>,
    density: Vec<f64>,
    slope: Vec<f64>,
    /// Rays to each side of their axes that eight beams reach, plane by plane.
    reaches: Vec<usize>,
    beam_rows: usize,
}

/// A ray's place, from which the next ones follow.
#[derive(Clone, Copy)]
pub(super) struct Place {
    remainder: usize,
    number: usize,
}

impl Rays {
    /// Room for `planes` planes of `count` rays, of which the first `margin` lie beyond the first of `beams` beams.
    pub(super) fn new(planes: usize, count: usize, grid: &SpotGrid, margin: usize, beams: usize) -> Self {
        let fold = grid.fold;
        let lead = margin.next_multiple_of(fold * WIDTH) - margin;
        // One register may be read from any place on.
        let stride = ((lead + count).div_ceil(fold) + WIDTH).next_multiple_of(WIDTH);
        let room = || vec![0.0; planes * fold * stride + WIDTH];
        let beam_rows = beams.div_ceil(WIDTH);
        Self {
            fold,
            lead,
            stride,
            range_m: vec![f64::INFINITY; planes * fold * stride + WIDTH],
            gain: room(),
            reach_rad: room(),
            flat_rad: room(),
            density: room(),
            slope: room(),
            reaches: vec![0; planes * beam_rows],
            beam_rows,
        }
    }

    /// Takes in what the rays of plane number `number` met; `surface` is what comes back of a ray at 1 m.
    pub(super) fn fill(&mut self, number: usize, returns: &[Return], surface: impl Fn(&Return) -> f64) {
        let Self { fold, lead, stride, .. } = *self;
        let plane = number * fold * stride..(number + 1) * fold * stride;
        let (Some(ranges), Some(gains)) = (self.range_m.get_mut(plane.clone()), self.gain.get_mut(plane))
        else {
            return;
        };
        let rows = ranges.chunks_exact_mut(stride).zip(gains.chunks_exact_mut(stride));
        for (remainder, (ranges, gains)) in rows.enumerate() {
            let first = (remainder + fold - lead % fold) % fold;
            let from = (first + lead) / fold;
            let (Some(ranges), Some(gains)) = (ranges.get_mut(from..), gains.get_mut(from..)) else { break };
            let mut ray = first;
            for (range_m, power) in ranges.iter_mut().zip(gains) {
                let Some(found) = returns.get(ray) else { break };
                // A miss is infinitely far away: of its surface nothing comes back.
                (*range_m, *power) = (found.range_m, surface(found));
                ray += fold;
            }
        }
    }

    /// The place of ray `ray`.
    pub(super) fn place(&self, ray: usize) -> Place {
        Place { remainder: (ray + self.lead) % self.fold, number: (ray + self.lead) / self.fold }
    }

    /// The place after this one.
    #[inline(always)]
    pub(super) fn next(&self, Place { remainder, number }: Place) -> Place {
        let last = remainder + 1 == self.fold;
        Place { remainder: if last { 0 } else { remainder + 1 }, number: number + usize::from(last) }
    }

    /// Where lists have a place of a plane.
    #[inline(always)]
    pub(super) fn at(&self, plane: usize, Place { remainder, number }: Place) -> usize {
        (plane * self.fold + remainder) * self.stride + number
    }

    #[inline(always)]
    pub(super) fn swept<S: Simd>(&self, simd: S, at: usize) -> Option<Swept<S>> {
        Some(Swept {
            reach_rad: Lanes::read(simd, &self.reach_rad, at)?,
            flat_rad: Lanes::read(simd, &self.flat_rad, at)?,
            density: Lanes::read(simd, &self.density, at)?,
            slope: Lanes::read(simd, &self.slope, at)?,
        })
    }

    /// Range and gain of a register of rays.
    #[inline(always)]
    pub(super) fn met<S: Simd>(&self, simd: S, at: usize) -> Option<[Lanes<S>; 2]> {
        Some([Lanes::read(simd, &self.range_m, at)?, Lanes::read(simd, &self.gain, at)?])
    }

    /// Rays to each side of their axes that the beams of row `row` reach in a plane.
    pub(super) fn reach(&self, plane: usize, row: usize) -> usize {
        self.reaches.get(plane * self.beam_rows + row).copied().unwrap_or_default()
    }
}

/// Finds what the rays of a plane stand for.
pub(super) struct Weigh<'a> {
    pub(super) rays: &'a mut Rays,
    pub(super) grid: &'a SpotGrid,
    pub(super) number: usize,
    pub(super) plane: &'a Plane,
    /// Rays that there are beyond the outermost beams.
    pub(super) margin: usize,
}

impl WithSimd for Weigh<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { rays, grid, number, plane, margin } = self;
        let Rays { fold, lead, stride, beam_rows, .. } = *rays;
        let first = number * fold * stride;
        let Some(reaches) = rays.reaches.get_mut(number * beam_rows..(number + 1) * beam_rows) else {
            return;
        };
        reaches.fill(0);
        let zero = Lanes::splat(simd, 0.0);
        let before = (margin + lead) / (fold * WIDTH);
        for row in 0..stride / WIDTH {
            let mut widest_rad = Row::splat(0.0);
            for remainder in 0..fold {
                let at = first + remainder * stride + row * WIDTH;
                let places = at..at + WIDTH;
                let lists = (
                    rays.range_m.get(places.clone()),
                    rays.gain.get_mut(places.clone()),
                    rays.reach_rad.get_mut(places.clone()),
                    rays.flat_rad.get_mut(places.clone()),
                    rays.density.get_mut(places.clone()),
                    rays.slope.get_mut(places),
                );
                let (Some(ranges), Some(gain), Some(reach_rad), Some(flat_rad), Some(density), Some(slope)) =
                    lists
                else {
                    break;
                };
                let Ok(range_m) = ranges.try_into().map(Row) else { break };
                let mut swept = SweptRow::default();
                let mut met = false;
                for part in 0..Row::parts::<S>() {
                    let range = range_m.load(simd, part);
                    met |= !range.lt(range.of(f64::INFINITY)).is_empty();
                }
                if met {
                    let Ok(surface) = (&*gain).try_into().map(Row) else { break };
                    gain.copy_from_slice(&plane.sweep(simd, [&range_m, &surface], grid, &mut swept).0);
                    for part in 0..Row::parts::<S>() {
                        let Swept { reach_rad, density, .. } = swept.load(simd, part);
                        let widest = widest_rad.load(simd, part);
                        let wider = zero.lt(density).and(widest.lt(reach_rad));
                        widest_rad.store(part, wider.select(reach_rad, widest));
                    }
                    reach_rad.copy_from_slice(&swept.reach_rad.0);
                    flat_rad.copy_from_slice(&swept.flat_rad.0);
                }
                density.copy_from_slice(&swept.density.0);
                slope.copy_from_slice(&swept.slope.0);
            }
            let widest_rad = widest_rad.0.into_iter().fold(0.0, f64::max);
            if widest_rad > 0.0 {
                let reach = grid.rays_within(widest_rad).min(margin);
                let rows = reach.div_ceil(fold * WIDTH);
                // Row `row` of rays begins with the beams of row `row - before`.
                let (from, to) = (row.saturating_sub(before + rows), (row + rows + 1).saturating_sub(before));
                let near = reaches.get_mut(from..to.min(beam_rows));
                near.into_iter().flatten().for_each(|most| *most = reach.max(*most));
            }
        }
    }
}
