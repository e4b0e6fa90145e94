//! The ground's slope and height as the scanner sees them, held against the rig's: ground that rises where the rig has none counts as leaves, or hides leaves.
//!
//! Nothing returns from below the ground: in each column across the row the lowest returns are a thin sheet where the ground is seen, and frayed where only
//! leaves are. A line through the columns by Theil and Sen (the median of the slopes of all pairs) is the ground of a stretch of row; its slope goes by
//! stretches, for an alley driven back has the slope's other sign.

use crate::geometry::Frame;
use crate::level::{LEAST_CANOPY, LevelSurface};

/// Width of a column across the row, metres.
const COLUMN_M: f64 = 0.25;
/// Columns, from the mirror to 6 m.
const COLUMNS: usize = 24;
/// How far behind the row axis columns reach, metres.
const BEHIND_M: f64 = 2.0;
/// Height of a bin, metres.
const BIN_M: f64 = 0.025;
/// Lowest height that is counted, metres from the ground at the row axis.
const LOWEST_M: f64 = -3.0;
/// Bins of a column, up to 3 m.
const BINS: usize = 240;
/// Bins that the ground's sheet is thick: rough soil, mown grass, the slope within a column.
const SHEET: usize = 8;
/// Of the returns in the sheet and as much above it, the share that a sheet holds at least.
const SHEET_SHARE: f64 = 0.7;
/// Share of a column's returns that may lie below its ground: what was reflected twice.
const STRAY_SHARE: f64 = 0.02;
/// Returns below which a column tells nothing.
const LEAST: u32 = 30;
/// Columns that a line needs, and how far apart the outermost are, metres.
const LEAST_COLUMNS: usize = 6;
const LEAST_REACH_M: f64 = 1.0;
/// How far columns may lie off their line, metres: half of them, and three quarters.
const OFF_M: [f64; 2] = [0.03, 0.06];
/// How well the slope must be known for a stretch to tell it, standard deviation, metres a metre: 0.6°.
const MOST_SD: f64 = 0.01;
/// Standard deviations in the deviation that half of a normal distribution stays below.
const SDS_A_MEDIAN: f64 = 1.483;
/// Length of a stretch, metres.
const STRETCH_M: f64 = 5.0;
/// Share of the stretches that must differ for the row to.
const STRETCHES: f64 = 1.0 / 3.0;

/// How rough level ground is by itself, metres.
const ROUGH_M: f64 = 0.02;
/// Returns so far off the ground's line belong to it, metres.
const OF_GROUND_M: f64 = 0.1;
/// Share of the canopy's returns that may be ground.
const GROUND_SHARE: f64 = 0.02;

/// The slope as found differs from the rig's by more than this: it is told, degrees. Ranges of a TiM561 are off so that it sees half a degree less or more
/// than there is.
pub(crate) const TOLD_DEG: f64 = 2.25;
/// By more than this leaf areas are withheld, degrees.
pub(crate) const WITHHELD_DEG: f64 = 5.0;

/// The lowest returns of the open stretch, and what the stretches before it told.
#[derive(Clone, Debug)]
pub(crate) struct GroundLine {
    /// Bins of all columns.
    bins: Vec<u32>,
    /// Metres of row in the open stretch.
    length_m: f64,
    /// Columns beyond this are not looked at, metres from the mirror.
    reach_m: f64,
    told_deg: f64,
    /// 1 where degrees count upwards towards the row, as seen by the scanner.
    side: f64,
    /// Stretches whose ground was found.
    stretches: u32,
    /// Of these, those that differ: falling too much, and rising; how many, and Σ slope.
    differ: [(u32, f64); 2],
    /// Those that differ so much that leaf areas are withheld.
    differ_much: u32,
    /// From the mirror to the row axis, metres.
    distance_m: f64,
    /// The rig's, above its ground, metres.
    clearance_m: f64,
    /// Those with the rig's slope, and Σ height of their ground at the row axis, metres.
    level: (u32, f64),
    /// How much the rig's ground rises a metre towards the row.
    rise: f64,
    /// Returns that count as canopy where the ground was found.
    canopy: u64,
    /// Of these, those of the ground, and Σ their height above the rig's ground, metres.
    of_ground: (u64, f64),
}

/// A slope that is not the rig's, degrees in the rig's sense.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct OtherSlope {
    pub(crate) found_deg: f64,
    pub(crate) told_deg: f64,
    pub(crate) withheld: bool,
}

