//! How a scanner's remission is read.

use alloc::vec::Vec;

/// How remission tells what share of a spot leaves took.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(tag = "curve", rename_all = "snake_case", deny_unknown_fields))]
pub enum RemissionReading {
    /// By the curve of the scanner's model, which is assumed: right for simulated scans.
    Model,
    /// By a card that was held before the scanner, square on and wider than the spot.
    Card {
        /// Share of light that the card returns at the scanner's wavelength.
        #[cfg_attr(feature = "schema", schemars(example = 0.5))]
        reflectance: f64,
        /// Digits that remission falls where a tenth of the light returns: as between two cards of reflectances a factor of ten apart.
        #[cfg_attr(feature = "schema", schemars(example = 60.0))]
        digits_a_decade: f64,
        /// Range of the card, metres, and its mean remission on the 8-bit scale, such as `[[1.0, 190.0], [4.0, 145.0]]`; nearest first: 8 to 32, three at least on each side of 1.5 m, neighbours within a factor of 1.5. With fewer the leaf area is by contact.
        readings: Vec<[f64; 2]>,
        /// Relative standard deviation of the power that a full leaf returns, as told by the card.
        #[cfg_attr(feature = "serde", serde(default = "tenth"))]
        power_sd: f64,
        /// Other cards, such as `[{ reflectance = 0.05, range_m = 2.0, remission = 116.0 }, …]`: two reflectances or more besides the first card's, at ranges of its
        /// readings. They test that remission goes by the logarithm of power; where they refute it the leaf area is by contact.
        #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Vec::is_empty"))]
        others: Vec<CardReading>,
    },
}

/// What one card read at one range.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct CardReading {
    /// Share of light that the card returns at the scanner's wavelength.
    pub reflectance: f64,
    /// Its range, metres.
    pub range_m: f64,
    /// Mean remission on the 8-bit scale.
    pub remission: f64,
}

#[cfg(feature = "serde")]
fn tenth() -> f64 {
    0.1
}
