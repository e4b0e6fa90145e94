//! A sun that the receiver looks into.

use rowscan_protocol::optics::Spot;
use rowscan_protocol::rig::Axes;
use rowscan_vehicle::ParameterError;
use rowscan_vehicle::parameter::require_within;
use serde::{Deserialize, Serialize};

/// Where the sun stands: table `[optics.air.sun]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sun {
    /// Degrees above level.
    #[schemars(example = 12.0)]
    pub elevation_deg: f64,
    /// Degrees from the direction of travel (+Y) towards +X: 90 is behind the row, as the first scanner sees it.
    #[schemars(example = 90.0)]
    pub azimuth_deg: f64,
}

/// A receiver sees it so far beside its own spot, degrees \[ASM\].
const AROUND_DEG: f64 = 3.0;

/// How many times the least power that is detected there is what it is elsewhere \[ASM\].
pub(in crate::optics) const LEAST_POWER: f64 = 10.0;

/// Share of the shots into it that are dazzled \[ASM\].
pub(in crate::optics) const DAZZLED: f64 = 0.5;

impl Sun {
    pub(super) fn validate(&self) -> Result<(), ParameterError> {
        require_within("optics.air.sun.elevation_deg", self.elevation_deg, 0.0, 90.0)?;
        require_within("optics.air.sun.azimuth_deg", self.azimuth_deg, -360.0, 360.0)
    }

    /// True if a beam at `theta_rad` from the scene's +X, in a plane turned so, looks into it.
    pub(super) fn is_before(&self, spot: &Spot, theta_rad: f64, plane: Option<&Axes>) -> bool {
        let [up, side] = [self.elevation_deg, self.azimuth_deg].map(f64::to_radians);
        let sun = [libm::cos(up) * libm::sin(side), libm::cos(up) * libm::cos(side), libm::sin(up)];
        let beam = plane.unwrap_or(&Axes::LEVEL).turned([libm::cos(theta_rad), 0.0, libm::sin(theta_rad)]);
        let cosine: f64 = sun.iter().zip(beam).map(|(a, b)| a * b).sum();
        let around_rad = AROUND_DEG.to_radians() + 0.5e-3 * spot.divergence_mrad.value;
        cosine > libm::cos(around_rad)
    }
}