impl GroundLine {
    pub(crate) fn new(frame: &Frame, side: f64) -> Self {
        Self {
            bins: vec![0; COLUMNS * BINS],
            length_m: 0.0,
            reach_m: frame.far_gate_m.min(frame.distance_m + BEHIND_M),
            told_deg: side * frame.rise.atan().to_degrees(),
            side,
            stretches: 0,
            differ: [(0, 0.0); 2],
            differ_much: 0,
            distance_m: frame.distance_m,
            clearance_m: frame.ground_clearance_m,
            level: (0, 0.0),
            rise: frame.rise,
            canopy: 0,
            of_ground: (0, 0.0),
        }
    }

    /// Adds a return, whatever it counts as.
    pub(crate) fn add(&mut self, x_m: f64, z_m: f64) {
        let (column, bin) = (x_m / COLUMN_M, (z_m - LOWEST_M) / BIN_M);
        if !(x_m >= 0.0 && x_m < self.reach_m && bin >= 0.0 && bin < BINS as f64) {
            return;
        }
        if let Some(count) = self.bins.get_mut(column as usize * BINS + bin as usize) {
            *count = count.saturating_add(1);
        }
    }

    /// A line has ended that stands for so much of the row.
    pub(crate) fn line(&mut self, weight_m: f64) {
        self.length_m += weight_m;
        if self.length_m >= STRETCH_M {
            self.close();
        }
    }

    /// Ends the stretch.
    pub(crate) fn close(&mut self) {
        if let Some((rise, at_row_m)) = self.line_seen() {
            let found_deg = self.side * rise.atan().to_degrees();
            let off_deg = found_deg - self.told_deg;
            self.stretches += 1;
            if off_deg.abs() > TOLD_DEG {
                let [falls, rises] = &mut self.differ;
                let (count, sum_deg) = if off_deg < 0.0 { falls } else { rises };
                *count += 1;
                *sum_deg += found_deg;
            } else {
                let (count, sum_m) = &mut self.level;
                *count += 1;
                *sum_m += at_row_m;
            }
            self.differ_much += u32::from(off_deg.abs() > WITHHELD_DEG);
            self.count_ground(rise, at_row_m);
        }
        self.bins.fill(0);
        self.length_m = 0.0;
    }

    /// Counts what of the canopy is ground: a line that rises so much towards the row, and lies so high at its axis.
    fn count_ground(&mut self, rise: f64, at_row_m: f64) {
        for (number, column) in self.bins.chunks(BINS).enumerate() {
            let from_row_m = (number as f64 + 0.5) * COLUMN_M - self.distance_m;
            let told_m = self.rise * from_row_m;
            let ground_m = at_row_m + rise * from_row_m;
            let reaches_canopy = ground_m - told_m > self.clearance_m - ROUGH_M;
            for (bin, count) in column.iter().enumerate().filter(|(_, count)| **count > 0) {
                let z_m = LOWEST_M + (bin as f64 + 0.5) * BIN_M;
                let above_m = z_m - told_m;
                if above_m < self.clearance_m {
                    continue;
                }
                self.canopy += u64::from(*count);
                if reaches_canopy && (z_m - ground_m).abs() <= OF_GROUND_M {
                    let (returns, sum_m) = &mut self.of_ground;
                    *returns += u64::from(*count);
                    *sum_m += f64::from(*count) * above_m;
                }
            }
        }
    }

    /// The ground, where much of what counts as canopy is ground.
    pub(crate) fn in_canopy(&self) -> Option<LevelSurface> {
        let (returns, sum_m) = self.of_ground;
        let share = returns as f64 / self.canopy as f64;
        (self.canopy >= LEAST_CANOPY && share >= GROUND_SHARE)
            .then(|| LevelSurface { z_m: sum_m / returns as f64, share })
    }

    /// The slope of the stretches that differ from the rig's, if they are many. Of a drive whose alleys differ both ways, that of the more.
    pub(crate) fn other_slope(&self) -> Option<OtherSlope> {
        let many = |count: u32| count > 0 && f64::from(count) >= STRETCHES * f64::from(self.stretches);
        let [falls, rises] = self.differ;
        let (count, sum_deg) = if falls.0 > rises.0 { falls } else { rises };
        many(falls.0 + rises.0).then(|| OtherSlope {
            found_deg: sum_deg / f64::from(count),
            told_deg: self.told_deg,
            withheld: many(self.differ_much),
        })
    }

