//! Measures read back from files.

use serde::de::Error;
use serde::{Deserialize, Deserializer};

use super::measure::{Measure, Quantity};
use super::reported::REPORTED;
use super::table::by_name;

/// That name, as tables hold it, if it is one of an estimator or of what every estimate holds.
pub fn name_of(name: &str) -> Option<&'static str> {
    let held = REPORTED.iter().map(|(held, _)| *held).find(|held| *held == name);
    held.or_else(|| by_name(name).map(|info| info.name))
}

/// A measure as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    estimator: String,
    quantity: Quantity,
    z_from_m: Option<f64>,
    z_to_m: Option<f64>,
    value: Option<f64>,
    sampling_low: Option<f64>,
    sampling_high: Option<f64>,
}

impl<'de> Deserialize<'de> for Measure {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let Written { estimator, quantity, z_from_m, z_to_m, value, sampling_low, sampling_high } =
            Written::deserialize(from)?;
        let unknown = || D::Error::custom(format!("unknown estimator `{estimator}`"));
        let estimator = name_of(&estimator).ok_or_else(unknown)?;
        Ok(Self { estimator, quantity, z_from_m, z_to_m, value, low: sampling_low, high: sampling_high })
    }
}
