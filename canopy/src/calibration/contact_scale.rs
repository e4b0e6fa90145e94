//! The factor of contact frequency, whether hits are counted or shares of spots.

use serde::{Deserialize, Serialize};

use super::error::CalibrationError;
use super::quality::{FitQuality, QualityKeys, quality_keys};
use super::wood::{Wood, leafy_share};

/// L / length = k · (x − w)^p with x, the raw contact-frequency leaf area a metre, and w, the wood that is taken out of it, if any; beyond either end of the
/// fitted range in proportion to x − w, with the factor of that end.
///
/// Dense rows hide leaves behind leaves, and in thin rows wood is a larger part of what beams meet. So p is above 1 where rows of different leaf areas
/// were fitted and their wood was left in.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ContactScale {
    /// Leaf area a metre, m²/m, at a raw one of 1 m²/m.
    pub k: f64,
    /// Exponent; 1 is a proportion, and what files of versions before this key have.
    #[serde(default = "proportion")]
    pub p: f64,
    /// The rows it was fitted on; `None` in files of versions before this key.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fitted: Option<FittedRows>,
    /// Relative standard deviation of `k`, where it was fitted on so few rows, or pieces of a real orchard, that it counts; `None` where it does not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub k_sd: Option<f64>,
    /// What tells how close together leaves stand, for beams with a width.
    #[serde(default, skip_serializing_if = "ClumpingBy::is_constant")]
    pub clumping: ClumpingBy,
    /// Wood that is taken out before the law; `None` where it is part of the law.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wood: Option<Wood>,
    /// How good it is.
    pub quality: FitQuality,
}

/// What the fitted rows say of their own law.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FittedRows {
    /// Geometric mean of their raw leaf areas a metre, less wood where that is taken out, m²/m.
    pub mean_m2_per_m: f64,
    /// Geometric mean of their true leaf areas a metre, m²/m.
    pub mean_leaf_area_m2_per_m: f64,
    /// Their own exponent, by least squares of ln x on ln L, inverted: leaf areas were chosen, raw ones scatter, and a line the other way takes
    /// dense rows for less dense ones. Of rows so alike that they tell no law, least squares of ln L on ln x. Through wide beams it is larger than `p`:
    /// applied, it would enlarge the errors of rows of another class or distance.
    pub exponent: f64,
    /// Relative standard deviation of their leaf areas about that law: what rows of one class differ by that the scans do not tell. Unknown in files of
    /// versions before this key.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scatter: Option<f64>,
    /// Mean length of these rows, metres: shorter rows scatter more. Unknown in files of versions before this key.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub row_m: Option<f64>,
}

/// What tells how close together leaves stand, for leaf areas by beams with a width.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ClumpingBy {
    /// A constant for crowns of fruit trees (κ); so in files of versions before this key.
    #[default]
    Constant,
    /// Each row's own scans ([`Clumping`](crate::Clumping)).
    Scans,
}

impl ClumpingBy {
    fn is_constant(&self) -> bool {
        *self == Self::Constant
    }
}

fn proportion() -> f64 {
    1.0
}

/// The names of a scale's values in a file.
pub(super) struct ScaleKeys {
    k: &'static str,
    k_sd: &'static str,
    p: &'static str,
    low: &'static str,
    high: &'static str,
    wood: &'static str,
    wood_sd: &'static str,
    mean: &'static str,
    mean_leaf_area: &'static str,
    exponent: &'static str,
    scatter: &'static str,
    row_m: &'static str,
    quality: QualityKeys,
}

macro_rules! keys {
    ($table:literal) => {
        ScaleKeys {
            k: concat!($table, ".k"),
            k_sd: concat!($table, ".k_sd"),
            p: concat!($table, ".p"),
            low: concat!($table, ".quality.low_m2_per_m"),
            high: concat!($table, ".quality.high_m2_per_m"),
            wood: concat!($table, ".wood.m2_per_m"),
            wood_sd: concat!($table, ".wood.sd_m2_per_m"),
            mean: concat!($table, ".fitted.mean_m2_per_m"),
            mean_leaf_area: concat!($table, ".fitted.mean_leaf_area_m2_per_m"),
            exponent: concat!($table, ".fitted.exponent"),
            scatter: concat!($table, ".fitted.scatter"),
            row_m: concat!($table, ".fitted.row_m"),
            quality: quality_keys!($table),
        }
    };
}