    /// How high the ground lies at the row axis above where the rig has it, metres, if it reaches the rig's clearance or lies as far below.
    pub(crate) fn other_level_m(&self) -> Option<f64> {
        let (count, sum_m) = self.level;
        let level_m = (count > 0).then(|| sum_m / f64::from(count))?;
        let (above_m, below_m) = (self.clearance_m - ROUGH_M, -(self.clearance_m + ROUGH_M));
        (level_m > above_m || level_m < below_m).then_some(level_m)
    }

    /// How much the ground of the open stretch rises a metre towards the row, and how high it is at the row axis, metres; `None` where it is not seen.
    fn line_seen(&self) -> Option<(f64, f64)> {
        let mut points = [(0.0, 0.0); COLUMNS];
        let mut found = 0;
        for (number, column) in self.bins.chunks(BINS).enumerate() {
            if let (Some(z_m), Some(point)) = (sheet_m(column), points.get_mut(found)) {
                *point = ((number as f64 + 0.5) * COLUMN_M, z_m);
                found += 1;
            }
        }
        let points = points.get(..found)?;
        let reach_m = points.last()?.0 - points.first()?.0;
        if points.len() < LEAST_COLUMNS || reach_m < LEAST_REACH_M {
            return None;
        }
        let mut slopes = [0.0; COLUMNS * (COLUMNS - 1) / 2];
        let pairs =
            points.iter().enumerate().flat_map(|(i, a)| points.iter().skip(i + 1).map(move |b| (a, b)));
        let mut count = 0;
        for (slope, (a, b)) in slopes.iter_mut().zip(pairs) {
            *slope = (b.1 - a.1) / (b.0 - a.0);
            count += 1;
        }
        let rise = middle(slopes.get_mut(..count)?, 0.5)?;
        let mut off_m = [0.0; COLUMNS];
        let off_m = off_m.get_mut(..found)?;
        let fill = |off_m: &mut [f64], level_m: f64, of: fn(f64) -> f64| {
            for (off, (x_m, z_m)) in off_m.iter_mut().zip(points) {
                *off = of(z_m - rise * x_m - level_m);
            }
        };
        fill(off_m, 0.0, |off| off);
        let level_m = middle(off_m, 0.5)?;
        fill(off_m, level_m, f64::abs);
        let (half_m, most_m) = (middle(off_m, 0.5)?, middle(off_m, 0.75)?);
        let mean_m = points.iter().map(|(x_m, _)| x_m).sum::<f64>() / points.len() as f64;
        let spread_m = points.iter().map(|(x_m, _)| (x_m - mean_m).powi(2)).sum::<f64>().sqrt();
        let is_line = half_m <= OFF_M[0] && most_m <= OFF_M[1];
        (is_line && SDS_A_MEDIAN * half_m <= MOST_SD * spread_m)
            .then_some((rise, level_m + rise * self.distance_m))
    }
}

/// The value that this share of them stays below.
fn middle(values: &mut [f64], share: f64) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    values.get((share * values.len() as f64) as usize).copied()
}

/// Height of the lowest returns of a column, if they are a sheet.
fn sheet_m(column: &[u32]) -> Option<f64> {
    let all: u32 = column.iter().fold(0, |sum, count| sum.saturating_add(*count));
    if all < LEAST {
        return None;
    }
    let stray = STRAY_SHARE * f64::from(all);
    let mut below = 0.0;
    let low = column.iter().position(|count| {
        below += f64::from(*count);
        below > stray
    })?;
    let sum = |bins: &[u32]| bins.iter().map(|count| f64::from(*count)).sum::<f64>();
    let sheet = column.get(low..)?.get(..SHEET)?;
    let returns = sum(sheet);
    let above = sum(column.get(low + SHEET..)?.get(..SHEET)?);
    let moment: f64 = sheet.iter().zip(0..).map(|(count, bin)| f64::from(*count) * f64::from(bin)).sum();
    let is_sheet = returns >= f64::from(LEAST) && returns >= SHEET_SHARE * (returns + above);
    is_sheet.then(|| LOWEST_M + (low as f64 + moment / returns + 0.5) * BIN_M)
}
