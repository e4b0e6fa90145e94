//! Least squares on values per metre of row.

use crate::estimate::Estimate;

use super::{Calibration, Class, Contact, Linear, Power, Provenance, Quality, Training, Units};

/// One row (never an isolated tree: neighbours shade each other) with its true leaf area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Metres of row scanned, gaps of a metre and more left out.
    pub length_m: f64,
    /// I_T, m².
    pub impacted_total_area_m2: f64,
    /// Raw contact-frequency leaf area, m².
    pub contact_leaf_area_m2: f64,
    /// True one-sided leaf area, m².
    pub leaf_area_m2: f64,
}

impl Sample {
    /// The sample of a row whose true leaf area is known. None if the estimate was made without a rig.
    pub fn of(estimate: &Estimate, leaf_area_m2: f64) -> Option<Self> {
        Some(Self {
            length_m: estimate.canopy_m?,
            impacted_total_area_m2: estimate.impacted_total_area_m2?,
            contact_leaf_area_m2: estimate.leaf_area_contact_raw_m2?,
            leaf_area_m2,
        })
    }
}

/// Fewest rows a calibration is fitted on: one more than the line has coefficients, so that leaving one out still fits.
pub const MIN_SAMPLES: usize = 3;

/// Why samples give no calibration.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FitError {
    /// Too few rows.
    #[error("a calibration needs at least {expected} rows, found {found}")]
    TooFew {
        /// [`MIN_SAMPLES`].
        expected: usize,
        /// Given.
        found: usize,
    },
    /// A value that must be a positive number is not.
    #[error("row {index}: {key} must be a positive number, found {value}")]
    BadSample {
        /// Which row, from 0.
        index: usize,
        /// Which value.
        key: &'static str,
        /// What stands there.
        value: f64,
    },
    /// All rows agree in a value that the fit needs to differ, with any one row left out.
    #[error("the rows' {key} per metre do not differ enough to fit a line")]
    NoSpread {
        /// Which value.
        key: &'static str,
    },
}

/// Fits the three estimators on rows.
///
/// All in values per metre of row: `linear` by ordinary least squares, `power` by ordinary least squares of ln L on ln I_T
/// (so it gives the median, not the mean, of scattered rows), `contact` by least squares through the origin. Qualities
/// are in leaf area per metre for all three.
pub fn fit(samples: &[Sample], class: Class, provenance: Provenance) -> Result<Calibration, FitError> {
    if samples.len() < MIN_SAMPLES {
        return Err(FitError::TooFew { expected: MIN_SAMPLES, found: samples.len() });
    }
    for (index, sample) in samples.iter().enumerate() {
        for (key, value) in [
            ("length_m", sample.length_m),
            ("impacted_total_area_m2", sample.impacted_total_area_m2),
            ("contact_leaf_area_m2", sample.contact_leaf_area_m2),
            ("leaf_area_m2", sample.leaf_area_m2),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return Err(FitError::BadSample { index, key, value });
            }
        }
    }
    let per_metre =
        |area: fn(&Sample) -> f64| -> Vec<f64> { samples.iter().map(|s| area(s) / s.length_m).collect() };
    let impacted = per_metre(|s| s.impacted_total_area_m2);
    let contact = per_metre(|s| s.contact_leaf_area_m2);
    let leaf = per_metre(|s| s.leaf_area_m2);
    let n = u32::try_from(samples.len()).unwrap_or(u32::MAX);
    if !spread(&leaf) {
        return Err(FitError::NoSpread { key: "leaf_area_m2" });
    }
    Ok(Calibration {
        units: Units::SquareMetres,
        class,
        provenance,
        training: Training { n, reference_length_m: 1.0, mean_leaf_area_m2_per_m: mean(&leaf) },
        linear: linear(&impacted, &leaf)?,
        power: power(&impacted, &leaf)?,
        contact: through_origin(&contact, &leaf)?,
    })
}

fn linear(x: &[f64], y: &[f64]) -> Result<Linear, FitError> {
    let line = Line::fit(x, y)?;
    let fitted = x.iter().map(|&x| line.at(x));
    let left_out = line.left_out(x, y);
    Ok(Linear { a_m2_per_m: line.a, b: line.b, quality: quality(x, y, fitted, left_out) })
}

