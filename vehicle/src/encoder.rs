//! The wheel encoder: the ticks it gives as the wheel rolls.

use serde::{Deserialize, Serialize};

use crate::parameter::{ParameterError, require_within as within};

/// The `[encoder]` table of a scene file.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Encoder {
    /// Ticks a metre that the wheel rolls. A client that derives metres from ticks must know this number; LICencres does not change it.
    pub ticks_per_m: f64,
    /// Counts down while the tractor drives forward.
    pub reversed: bool,
    /// Share of the ticks that are missed.
    pub missed: f64,
    /// Share of ticks counted twice.
    pub extra: f64,
    /// Count at the start of the drive; near 2^32 it soon wraps.
    pub start_ticks: u32,
}

impl Default for Encoder {
    fn default() -> Self {
        Self { ticks_per_m: 1000.0, reversed: false, missed: 0.0, extra: 0.0, start_ticks: 0 }
    }
}

impl Encoder {
    /// Checks all values.
    ///
    /// # Errors
    /// The first key with an invalid value.
    pub fn validate(&self) -> Result<(), ParameterError> {
        within("encoder.ticks_per_m", self.ticks_per_m, 1.0, 1e6)?;
        within("encoder.missed", self.missed, 0.0, 1.0)?;
        within("encoder.extra", self.extra, 0.0, 1.0)
    }

    /// Ticks per metre driven forward; negative where it counts down.
    pub fn ticks_a_metre_ahead(&self) -> f64 {
        if self.reversed { -self.ticks_per_m } else { self.ticks_per_m }
    }

    /// Ticks given once the wheel has rolled `wheel_m` metres, those at the start included. Fractions are those of the next tick.
    pub fn ticks(&self, wheel_m: f64) -> f64 {
        let counted_m = wheel_m * (1.0 - self.missed + self.extra);
        counted_m * self.ticks_a_metre_ahead() + f64::from(self.start_ticks)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_counts_what_it_catches_from_where_it_starts() {
        let encoder = Encoder { missed: 0.02, start_ticks: 500, ..Encoder::default() };
        assert!((encoder.ticks(10.0) - 10_300.0).abs() < 1e-9);
        let back = Encoder { reversed: true, ticks_per_m: 500.0, ..Encoder::default() };
        assert_eq!(back.ticks(2.0), -1000.0);
        assert!(Encoder { missed: 1.5, ..Encoder::default() }.validate().is_err());
    }
}
