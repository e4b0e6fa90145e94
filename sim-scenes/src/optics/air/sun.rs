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
pub(in crate::optics) const POWER_FACTOR: f64 = 10.0;

/// Share of the shots into it that are dazzled \[ASM\].
pub(in crate::optics) const DAZZLED_SHARE: f64 = 0.5;

impl Sun {
    pub(super) fn validate(&self) -> Result<(), ParameterError> {
        require_within("optics.air.sun.elevation_deg", self.elevation_deg, 0.0, 90.0)?;
        require_within("optics.air.sun.azimuth_deg", self.azimuth_deg, -360.0, 360.0)
    }
}

/// The sun as one scanner model sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Glare {
    /// Unit vector towards it, in the scene's frame.
    towards: [f64; 3],
    /// Cosine of the angle around it that dazzles.
    least_cosine: f64,
}

impl Glare {
    pub(super) fn new(sun: Sun, spot: &Spot) -> Self {
        let [up, side] = [sun.elevation_deg, sun.azimuth_deg].map(f64::to_radians);
        let around_rad = AROUND_DEG.to_radians() + 0.5e-3 * spot.divergence_mrad.value;
        Self {
            towards: [libm::cos(up) * libm::sin(side), libm::cos(up) * libm::cos(side), libm::sin(up)],
            least_cosine: libm::cos(around_rad),
        }
    }

    /// True if it blinds a beam at `theta_rad` from the scene's +X, which leaves a plane turned so by `layer_rad`.
    pub(super) fn blinds(&self, theta_rad: f64, layer_rad: f64, plane: Option<&Axes>) -> bool {
        let (cos, sin) = (libm::cos(theta_rad), libm::sin(theta_rad));
        let beam = match layer_rad {
            0.0 => [cos, 0.0, sin],
            _ => [cos * libm::cos(layer_rad), libm::sin(layer_rad), sin * libm::cos(layer_rad)],
        };
        let beam = plane.unwrap_or(&Axes::LEVEL).turned(beam);
        let cosine: f64 = self.towards.iter().zip(beam).map(|(a, b)| a * b).sum();
        cosine > self.least_cosine
    }
}
