//! Least squares on values per metre of row.

use serde::{Deserialize, Serialize};

use crate::estimate::Estimate;
use crate::regression::{FittedLine, Goodness, Z95, mean, spread, student_t_95};

use super::contact_scale::{ALIKE_R2, ClumpingBy, ContactScale, FittedRows};
use super::model::{Calibration, CalibrationClass, Linear, Power, Provenance, Training, Units};
use super::quality::FitQuality;
use super::witness::Witness;
use super::wood::Wood;

/// One row (never an isolated tree: neighbours shade each other) with its true leaf area. The default is of nothing, and is refused by a fit: it fills in what a row
/// does not tell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sample {
    /// Metres of row scanned, gaps of a metre and more left out.
    pub length_m: f64,
    /// I_T, m².
    pub impacted_total_area_m2: f64,
    /// Raw contact-frequency leaf area, m².
    pub contact_leaf_area_m2: f64,
    /// True one-sided leaf area, m².
    pub leaf_area_m2: f64,
    /// Relative standard deviation that the spot correction gives the raw leaf area; 0 for rays, and in files of versions before this key.
    #[serde(default)]
    pub spot_relative_sd: f64,
    /// Raw leaf area by the shares of spots, m²; `None` where remission was not read, and in files of versions before this key.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub share_leaf_area_m2: Option<f64>,
    /// What tells how close together leaves stand; the constant in files of versions before this key.
    #[serde(default)]
    pub clumping: ClumpingBy,
    /// Surface of the row's wood, m², where it is to be taken out of what was met; `None` where it is part of the law, and in files of versions before this key.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wood_area_m2: Option<f64>,
}

impl Sample {
    /// The sample of a row whose true leaf area is known. How close together leaves stand is told by the constant or, where a law was fitted for the scanner, by
    /// the row's scans; rows of one class and density scatter less by the constant. None if the estimate was made without a rig.
    pub fn of(estimate: &Estimate, leaf_area_m2: f64, clumping: ClumpingBy) -> Option<Self> {
        let contact = estimate.contact?;
        let told = contact.clumping.filter(|told| told.factor.is_some());
        let by_scans = told.filter(|_| clumping == ClumpingBy::Scans);
        let spot_sd = contact.clumping.map(|told| by_scans.map_or(told.constant_sd, |told| told.relative_sd));
        Some(Self {
            length_m: estimate.canopy_m?,
            impacted_total_area_m2: estimate.impacted_total_area_m2?,
            contact_leaf_area_m2: estimate.leaf.areas.contact_raw_m2().ok()?
                * by_scans.and_then(|told| told.factor).unwrap_or(1.0),
            leaf_area_m2,
            spot_relative_sd: spot_sd.or(estimate.leaf.spot_relative_sd).unwrap_or(0.0),
            share_leaf_area_m2: estimate.leaf.areas.share_raw_m2().ok(),
            clumping: by_scans.map_or(ClumpingBy::Constant, |_| ClumpingBy::Scans),
            wood_area_m2: None,
        })
    }
}

/// Fewest rows a calibration is fitted on: one more than the line has coefficients, so that leaving one out still fits.
pub const MIN_SAMPLES: usize = 3;

