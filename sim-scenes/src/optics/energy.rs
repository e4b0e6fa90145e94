//! Power: what a surface returns, what is detected, and what remission says of it.

use rowscan_protocol::optics::{Optics, RemissionCurve};
use rowscan_vehicle::ParameterError;
use rowscan_vehicle::parameter::require_within;
use serde::{Deserialize, Serialize};

use crate::caster::Class;

/// What a wet surface returns of what a dry one does \[ASM\].
const WET: f64 = 0.7;

/// Standard deviation of the threshold from shot to shot, relative \[ASM\].
const SOFTNESS: f64 = 0.1;

/// Power beyond which a receiver is dazzled, in white walls at the same range \[S7\].
const DAZZLING: f64 = 1000.0;

/// Reflectance of dry surfaces near 905 nm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Reflectance {
    /// Leaves: 0.44 to 0.52 by PROSPECT-5 \[S12\].
    pub leaf: f64,
    /// Bark \[ASM\].
    pub wood: f64,
    /// Fruit \[ASM\].
    pub fruit: f64,
    /// Posts: soiled fir is 0.40 \[S13\]; a reflector has a thousand and more.
    pub post: f64,
    /// Wires \[ASM\].
    pub wire: f64,
    /// Dry soil \[ASM\]; grass is 0.45.
    pub ground: f64,
}

impl Default for Reflectance {
    fn default() -> Self {
        Self { leaf: 0.47, wood: 0.35, fruit: 0.55, post: 0.40, wire: 0.30, ground: 0.25 }
    }
}

impl Reflectance {
    pub(super) fn validate(&self) -> Result<(), ParameterError> {
        let Self { leaf, wood, fruit, post, wire, ground } = *self;
        let all = [
            ("leaf", leaf),
            ("wood", wood),
            ("fruit", fruit),
            ("post", post),
            ("wire", wire),
            ("ground", ground),
        ];
        all.into_iter().try_for_each(|(name, value)| {
            require_within(&format!("optics.reflectance.{name}"), value, 0.0, 1e4)
        })
    }

    /// Of a class, so wet.
    pub(super) fn of(&self, class: Class, wetness: f64) -> f64 {
        let dry = match class {
            // Grass reflects as leaves do.
            Class::Leaf | Class::Grass => self.leaf,
            Class::Wood => self.wood,
            Class::Fruit => self.fruit,
            Class::Post => self.post,
            Class::Wire => self.wire,
            Class::Ground => self.ground,
            Class::None => 0.0,
        };
        dry * (1.0 + (WET - 1.0) * wetness)
    }
}

/// Least power that this shot detects; `normal` is a standard normal number.
pub(super) fn threshold(optics: &Optics, normal: f64) -> f64 {
    optics.least_power() * (1.0 + SOFTNESS * normal).max(0.0)
}

/// True if the receiver is dazzled by this power from this range.
pub(super) fn dazzles(power: f64, range_m: f64) -> bool {
    power * range_m * range_m > DAZZLING
}

/// Remission of an echo on the 16-bit scale; 8-bit values stand in both bytes. `scatter` is in the curve's own digits.
pub(super) fn remission(optics: &Optics, power: f64, range_m: f64, spread_m: f64, scatter: f64) -> u16 {
    let near = (range_m / optics.near_field_m.value).min(1.0);
    let power = power * near * near;
    let longer = 1.0 + spread_m / optics.pulse.merged_m.value;
    match optics.remission {
        RemissionCurve::Logarithmic { digits_a_decade, sigma_digits } => {
            let decades = libm::log10((power / optics.least_power() * longer).max(f64::MIN_POSITIVE));
            let digits = 1.0 + digits_a_decade.value * decades + sigma_digits.value * scatter;
            // 255 is dazzled.
            257 * digits.round().clamp(1.0, 254.0) as u16
        }
        RemissionCurve::Compressed { at_half, exponent, sigma } => {
            let digits = at_half.value * libm::pow(power / 0.5, exponent.value) * longer;
            (digits * (1.0 + sigma.value * scatter)).round().clamp(1.0, 65_534.0) as u16
        }
    }
}
