//! Pump, hoses, regulating valve and return line: one node whose pressure rises and falls as exponentials.
//!
//! ```text
//! pump ──► node ──► nozzles:          k √p each, times its valve's share
//!           │ ├───► regulating valve: K √p, times its opening, back to the tank
//!           │ └───► relief valve:     what would push the pressure above its own
//!           └─ hoses take up c √p
//! ```
//!
//! Hoses grow stiffer as they fill: what they hold goes with the root of the pressure, as flows do. So that root, x, follows `c x' = pump − (k + K) x`, which is linear:
//! between two events it goes to `pump / (k + K)` with the time constant `c / (k + K)`, in closed form. Events are valves, the regulating valve's notches and its loop. There
//! is no time step. A valve's ramp counts as two plateaus, the settling of a proportional one as plateaus of a tenth of its time constant; each has the mean of what it stands for.

mod node;
mod plateau;
#[cfg(test)]
mod tests;

use serde::{Deserialize, Serialize};

pub use node::{Balance, Node, Segment, Signals};

/// Who moves the regulating valve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Regulator {
    /// Nobody.
    #[default]
    Fixed,
    /// A loop of its own holds `pressure_bar`.
    Pressure,
    /// A loop of its own holds the pressure that gives the rate of `[rate]` at the tractor's speed.
    Rate,
    /// The controller.
    Commanded,
}

/// Hydraulics: table `[hydraulics]`. The pressure is constant where the table is left out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Hydraulics {
    /// The pump's flow at `pump_rpm`, l/min.
    pub pump_l_min: f64,
    /// Speed of the PTO at which it has that flow, 1/min.
    #[schemars(extend("x-unit" = "1/min"))]
    pub pump_rpm: f64,
    /// Speed of the PTO, 1/min.
    #[schemars(extend("x-unit" = "1/min"))]
    pub pto_rpm: f64,
    /// What hoses take up from no pressure to `pressure_bar`, litres.
    pub hose_l: f64,
    /// The relief valve opens at this pressure, bar.
    pub relief_bar: f64,
    /// Flow through the regulating valve, wide open, at `pressure_bar`, l/min; the pump's where left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = 40.0)]
    pub return_l_min: Option<f64>,
    /// Its opening at the beginning, 0 to 1; what gives `pressure_bar` with all nozzles open where left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-unit" = "1"), example = 0.5)]
    pub opening: Option<f64>,
    /// The regulating valve needs so long from shut to open, seconds: its slew.
    pub travel_s: f64,
    /// Who moves it.
    pub regulator: Regulator,
    /// Its own loop looks at the sensor so often, seconds.
    pub loop_s: f64,
    /// And leaves the valve alone while the pressure is so near, as a share.
    #[schemars(extend("x-unit" = "1"))]
    pub dead: f64,
    /// Time constant of the pressure sensor, seconds.
    pub sensor_s: f64,
}

impl Default for Hydraulics {
    fn default() -> Self {
        Self {
            pump_l_min: 40.0,
            pump_rpm: 540.0,
            pto_rpm: 540.0,
            hose_l: 0.05,
            relief_bar: 25.0,
            return_l_min: None,
            opening: None,
            travel_s: 6.0,
            regulator: Regulator::Fixed,
            loop_s: 0.1,
            dead: 0.05,
            sensor_s: 0.1,
        }
    }
}

/// What is wanted of the rate: table `[rate]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RateTable {
    /// At this speed the flow at `pressure_bar` is right, m/s; at others it is wanted in proportion.
    #[schemars(example = 1.5)]
    pub at_m_s: f64,
    /// Flow is told as its mean over so long, seconds: a period of a pulsed valve, or several.
    #[serde(default = "window_s")]
    pub window_s: f64,
    /// An error within this share is none: the rate has settled.
    #[serde(default = "band")]
    #[schemars(extend("x-unit" = "1"))]
    pub band: f64,
}

fn window_s() -> f64 {
    0.1
}

fn band() -> f64 {
    0.1
}

impl Hydraulics {
    /// Checks all values.
    pub(crate) fn validate(&self) -> Result<(), Wrong> {
        let l_min = "0.01 to 10000 l/min";
        let checks = [
            ("pump_l_min", self.pump_l_min, 0.01, 10_000.0, l_min),
            ("pump_rpm", self.pump_rpm, 1.0, 10_000.0, "1 to 10000 1/min"),
            ("pto_rpm", self.pto_rpm, 0.0, 10_000.0, "0 to 10000 1/min"),
            ("hose_l", self.hose_l, 1e-6, 100.0, "0.000001 to 100 l"),
            ("relief_bar", self.relief_bar, 0.1, 200.0, "0.1 to 200 bar"),
            ("return_l_min", self.return_l_min.unwrap_or(1.0), 0.01, 10_000.0, l_min),
            ("opening", self.opening.unwrap_or(0.0), 0.0, 1.0, "0 to 1"),
            ("travel_s", self.travel_s, 0.01, 600.0, "0.01 to 600 s"),
            ("loop_s", self.loop_s, 0.005, 60.0, "0.005 to 60 s"),
            ("dead", self.dead, 0.001, 1.0, "0.001 to 1"),
            ("sensor_s", self.sensor_s, 0.0, 60.0, "0 to 60 s"),
        ];
        wrong("hydraulics", &checks)
    }
}

impl RateTable {
    /// Checks all values.
    pub(crate) fn validate(&self) -> Result<(), Wrong> {
        let checks = [
            ("at_m_s", self.at_m_s, 0.01, 15.0, "0.01 to 15 m/s"),
            ("window_s", self.window_s, 0.01, 10.0, "0.01 to 10 s"),
            ("band", self.band, 0.001, 1.0, "0.001 to 1"),
        ];
        wrong("rate", &checks)
    }
}

/// A value out of its range.
#[derive(Debug)]
pub(crate) struct Wrong {
    pub(crate) key: String,
    pub(crate) expected: &'static str,
    pub(crate) found: String,
}

/// A value and the range that it must be in.
type Check = (&'static str, f64, f64, f64, &'static str);

/// The first value out of its range.
fn wrong(table: &str, checks: &[Check]) -> Result<(), Wrong> {
    let wrong = checks.iter().find(|(_, value, low, high, _)| !(*low..=*high).contains(value));
    wrong.map_or(Ok(()), |(key, found, _, _, expected)| {
        Err(Wrong { key: format!("{table}.{key}"), expected, found: found.to_string() })
    })
}