/// Why samples give no calibration.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
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
        /// The value found.
        value: f64,
    },
    /// How close together leaves stand is told by the constant in some rows, and by the scans in others.
    #[error(
        "row {index}: expected clumping by `{expected:?}`, as in row 0, found `{found:?}`: make all samples in one way"
    )]
    OtherClumping {
        /// Which row, from 0.
        index: usize,
        /// Of the first row.
        expected: ClumpingBy,
        /// Of that row.
        found: ClumpingBy,
    },
    /// The wood that is to be taken out is all that was met, or more.
    #[error(
        "row {index}: expected {key} a metre above the rows' mean wood, {wood:.2} m²/m (half of its surface), found {found:.2} m²/m"
    )]
    AllWood {
        /// Which row, from 0.
        index: usize,
        /// Which value.
        key: &'static str,
        /// Half of the mean surface, m²/m.
        wood: f64,
        /// The value found, m²/m.
        found: f64,
    },
    /// Wood is known of some rows only.
    #[error(
        "row {index} tells no wood_area_m2 as row 0 does, or tells it alone: give it for all rows or for none"
    )]
    WoodOfSome {
        /// Which row, from 0.
        index: usize,
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
/// (so it gives the median, not the mean, of scattered rows). `contact` is a power law by the same rule, if its exponent is above 1 and it predicts rows
/// left out by a tenth better than a proportion does, else that proportion, by least squares through the origin. An exponent below 1 is what the scatter of
/// rows that are all alike makes of any two measures. The spot correction of wide beams has an error that all rows of a class share; rows of another class have
/// another one, and an exponent enlarges it. So the exponent is fitted for values that have this error, and is smaller. `share` is fitted as for rays, for shares
/// have no rims, where all rows have a leaf area by shares of spots. Where samples tell their wood, its mean is taken out of both. Qualities are in leaf area per metre for all of them.
pub fn fit(
    samples: &[Sample],
    class: CalibrationClass,
    provenance: Provenance,
) -> Result<Calibration, FitError> {
    if samples.len() < MIN_SAMPLES {
        return Err(FitError::TooFew { expected: MIN_SAMPLES, found: samples.len() });
    }
    let clumping = samples.first().map_or_else(ClumpingBy::default, |first| first.clumping);
    for (index, sample) in samples.iter().enumerate() {
        if sample.clumping != clumping {
            return Err(FitError::OtherClumping { index, expected: clumping, found: sample.clumping });
        }
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
        let of_first = samples.first().and_then(|first| first.wood_area_m2);
        if sample.wood_area_m2.is_some() != of_first.is_some() {
            return Err(FitError::WoodOfSome { index });
        }
        if let Some(value) = sample.wood_area_m2.filter(|value| !(value.is_finite() && *value > 0.0)) {
            return Err(FitError::BadSample { index, key: "wood_area_m2", value });
        }
        if let Some(value) = sample.share_leaf_area_m2.filter(|value| !(value.is_finite() && *value > 0.0)) {
            return Err(FitError::BadSample { index, key: "share_leaf_area_m2", value });
        }
    }
    let per_metre =
        |area: fn(&Sample) -> f64| -> Vec<f64> { samples.iter().map(|s| area(s) / s.length_m).collect() };
    let impacted = per_metre(|s| s.impacted_total_area_m2);
    let contact_raw = per_metre(|s| s.contact_leaf_area_m2);
    let share_raw: Option<Vec<f64>> =
        samples.iter().map(|s| s.share_leaf_area_m2.map(|area_m2| area_m2 / s.length_m)).collect();
    let leaf = per_metre(|s| s.leaf_area_m2);
    let length: Vec<f64> = samples.iter().map(|s| s.length_m).collect();
    let wood: Option<Vec<f64>> =
        samples.iter().map(|s| s.wood_area_m2.map(|area_m2| area_m2 / s.length_m)).collect();
    let wood = wood.and_then(|surfaces| Wood::of(&surfaces));
    let spot: Vec<f64> = samples.iter().map(|s| s.spot_relative_sd.max(0.0)).collect();
    let n = u32::try_from(samples.len()).unwrap_or(u32::MAX);
    if !spread(&leaf) {
        return Err(FitError::NoSpread { key: "leaf_area_m2" });
    }
    Ok(Calibration {
        fingerprint: None,
        units: Units::SquareMetres,
        class,
        provenance,
        training: Training { n, reference_length_m: 1.0, mean_leaf_area_m2_per_m: mean(&leaf) },
        linear: linear(&impacted, &leaf)?,
        power: power(&impacted, &leaf, 0.0)?,
        contact: ContactScale {
            clumping,
            ..scale("contact_leaf_area_m2", &contact_raw, &leaf, &length, mean(&spot), wood)?
        },
        witness: share_raw.as_ref().and_then(|share| Witness::of(&length, &contact_raw, share)),
        share: share_raw
            .map(|raw| scale("share_leaf_area_m2", &raw, &leaf, &length, 0.0, wood))
            .transpose()?,
    })
}

fn linear(x: &[f64], y: &[f64]) -> Result<Linear, FitError> {
    let line = FittedLine::fit(x, y).ok_or(NO_SPREAD)?;
    Ok(Linear {
        a_m2_per_m: line.intercept,
        b: line.slope,
        quality: quality(x, y, Goodness::of_line(&line, x, y)),
    })
}

/// A power law for rows whose x has a relative error of `x_sd` that the fitted rows do not show.
fn power(x: &[f64], y: &[f64], x_sd: f64) -> Result<Power, FitError> {
    let (ln_x, ln_y) = (ln(x), ln(y));
    let line = FittedLine::fit_for(&ln_x, &ln_y, x_sd).ok_or(NO_SPREAD)?;
    let fitted = ln_x.iter().map(|&x| line.at(x).exp());
    let left_out = line.left_out(&ln_x, &ln_y).map(f64::exp);
    let goodness = Goodness::of(y, fitted, left_out);
    Ok(Power { c: line.intercept.exp(), p: line.slope, quality: quality(x, y, goodness) })
}

fn ln(values: &[f64]) -> Vec<f64> {
    values.iter().map(|v| v.ln()).collect()
}

/// The law of rows of so many metres as they are, from the logarithms of their raw and their true leaf areas a metre; `None` where either does not differ.
/// Rows that are alike tell none: theirs is the `usual` exponent.
fn own_law(ln_x: &[f64], ln_y: &[f64], length_m: &[f64], usual: f64) -> Option<FittedRows> {
    let turned = FittedLine::fit(ln_y, ln_x)
        .filter(|line| line.slope > 0.0 && Goodness::of_line(line, ln_y, ln_x).r2 >= ALIKE_R2)
        .map(|line| line.slope.recip());
    let exponent = turned.or_else(|| FittedLine::fit(ln_x, ln_y).map(|line| line.slope.max(usual)))?;
    let (mean_x, mean_y) = (mean(ln_x), mean(ln_y));
    let off = |(x, y): (&f64, &f64)| (y - mean_y - exponent * (x - mean_x)).powi(2);
    let squares: f64 = ln_x.iter().zip(ln_y).map(off).sum();
    // Two rows have no scatter about a line.
    let free = ln_x.len().checked_sub(2).filter(|free| *free > 0);
    Some(FittedRows {
        mean_m2_per_m: mean_x.exp(),
        mean_leaf_area_m2_per_m: mean_y.exp(),
        exponent,
        scatter: free.map(|free| (squares / free as f64).sqrt()),
        row_m: Some(mean(length_m)),
    })
}

/// The exponent of rows of one kind and many densities: 1.3 to 1.4 of rays and 1.8 to 2.5 through wide beams, which dense rows stop, in all calibrations that are
/// shipped.
fn usual_exponent(spot_sd: f64) -> f64 {
    if spot_sd > 0.0 { 2.2 } else { 1.3 }
}

/// The scale of raw leaf areas `raw`, which a sample has under `key`, this wood taken out.
fn scale(
    key: &'static str,
    raw: &[f64],
    y: &[f64],
    length_m: &[f64],
    spot_sd: f64,
    wood: Option<Wood>,
) -> Result<ContactScale, FitError> {
    let out = wood.map_or(0.0, |wood| wood.m2_per_m);
    if let Some((index, found)) = raw.iter().enumerate().find(|(_, raw)| **raw <= out) {
        return Err(FitError::AllWood { index, key, wood: out, found: *found });
    }
    let x: &[f64] = &raw.iter().map(|raw| raw - out).collect::<Vec<f64>>();
    // The spot's error is of all that was met, and a larger one of the leaves alone.
    let spot_sd = spot_sd * mean(raw) / mean(x);
    let line = FittedLine::through_origin(x, y).ok_or(FitError::NoSpread { key })?;
    let good = quality(raw, y, Goodness::of_line(&line, x, y));
    let fitted = own_law(&ln(x), &ln(y), length_m, usual_exponent(spot_sd));
    let proportion = ContactScale {
        k: line.slope,
        p: 1.0,
        fitted,
        k_sd: few_rows_sd(1.0, &good),
        clumping: ClumpingBy::Constant,
        wood,
        quality: good,
    };
    let pays = |power: &Power| {
        power.p > 1.0 && power.quality.loo_rmse_relative < PAYS * proportion.quality.loo_rmse_relative
    };
    Ok(match power(x, y, spot_sd).ok().filter(pays) {
        Some(Power { c, p, quality }) => {
            let range =
                FitQuality { low_m2_per_m: good.low_m2_per_m, high_m2_per_m: good.high_m2_per_m, ..quality };
            ContactScale { k: c, p, k_sd: few_rows_sd(2.0, &range), quality: range, ..proportion }
        }
        None => proportion,
    })
}

/// A law of so many rows is as good as known: what they scatter by moves it by less than a fifth of itself.
const MANY_ROWS: u32 = 30;

/// Relative standard deviation of the factor of a law of so many coefficients; none where many rows were fitted. By it the interval of a normal law is as
/// wide as that of Student's t.
fn few_rows_sd(coefficients: f64, quality: &FitQuality) -> Option<f64> {
    let n = f64::from(quality.n);
    let of_mean = student_t_95(n - coefficients) / Z95 * quality.loo_rmse_relative / n.sqrt();
    Some(of_mean).filter(|sd| quality.n < MANY_ROWS && sd.is_finite())
}

/// The leave-one-out error of a power law must be below that of a proportion times this, or its second coefficient is not worth it.
const PAYS: f64 = 0.9;

const NO_SPREAD: FitError = FitError::NoSpread { key: "impacted_total_area_m2" };

fn quality(x: &[f64], y: &[f64], goodness: Goodness) -> FitQuality {
    FitQuality {
        n: u32::try_from(y.len()).unwrap_or(u32::MAX),
        r2: goodness.r2,
        r2_uncentred: goodness.r2_uncentred,
        loo_rmse_relative: goodness.loo_rmse_relative,
        low_m2_per_m: x.iter().copied().fold(f64::INFINITY, f64::min),
        high_m2_per_m: x.iter().copied().fold(0.0, f64::max),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Even numbers from 0 to 1, the same on every machine.
    fn unit(state: &mut u64) -> f64 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A proportion of 0.8 through rows whose leaf areas scatter by 5 %.
    fn scale_of(rows: usize, state: &mut u64) -> ContactScale {
        let x: Vec<f64> = (0..rows).map(|_| 4.0 + 4.0 * unit(state)).collect();
        let y: Vec<f64> = x
            .iter()
            .map(|x| {
                // Twelve even numbers are as good as normal.
                let normal = (0..12).map(|_| unit(state)).sum::<f64>() - 6.0;
                0.8 * x * (1.0 + 0.05 * normal)
            })
            .collect();
        scale("contact_leaf_area_m2", &x, &y, &vec![15.0; rows], 0.0, None).expect("rows that differ")
    }

    #[test]
    fn the_interval_of_a_factor_of_few_rows_holds_the_true_one() {
        let mut state = 7;
        for rows in [3, 5, 10, 29] {
            let tries = 1000;
            let held = (0..tries).filter(|_| {
                let found = scale_of(rows, &mut state);
                let half = Z95 * found.k_sd.expect("few rows");
                // At the middle of the rows: a power law is only known there.
                let factor = found.factor(6.0);
                (factor * (-half).exp()..=factor * half.exp()).contains(&0.8)
            });
            let share = held.count() as f64 / f64::from(tries);
            assert!((0.93..=0.995).contains(&share), "{rows} rows: {share}");
        }
        assert_eq!(scale_of(MANY_ROWS as usize, &mut state).k_sd, None);
    }
}
