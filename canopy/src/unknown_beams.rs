//! Directions of which nothing is known along most of the row: a part of the field that is lost in every turn.
//!
//! Beams that are lost here and there leave densities what they are; what is lost in the same directions all along the row hides a part of it.

use crate::geometry::Beam;

/// A direction whose beams are unknown for more of their weight than this does not see the row.
const MOST: f64 = 0.5;
/// Directions that are told apart, from straight down to straight up.
const DIRECTIONS: usize = 360;

/// What was unknown by direction, of the beams that look at the row.
#[derive(Clone, Debug)]
pub(crate) struct UnknownBeams {
    /// Σ weight over beams, metres: of all, and of those that are unknown.
    weights_m: Vec<[f64; 2]>,
}

impl Default for UnknownBeams {
    fn default() -> Self {
        Self { weights_m: vec![[0.0; 2]; DIRECTIONS] }
    }
}

impl UnknownBeams {
    /// Adds a beam of a line with this weight.
    pub(crate) fn add(&mut self, beam: &Beam, is_unknown: bool, weight_m: f64) {
        let direction = (beam.theta_rad / core::f64::consts::PI + 0.5) * DIRECTIONS as f64;
        if let Some([all_m, unknown_m]) = self.weights_m.get_mut(direction.max(0.0) as usize) {
            *all_m += weight_m;
            *unknown_m += if is_unknown { weight_m } else { 0.0 };
        }
    }

    /// Share of the directions that look at the row and are unknown along most of it.
    pub(crate) fn share(&self) -> f64 {
        let looking = self.weights_m.iter().filter(|[all_m, _]| *all_m > 0.0);
        let (all, unknown) = looking.fold((0_u32, 0_u32), |(all, unknown), [all_m, unknown_m]| {
            (all + 1, unknown + u32::from(*unknown_m > MOST * all_m))
        });
        f64::from(unknown) / f64::from(all.max(1))
    }
}
