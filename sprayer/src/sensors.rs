//! Which sensors a boom has.

use serde::{Deserialize, Serialize};

/// What the boom's sensors tell on the bus: table `[sensors]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sensors {
    /// Pulses of the flow meter a litre.
    #[serde(default = "pulses_per_l")]
    #[schemars(extend("x-unit" = "1/l"))]
    pub pulses_per_l: f64,
    /// The boom's `tank_l`, which may stand here as well. The level is not told where neither is there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(example = 400.0)]
    pub tank_l: Option<f64>,
}

fn pulses_per_l() -> f64 {
    300.0
}

impl Default for Sensors {
    fn default() -> Self {
        Self { pulses_per_l: pulses_per_l(), tank_l: None }
    }
}
