//! Dirt on the window, by sector.

use rowscan_vehicle::ParameterError;
use rowscan_vehicle::parameter::{require, require_within};
use serde::{Deserialize, Serialize};

/// A dirty sector: table `[[optics.air.window]]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct WindowSector {
    /// From this θ on, degrees above level.
    pub from_deg: f64,
    /// To this one.
    pub to_deg: f64,
    /// What passes one way, 0 to 1.
    pub transmission: f64,
}

/// Power left, both ways, below which a scanner reports a warning, an error, a serious error \[ASM\].
const CONTAMINATED: [f64; 3] = [0.6, 0.4, 0.25];

impl Default for WindowSector {
    fn default() -> Self {
        Self { from_deg: -180.0, to_deg: 180.0, transmission: 1.0 }
    }
}

impl WindowSector {
    pub(super) fn validate(&self) -> Result<(), ParameterError> {
        require_within("optics.air.window.transmission", self.transmission, 0.0, 1.0)?;
        let ordered = self.from_deg <= self.to_deg;
        require(ordered, "optics.air.window.to_deg", "not below from_deg", self.to_deg)
    }

    /// The level that a scanner's own sensors report of it: 0 clean, 1 warning, 2 error, 3 serious \[ASM\].
    pub(super) fn contamination(&self) -> u8 {
        let left = self.transmission * self.transmission;
        CONTAMINATED.iter().filter(|least| left < **least).count() as u8
    }

    /// What it leaves of the power of a beam at `theta_rad`, both ways.
    pub(super) fn left(&self, theta_rad: f64) -> f64 {
        let theta_deg = (theta_rad.to_degrees() + 180.0).rem_euclid(360.0) - 180.0;
        let dirty = (self.from_deg..=self.to_deg).contains(&theta_deg);
        if dirty { self.transmission * self.transmission } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_is_reported_by_what_passes_it_twice() {
        let level = |transmission| WindowSector { transmission, ..WindowSector::default() }.contamination();
        assert_eq!([1.0, 0.8, 0.77, 0.64, 0.63, 0.51, 0.49, 0.0].map(level), [0, 0, 1, 1, 2, 2, 3, 3]);
    }
}