fn power(x: &[f64], y: &[f64]) -> Result<Power, FitError> {
    let ln = |values: &[f64]| -> Vec<f64> { values.iter().map(|v| v.ln()).collect() };
    let (ln_x, ln_y) = (ln(x), ln(y));
    let line = Line::fit(&ln_x, &ln_y)?;
    let fitted = ln_x.iter().map(|&x| line.at(x).exp());
    let left_out = line.left_out(&ln_x, &ln_y).map(f64::exp);
    Ok(Power { c: line.a.exp(), p: line.b, quality: quality(x, y, fitted, left_out) })
}

fn through_origin(x: &[f64], y: &[f64]) -> Result<Contact, FitError> {
    let sum_xx: f64 = x.iter().map(|x| x * x).sum();
    let sum_xy: f64 = x.iter().zip(y).map(|(x, y)| x * y).sum();
    let k = sum_xy / sum_xx;
    let left_out = x.iter().zip(y).map(|(x, y)| x * (sum_xy - x * y) / (sum_xx - x * x));
    Ok(Contact { k, quality: quality(x, y, x.iter().map(|x| k * x), left_out) })
}

/// y = a + b x, with what leaving one out needs.
struct Line {
    a: f64,
    b: f64,
    mean_x: f64,
    sum_xx: f64,
    n: f64,
}

impl Line {
    fn fit(x: &[f64], y: &[f64]) -> Result<Self, FitError> {
        let no_spread = FitError::NoSpread { key: "impacted_total_area_m2" };
        let (mean_x, mean_y) = (mean(x), mean(y));
        let sum_xx: f64 = x.iter().map(|x| (x - mean_x).powi(2)).sum();
        let sum_xy: f64 = x.iter().zip(y).map(|(x, y)| (x - mean_x) * (y - mean_y)).sum();
        if !spread(x) {
            return Err(no_spread);
        }
        let b = sum_xy / sum_xx;
        let line = Self { a: mean_y - b * mean_x, b, mean_x, sum_xx, n: x.len() as f64 };
        // A row with full leverage alone decides the line: without it the others' x are all the same.
        if x.iter().any(|&x| line.leverage(x) > 1.0 - 1e-9) { Err(no_spread) } else { Ok(line) }
    }

    fn at(&self, x: f64) -> f64 {
        self.a + self.b * x
    }

    fn leverage(&self, x: f64) -> f64 {
        1.0 / self.n + (x - self.mean_x).powi(2) / self.sum_xx
    }

    /// What the line fitted without row i says of row i: y − e / (1 − h), the closed form of refitting n times.
    fn left_out<'a>(&'a self, x: &'a [f64], y: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
        x.iter().zip(y).map(|(&x, &y)| y - (y - self.at(x)) / (1.0 - self.leverage(x)))
    }
}

fn quality(
    x: &[f64],
    y: &[f64],
    fitted: impl Iterator<Item = f64>,
    left_out: impl Iterator<Item = f64>,
) -> Quality {
    let mean_y = mean(y);
    let sse: f64 = y.iter().zip(fitted).map(|(y, f)| (y - f).powi(2)).sum();
    let loo: f64 = y.iter().zip(left_out).map(|(y, f)| (y - f).powi(2)).sum();
    Quality {
        n: u32::try_from(y.len()).unwrap_or(u32::MAX),
        r2: 1.0 - sse / y.iter().map(|y| (y - mean_y).powi(2)).sum::<f64>(),
        r2_uncentred: 1.0 - sse / y.iter().map(|y| y * y).sum::<f64>(),
        loo_rmse_relative: (loo / y.len() as f64).sqrt() / mean_y,
        low_m2_per_m: x.iter().copied().fold(f64::INFINITY, f64::min),
        high_m2_per_m: x.iter().copied().fold(0.0, f64::max),
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// True if the values differ by more than rounding.
fn spread(values: &[f64]) -> bool {
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    high - low > 1e-9 * high.abs().max(low.abs())
}
