//! Encoder ticks and how fast they come.

use crate::time::SimTime;

/// The ticks of one encoder.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct TickCounter {
    /// Ticks so far, forward minus backward.
    pub(super) ticks: f64,
    /// Ticks a millisecond between the last two mirror turns.
    pub(super) ticks_per_ms: f64,
    last_turn: Option<(SimTime, f64)>,
    /// Ticks at which it began to count.
    zero: f64,
}

impl TickCounter {
    pub(super) fn set(&mut self, ticks: f64) {
        self.ticks = ticks - self.zero;
    }

    /// Counts from zero again.
    pub(super) fn restart(&mut self) {
        *self = Self { zero: self.zero + self.ticks, ..Self::default() };
    }

    /// A mirror turn begins at `at`.
    pub(super) fn turn(&mut self, at: SimTime) {
        if let Some((before, ticks)) = self.last_turn.filter(|(before, _)| *before < at) {
            self.ticks_per_ms = (self.ticks - ticks) * 1e6 / (at.0 - before.0) as f64;
        }
        self.last_turn = Some((at, self.ticks));
    }
}