pub(super) const CONTACT_KEYS: ScaleKeys = keys!("contact");
pub(super) const SHARE_KEYS: ScaleKeys = keys!("share");

/// What the exponent of rows beyond the fitted ones may differ by from their own one: through an LMS511's eye it is 2.0 among spindles of LAI 0.8 to 2.6 and 2.9
/// from 3.5 to 5.
const UNKNOWN_EXPONENT: f64 = 1.0;

/// Rows whose law explains less of how they differ are alike.
pub(super) const ALIKE_R2: f64 = 0.5;

/// How many times as much, or as little, as its rows have a law may tell of their mean. It goes through it, but for what files are rounded to.
const OTHER_ROWS: f64 = 1.02;
/// The same of a proportion: of rows that scatter it is off by some per cent.
const OTHER_ROWS_IN_PROPORTION: f64 = 1.25;

impl ContactScale {
    /// Refuses values that no leaf area could be made with.
    pub(super) fn validate(&self, keys: &ScaleKeys) -> Result<(), CalibrationError> {
        let positive = |key, value: f64| {
            if value.is_finite() && value > 0.0 {
                Ok(())
            } else {
                Err(CalibrationError::NotPositive { key, value })
            }
        };
        positive(keys.k, self.k)?;
        positive(keys.p, self.p)?;
        positive(keys.high, self.quality.high_m2_per_m)?;
        // Of a proportion the fitted range may begin at nothing.
        let low = self.quality.low_m2_per_m;
        if self.p != 1.0 && (low.is_nan() || low <= 0.0) {
            return Err(CalibrationError::NotPositive { key: keys.low, value: low });
        }
        if let Some(wood) = self.wood {
            positive(keys.wood, wood.m2_per_m)?;
            if !(wood.sd_m2_per_m.is_finite() && wood.sd_m2_per_m >= 0.0) {
                return Err(CalibrationError::NotPositive { key: keys.wood_sd, value: wood.sd_m2_per_m });
            }
            if low <= wood.m2_per_m {
                return Err(CalibrationError::MostlyWood { key: keys.wood, wood: wood.m2_per_m, low });
            }
        }
        if let Some(value) = self.k_sd.filter(|sd| !(sd.is_finite() && *sd >= 0.0)) {
            return Err(CalibrationError::NotPositive { key: keys.k_sd, value });
        }
        self.quality.validate(&keys.quality)?;
        let Some(rows) = self.fitted else { return Ok(()) };
        positive(keys.mean, rows.mean_m2_per_m)?;
        positive(keys.mean_leaf_area, rows.mean_leaf_area_m2_per_m)?;
        if let Some(value) = rows.scatter.filter(|sd| !(sd.is_finite() && *sd >= 0.0)) {
            return Err(CalibrationError::NotPositive { key: keys.scatter, value });
        }
        if let Some(row_m) = rows.row_m {
            positive(keys.row_m, row_m)?;
        }
        if !rows.exponent.is_finite() {
            return Err(CalibrationError::NotFinite { key: keys.exponent, value: rows.exponent });
        }
        // Both go through the middle of the same rows: the law by least squares of logarithms.
        let (mean, fitted) = (rows.mean_m2_per_m, rows.mean_leaf_area_m2_per_m);
        let told = self.k * mean.powf(self.p);
        let most = if self.p == 1.0 { OTHER_ROWS_IN_PROPORTION } else { OTHER_ROWS };
        if (told / fitted).ln().abs() > most.ln() {
            return Err(CalibrationError::OtherRows { key: keys.k, told, fitted });
        }
        Ok(())
    }

    /// A raw leaf area a metre without wood, m²/m; 0 where wood is all there is.
    fn net(&self, raw_m2_per_m: f64) -> f64 {
        self.wood.map_or(raw_m2_per_m, |wood| (raw_m2_per_m - wood.m2_per_m).max(0.0))
    }

    /// The share of a raw leaf area of so many m² a metre that is no wood: 1 where wood is part of the law.
    pub fn leafy_share(&self, raw_m2_per_m: f64) -> f64 {
        self.wood.map_or(1.0, |wood| leafy_share(wood.m2_per_m, raw_m2_per_m))
    }

    /// What a raw leaf area of so many m² a metre is multiplied by.
    pub fn factor(&self, raw_m2_per_m: f64) -> f64 {
        let fitted = raw_m2_per_m.min(self.quality.high_m2_per_m).max(self.quality.low_m2_per_m);
        self.k * self.net(fitted).powf(self.p - 1.0) * self.leafy_share(raw_m2_per_m)
    }

