//! How late blended ranges are, by range, worked out once: [`Footprint::delay_m`] costs too much for every beam.

use crate::footprint::Footprint;
use crate::parameters::Parameters;

/// The delays of one footprint; all 0 for ideal rays.
#[derive(Clone, Debug, Default)]
pub(crate) struct Delays {
    metres: Vec<f64>,
}

/// Ranges are told apart by so much, metres, up to 20 m.
const STEP_M: f64 = 0.1;
const STEPS: usize = 200;

impl Delays {
    pub(crate) fn new(parameters: &Parameters) -> Self {
        let of_step = |footprint: Footprint, step: usize| {
            footprint.delay_m((step as f64 + 0.5) * STEP_M, parameters.projection)
        };
        let of = |footprint| (0..STEPS).map(|step| of_step(footprint, step)).collect();
        Self { metres: parameters.footprint.map_or_else(Vec::new, of) }
    }

    /// How far behind the leaf that was met first this range lies, metres.
    pub(crate) fn at(&self, range_m: f64) -> f64 {
        self.metres.get((range_m / STEP_M) as usize).copied().unwrap_or(0.0)
    }
}
