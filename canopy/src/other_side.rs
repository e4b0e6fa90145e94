//! One row from both of its alleys: what another pass saw of a slice joins the open slice's voxels before they are read.
//!
//! A pass sees the near half of a crown well and the far half through gaps; what it does not see, the fill rule makes up. A pass from the other alley
//! sees that half well. Hits and free paths of both add up voxel by voxel, so a density is their common ratio, and only what is hidden from both sides
//! is filled. Everything behind it (trees, metres, height bands, intervals, the calibration's factor) is that of one pass.
//!
//! ```text
//! other pass: scans -> Pipeline::keeping_voxels -> OtherSide (slices of voxels, in its own frame)
//! this pass:  scans -> Pipeline::joined_with(OtherSide) -> Estimate
//! ```
//!
//! Both passes must place the row alike: [`Heading`] says where the other one began and which way it went. What both see of the row tells whether they
//! do ([`SidesReport::shift_m`]).

use std::collections::BTreeMap;
use std::sync::Arc;

use rowscan_protocol::rig::{Rig, RowSide};

use crate::contact::density;
use crate::error::PipelineError;
use crate::estimate::SidesReport;
use crate::leaf::Withheld;
use crate::trees::Cut;
use crate::voxels::{KeptSlice, Region, Voxels};

/// How far the passes are shifted against each other, to see which place fits best, metres.
const SHIFTED_M: f64 = 10.0;
/// Two passes of one row are as alike as this; of those that are, no other place is looked for.
const ALIKE: f64 = 0.85;
/// Voxels that both passes must have seen for a shift to be told.
const LEAST_VOXELS: usize = 400;
/// Another place fits better if its correlation is higher by this.
const BETTER: f64 = 0.05;

/// How another pass went along the row.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Heading {
    /// Where along the row it began, metres: the row's own y, as in this pass.
    pub start_m: f64,
    /// It went from there towards the row's start, not to its end.
    pub back: bool,
}

impl Heading {
    /// The rig that the other pass is read with: it counts its own way on from where slices of both passes have the same faces.
    #[must_use]
    pub fn rig(&self, rig: &Rig, slice_m: f64) -> Rig {
        let start_m = if self.back { self.turn_m(slice_m) - self.start_m } else { self.start_m };
        // Turned round, the tractor has what rose to its right on its left.
        let sense = if self.back { -1.0 } else { 1.0 };
        Rig { start_m, ground_slope_deg: rig.ground_slope_deg.map(|deg| sense * deg), ..rig.clone() }
    }

    /// The row's y is this less the other pass's own, where it went back: a multiple of the slice.
    fn turn_m(&self, slice_m: f64) -> f64 {
        (self.start_m / slice_m).ceil() * slice_m
    }

    /// The row's slice that a pass with this heading numbers so.
    fn slice(&self, own: i64, slice_m: f64) -> i64 {
        if self.back { (self.turn_m(slice_m) / slice_m).round() as i64 - 1 - own } else { own }
    }
}

/// Slices of voxels, and where in the scan plane they are.
#[derive(Clone, Debug)]
pub(crate) struct Kept {
    region: Region,
    slice_m: f64,
    row: RowSide,
    most: usize,
    slices: BTreeMap<i64, KeptSlice>,
}

impl Kept {
    pub(crate) fn new(region: Region, cut: &Cut, row: RowSide, most: usize) -> Self {
        Self { region, slice_m: cut.slice_m(), row, most, slices: BTreeMap::new() }
    }

    /// Keeps a slice; of one that was kept before, both.
    pub(crate) fn push(&mut self, slice: i64, kept: KeptSlice) {
        if self.slices.len() >= self.most && !self.slices.contains_key(&slice) {
            return;
        }
        let all = self.slices.entry(slice).or_default();
        all.hits += kept.hits;
        all.shares += kept.shares;
        all.patches += kept.patches;
        for (place, voxel) in kept.voxels {
            let found = all.voxels.binary_search_by_key(&place, |(place, _)| *place);
            match found.map(|at| all.voxels.get_mut(at)) {
                Ok(Some((_, sums))) => sums.add(&voxel),
                Ok(None) => {}
                Err(at) => all.voxels.insert(at, (place, voxel)),
            }
        }
    }
}

/// What another pass saw of the row.
#[derive(Clone, Debug)]
pub struct OtherSide {
    kept: Kept,
    heading: Heading,
    /// Why that pass by itself tells no leaf area.
    withheld: Option<Withheld>,
}

impl OtherSide {
    pub(crate) fn new(kept: Kept, heading: Heading, withheld: Option<Withheld>) -> Self {
        Self { kept, heading, withheld }
    }

    /// Checks that its voxels are those of a pass that keeps `other`.
    ///
    /// # Errors
    /// Voxels of another size.
    pub(crate) fn fits(&self, other: &Kept) -> Result<(), PipelineError> {
        let edges = |kept: &Kept| [kept.region.dx_m, kept.slice_m, kept.region.dz_m];
        let (found_m, expected_m) = (edges(&self.kept), edges(other));
        let same = found_m.iter().zip(&expected_m).all(|(found, expected)| (found - expected).abs() < 1e-9);
        if same && self.kept.region.nz == other.region.nz {
            Ok(())
        } else {
            Err(PipelineError::SidesDiffer { expected_m, found_m })
        }
    }
}