    /// By what a relative error of the raw leaf area is multiplied: by the exponent, and by more where wood is much of it.
    pub fn amplification(&self, raw_m2_per_m: f64) -> f64 {
        let fitted = (self.quality.low_m2_per_m..=self.quality.high_m2_per_m).contains(&raw_m2_per_m);
        (if fitted { self.p } else { 1.0 }) / self.leafy_share(raw_m2_per_m)
    }

    /// Relative standard deviation of the leaf area for what rows of the class differ in wood; `None` where none is taken out.
    pub fn wood_sd(&self, raw_m2_per_m: f64) -> Option<f64> {
        self.wood.map(|wood| wood.sd_m2_per_m / raw_m2_per_m * self.amplification(raw_m2_per_m))
    }

    /// What rows of so many metres scatter about the law of the fitted ones, relative standard deviation: what trees differ by evens out along a row, so
    /// shorter rows scatter more. Longer ones are not taken to scatter less. `None` where the file does not say.
    pub fn scatter_sd(&self, row_m: f64) -> Option<f64> {
        let rows = self.fitted?;
        let shorter = rows.row_m.map_or(1.0, |fitted_m| (fitted_m / row_m).max(1.0));
        Some(rows.scatter? * shorter.sqrt())
    }

    /// Logarithm of the leaf area that the fitted rows' own law tells over the one that is applied: little near their mean, and more the denser or thinner a row
    /// is. `None` where they had no larger exponent than is applied, for a smaller one is what scatter makes of rows that are alike; and without canopy.
    pub fn own_law(&self, raw_m2_per_m: f64) -> Option<f64> {
        let net_m2_per_m = self.net(raw_m2_per_m);
        let rows = self.fitted.filter(|rows| rows.exponent > self.p && net_m2_per_m > 0.0)?;
        let own = (net_m2_per_m / rows.mean_m2_per_m).powf(rows.exponent) * rows.mean_leaf_area_m2_per_m;
        Some((own / (self.factor(raw_m2_per_m) * raw_m2_per_m)).ln())
    }

    /// By what a relative error of the raw leaf area weighs more in the fitted rows' own law than in the one that is applied; `None` as [`own_law`](Self::own_law).
    pub fn own_law_weighs(&self, raw_m2_per_m: f64) -> Option<f64> {
        self.own_law(raw_m2_per_m)?;
        let own = self.fitted?.exponent / self.leafy_share(raw_m2_per_m);
        Some(own / self.amplification(raw_m2_per_m))
    }

    /// Says how many m² a metre the rows have that pieces of so alike a density are of: a piece between two trees, or over one, is not as dense as its row.
    pub fn of_rows(&mut self, raw_m2_per_m: f64) {
        let factor = self.factor(raw_m2_per_m);
        if let Some(rows) = self.fitted.as_mut().filter(|_| self.quality.r2 < ALIKE_R2) {
            rows.mean_m2_per_m = raw_m2_per_m;
            rows.mean_leaf_area_m2_per_m = factor * raw_m2_per_m;
        }
    }

    /// Relative standard deviation of the leaf area of a row that is denser or thinner than all that were fitted, where nobody knows the exponent; 0 among them.
    pub fn density_sd(&self, raw_m2_per_m: f64) -> f64 {
        UNKNOWN_EXPONENT * self.beyond(raw_m2_per_m)
    }

    /// How far a raw leaf area a metre lies beyond those that were fitted, as a logarithm; of rows so alike that they tell no law, from their mean. 0 among them,
    /// and without canopy.
    fn beyond(&self, raw_m2_per_m: f64) -> f64 {
        let net_m2_per_m = self.net(raw_m2_per_m);
        let Some(rows) = self.fitted.filter(|_| net_m2_per_m > 0.0) else { return 0.0 };
        let FitQuality { low_m2_per_m, high_m2_per_m, r2, .. } = self.quality;
        let [low, high] = match r2 < ALIKE_R2 {
            true => [rows.mean_m2_per_m; 2],
            false => [low_m2_per_m, high_m2_per_m].map(|end| self.net(end)),
        };
        if net_m2_per_m < low {
            return (low / net_m2_per_m).ln();
        }
        (net_m2_per_m / high).ln().max(0.0)
    }
}
