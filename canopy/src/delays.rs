//! How late blended ranges are, by range.

use crate::by_range::ByRange;
use crate::footprint::Footprint;
use crate::parameters::Parameters;

/// The delays of one footprint; all 0 for ideal rays.
#[derive(Clone, Debug, Default)]
pub(crate) struct Delays {
    metres: ByRange,
}

impl Delays {
    pub(crate) fn new(parameters: &Parameters) -> Self {
        let of =
            |footprint: Footprint| ByRange::of(|range_m| footprint.delay_m(range_m, parameters.projection));
        Self { metres: parameters.footprint.map_or_else(ByRange::default, of) }
    }

    /// How far behind the leaf that was met first this range lies, metres.
    pub(crate) fn at(&self, range_m: f64) -> f64 {
        self.metres.at(range_m).unwrap_or(0.0)
    }
}