impl Joining {
    /// Why the other pass by itself tells no leaf area: with it, no more is known.
    pub(crate) fn withheld(&self) -> Option<Withheld> {
        self.other.withheld
    }
}

/// Joins the slices of one pass with those of another.
#[derive(Clone, Debug)]
pub(crate) struct Joining {
    other: Arc<OtherSide>,
    /// This pass's own.
    own: Kept,
    min_beams: u32,
    joined: u64,
    alone: u64,
    revealed: u64,
}

impl Joining {
    /// # Errors
    /// Voxels of another size.
    pub(crate) fn new(other: Arc<OtherSide>, own: Kept, min_beams: u32) -> Result<Self, PipelineError> {
        other.fits(&own)?;
        Ok(Self { other, own, min_beams, joined: 0, alone: 0, revealed: 0 })
    }

    /// Both passes look at the row from different alleys.
    fn is_opposite(&self) -> bool {
        let turned = (self.other.kept.row == RowSide::Right) != self.other.heading.back;
        turned != (self.own.row == RowSide::Right)
    }

    /// The number in this pass's region of a voxel of the other's; `None` where this one has none there.
    fn place(&self, of_other: u32) -> Option<usize> {
        let (own, other) = (&self.own.region, &self.other.kept.region);
        let (layer, column) = (of_other as usize / other.nx, of_other as usize % other.nx);
        // Columns behind the row plane are 0, 1, …; those before it −1, −2, …
        let behind = column as i64 - other.row as i64;
        let behind = if self.is_opposite() { -1 - behind } else { behind };
        let column = usize::try_from(behind + own.row as i64).ok()?;
        (column < own.nx).then_some(layer * own.nx + column)
    }

    /// What the other pass saw of this slice.
    fn of_other(&self, slice: i64) -> Option<&KeptSlice> {
        // The numbering is its own inverse.
        let own = self.other.heading.slice(slice, self.own.slice_m);
        self.other.kept.slices.get(&own)
    }

    /// Adds what the other pass saw of the open slice to its voxels; what they held is kept.
    pub(crate) fn join(&mut self, slice: i64, voxels: &mut Voxels) {
        self.own.push(slice, voxels.kept());
        let Some(other) = self.of_other(slice) else {
            self.alone += 1;
            return;
        };
        let mut revealed = 0;
        for (place, voxel) in &other.voxels {
            let Some(own) = self.place(*place).and_then(|place| voxels.at_mut(place)) else { continue };
            let was_hidden = own.beams < self.min_beams;
            own.add(voxel);
            revealed += u64::from(was_hidden && own.beams >= self.min_beams);
        }
        voxels.count(other);
        self.joined += 1;
        self.revealed += revealed;
    }

    /// The correlation of the densities that both passes found, where the other one is shifted so many slices on; and over how many voxels.
    fn correlation(&self, shift: i64) -> (f64, usize) {
        let (mut n, mut sums) = (0usize, [0.0; 5]);
        for (slice, own) in &self.own.slices {
            let Some(other) = self.of_other(*slice - shift) else { continue };
            for (place, voxel) in &other.voxels {
                let found = self.place(*place).and_then(|place| {
                    let at = own.voxels.binary_search_by_key(&(place as u32), |(place, _)| *place).ok()?;
                    density(&own.voxels.get(at)?.1, self.min_beams)
                });
                // Roots, so that a few dense voxels do not decide.
                if let Some((a, b)) = found.zip(density(voxel, self.min_beams)) {
                    let (a, b) = (a.sqrt(), b.sqrt());
                    n += 1;
                    for (sum, value) in sums.iter_mut().zip([a, b, a * a, b * b, a * b]) {
                        *sum += value;
                    }
                }
            }
        }
        let count = n.max(1) as f64;
        let [a, b, aa, bb, ab] = sums.map(|sum| sum / count);
        ((ab - a * b) / ((aa - a * a) * (bb - b * b)).sqrt(), n)
    }

    pub(crate) fn report(&self) -> SidesReport {
        let told = |shift: i64| {
            let (correlation, voxels) = self.correlation(shift);
            (voxels >= LEAST_VOXELS && correlation.is_finite()).then_some(correlation)
        };
        let correlation = told(0);
        let shifts = if correlation >= Some(ALIKE) { 0 } else { (SHIFTED_M / self.own.slice_m) as i64 };
        let best = (-shifts..=shifts)
            .filter_map(|shift| Some((shift, told(shift)?)))
            .max_by(|(_, a), (_, b)| a.total_cmp(b));
        let better = best.zip(correlation).filter(|((_, best), here)| best - here > BETTER);
        SidesReport {
            opposite: self.is_opposite(),
            slices_joined: self.joined,
            slices_alone: self.alone,
            voxels_revealed: self.revealed,
            correlation,
            shift_m: better.map(|((shift, _), _)| shift as f64 * self.own.slice_m),
        }
    }
}
