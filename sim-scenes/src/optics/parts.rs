//! What the parts of eight beams side by side met.

use super::touch::{NO_RAY, Touch};
use crate::lanes::{Row, WIDTH};

/// One part of each of eight beams.
#[derive(Clone, Copy, Debug)]
pub(super) struct Column {
    /// Infinite where the beam met nothing with this part.
    pub(super) range_m: Row,
    pub(super) share: Row,
    pub(super) power: Row,
}

impl Column {
    pub(super) const NOTHING: Self =
        Self { range_m: Row::splat(f64::INFINITY), share: Row::splat(0.0), power: Row::splat(0.0) };
}

/// All parts of eight beams.
#[derive(Clone, Debug)]
pub(super) struct Parts {
    columns: Vec<Column>,
    /// The first beam's ray of every column.
    rays: Vec<u32>,
    /// Rays from beam to beam.
    fold: u32,
    /// The nearest that each beam met.
    nearest_m: Row,
    /// What the air added to each beam.
    added: [usize; WIDTH],
}

impl Default for Parts {
    fn default() -> Self {
        Self {
            columns: Vec::new(),
            rays: Vec::new(),
            fold: 0,
            nearest_m: Row::splat(f64::INFINITY),
            added: [0; WIDTH],
        }
    }
}

impl Parts {
    /// Forgets everything, for beams with so many rays from one to the next.
    pub(super) fn reset(&mut self, fold: usize) {
        self.columns.clear();
        self.rays.clear();
        (self.fold, self.nearest_m, self.added) = (fold as u32, Row::splat(f64::INFINITY), [0; WIDTH]);
    }

    /// One more part of each; `ray` is the first beam's.
    #[inline(always)]
    pub(super) fn push(&mut self, column: Column, ray: usize) {
        self.columns.push(column);
        self.rays.push(ray as u32);
    }

    pub(super) fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// The nearest that each beam met.
    pub(super) fn nearest_m(&self) -> &Row {
        &self.nearest_m
    }

    pub(super) fn set_nearest_m(&mut self, nearest_m: Row) {
        self.nearest_m = nearest_m;
    }

    /// The ray of column `column` that beam `lane` has.
    pub(super) fn ray(&self, column: usize, lane: usize) -> u32 {
        match self.rays.get(column) {
            None | Some(&NO_RAY) => NO_RAY,
            Some(first) => first + lane as u32 * self.fold,
        }
    }

    /// What one beam met.
    pub(super) fn beam(&self, lane: usize) -> impl Iterator<Item = Touch> {
        let met =
            self.columns.iter().enumerate().filter(move |(_, column)| column.range_m.0[lane].is_finite());
        met.map(move |(number, Column { range_m, share, power })| Touch {
            range_m: range_m.0[lane],
            share: share.0[lane],
            power: power.0[lane],
            ray: self.ray(number, lane),
        })
    }

    /// Multiplies the power of all that one beam met.
    pub(super) fn dim(&mut self, lane: usize, left: impl Fn(f64) -> f64) {
        for Column { range_m, power, .. } in &mut self.columns {
            if range_m.0[lane].is_finite() {
                power.0[lane] *= left(range_m.0[lane]);
            }
        }
    }

    /// One beam meets something that is no surface.
    pub(super) fn add(&mut self, lane: usize, touch: Touch) {
        let number = self.added[lane];
        self.added[lane] += 1;
        let first = self.rays.iter().position(|ray| *ray == NO_RAY).unwrap_or(self.rays.len());
        if first + number >= self.columns.len() {
            self.columns.push(Column::NOTHING);
            self.rays.push(NO_RAY);
        }
        if let Some(Column { range_m, share, power }) = self.columns.get_mut(first + number) {
            (range_m.0[lane], share.0[lane], power.0[lane]) = (touch.range_m, touch.share, touch.power);
        }
        self.nearest_m.0[lane] = self.nearest_m.0[lane].min(touch.range_m);
    }

    /// Forgets what is nearer than this.
    pub(super) fn forget_nearer(&mut self, least_m: f64) {
        if self.nearest_m.0.iter().all(|nearest_m| *nearest_m >= least_m) {
            return;
        }
        self.nearest_m = Row::splat(f64::INFINITY);
        for Column { range_m, share, power } in &mut self.columns {
            for lane in 0..WIDTH {
                if range_m.0[lane] < least_m {
                    (range_m.0[lane], share.0[lane], power.0[lane]) = (f64::INFINITY, 0.0, 0.0);
                }
                self.nearest_m.0[lane] = self.nearest_m.0[lane].min(range_m.0[lane]);
            }
        }
    }
}
