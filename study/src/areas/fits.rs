//! Leaf area regressed on impacted areas, in the paper's forms.

use rowscan_canopy::reference::{ImpactedArea, PAPER, PaperRegression, View as Side};
use rowscan_canopy::regression::{FittedLine, Goodness};
use rowscan_scenes::scan::ScanAreas;
use serde::Serialize;

use super::Orchard;

/// The three regressions of a view.
#[derive(Clone, Debug, Serialize)]
pub struct View {
    /// On I_L.
    #[serde(rename = "I_L")]
    pub leaf: Option<Fit>,
    /// On I_T.
    #[serde(rename = "I_T")]
    pub total: Option<Fit>,
    /// On I_3L.
    #[serde(rename = "I_3L")]
    pub three_leaves: Option<Fit>,
}

/// L_A regressed on one impacted area, in the paper's form: with an intercept for I_T, through the origin for the others.
#[derive(Clone, Debug, Serialize)]
pub struct Fit {
    /// m² of leaf a m² impacted.
    pub slope: f64,
    /// m² an orchard; for I_T only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub intercept_m2: Option<f64>,
    /// Slope of the line through the origin.
    pub slope_origin: f64,
    /// Slope of the line with an intercept, whatever the paper's form.
    pub slope_free: f64,
    /// Its intercept, m².
    pub intercept_free_m2: f64,
    /// Centred R² of the paper's form.
    pub r2: f64,
    /// Uncentred R² of the paper's form.
    pub r2_uncentred: f64,
    /// Leave-one-out error of the paper's form over the mean leaf area.
    pub loo_rmse_relative: f64,
    /// Centred R² of the line through the origin.
    pub r2_origin: f64,
    /// Leave-one-out error of the line through the origin over the mean leaf area.
    pub loo_rmse_relative_origin: f64,
    /// Student's t of a quadratic term on top of a straight line: above 2 or so, the cloud bends upwards.
    pub residual_trend_t: Option<f64>,
    /// The power law beside it.
    pub power: Option<PowerFit>,
    /// What the paper prints; None of orchards that are not its.
    pub paper: Option<PaperRegression>,
    /// The line in the paper's form with what its band needs.
    #[serde(skip)]
    line: FittedLine,
    #[serde(skip)]
    residual_sd_m2: f64,
}

/// L_A = c · I^p, fitted in logarithms.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct PowerFit {
    /// Leaf area at an impacted area of 1 m², m².
    pub c: f64,
    /// Exponent.
    pub p: f64,
    /// Centred R², in m².
    pub r2: f64,
    /// Leave-one-out error over the mean leaf area.
    pub loo_rmse_relative: f64,
    /// Student's t of a quadratic term, in logarithms.
    pub residual_trend_t: Option<f64>,
}

impl View {
    /// The same of orchards that are not the paper's: its numbers say nothing of them.
    #[must_use]
    pub fn without_paper(self) -> Self {
        let alone = |fit: Option<Fit>| fit.map(|fit| Fit { paper: None, ..fit });
        Self { leaf: alone(self.leaf), total: alone(self.total), three_leaves: alone(self.three_leaves) }
    }

    /// The regressions with their names, in the paper's order.
    pub fn fits(&self) -> [(ImpactedArea, Option<&Fit>); 3] {
        [
            (ImpactedArea::Leaf, self.leaf.as_ref()),
            (ImpactedArea::Total, self.total.as_ref()),
            (ImpactedArea::ThreeLeaves, self.three_leaves.as_ref()),
        ]
    }
}

/// The regressions from beside and from above.
pub fn views(orchards: &[Orchard]) -> (View, View) {
    let leaf: Vec<f64> = orchards.iter().map(|orchard| orchard.leaf_area_m2).collect();
    let view = |side: Side, areas: fn(&Orchard) -> &ScanAreas| {
        let fit = |kind: ImpactedArea| {
            let x: Vec<f64> = orchards.iter().map(|orchard| impacted(areas(orchard), kind)).collect();
            Fit::of(&x, &leaf, side, kind)
        };
        View {
            leaf: fit(ImpactedArea::Leaf),
            total: fit(ImpactedArea::Total),
            three_leaves: fit(ImpactedArea::ThreeLeaves),
        }
    };
    (view(Side::Lateral, |orchard| &orchard.lateral), view(Side::Zenith, |orchard| &orchard.zenith))
}

/// Largest leaf area over smallest.
pub(super) fn max_over_min(orchards: &[Orchard]) -> f64 {
    let leaf = || orchards.iter().map(|orchard| orchard.leaf_area_m2);
    leaf().fold(0.0, f64::max) / leaf().fold(f64::INFINITY, f64::min)
}

/// One of the three areas.
pub fn impacted(areas: &ScanAreas, kind: ImpactedArea) -> f64 {
    match kind {
        ImpactedArea::Leaf => areas.leaf_m2,
        ImpactedArea::Total => areas.total_m2,
        ImpactedArea::ThreeLeaves => areas.three_leaves_m2,
    }
}

impl Fit {
    /// None where the impacted areas do not spread enough for a line.
    fn of(x: &[f64], y: &[f64], side: Side, kind: ImpactedArea) -> Option<Self> {
        let origin = FittedLine::through_origin(x, y)?;
        let free = FittedLine::fit(x, y)?;
        let line = if kind == ImpactedArea::Total { &free } else { &origin };
        let goodness = Goodness::of_line(line, x, y);
        let goodness_origin = Goodness::of_line(&origin, x, y);
        Some(Self {
            slope: line.slope,
            intercept_m2: (kind == ImpactedArea::Total).then_some(line.intercept),
            slope_origin: origin.slope,
            slope_free: free.slope,
            intercept_free_m2: free.intercept,
            r2: goodness.r2,
            r2_uncentred: goodness.r2_uncentred,
            loo_rmse_relative: goodness.loo_rmse_relative,
            r2_origin: goodness_origin.r2,
            loo_rmse_relative_origin: goodness_origin.loo_rmse_relative,
            residual_trend_t: bend_t(x, y),
            power: PowerFit::of(x, y),
            paper: PAPER.iter().find(|paper| paper.view == side && paper.area == kind).copied(),
            residual_sd_m2: line.residual_sd(x, y),
            line: line.clone(),
        })
    }

    /// Half the width of the line's 95 % confidence band at an impacted area, m².
    pub fn half_band_m2(&self, impacted_m2: f64) -> f64 {
        self.line.half_band(impacted_m2, self.residual_sd_m2)
    }

    /// The fitted line at an impacted area, m².
    pub fn leaf_area_m2(&self, impacted_m2: f64) -> f64 {
        self.intercept_m2.unwrap_or(0.0) + self.slope * impacted_m2
    }
}

impl PowerFit {
    fn of(x: &[f64], y: &[f64]) -> Option<Self> {
        if x.iter().chain(y).any(|value| *value <= 0.0) {
            return None;
        }
        let ln = |values: &[f64]| -> Vec<f64> { values.iter().map(|value| value.ln()).collect() };
        let (ln_x, ln_y) = (ln(x), ln(y));
        let line = FittedLine::fit(&ln_x, &ln_y)?;
        let fitted = ln_x.iter().map(|&x| line.at(x).exp());
        let goodness = Goodness::of(y, fitted, line.left_out(&ln_x, &ln_y).map(f64::exp));
        Some(Self {
            c: line.intercept.exp(),
            p: line.slope,
            r2: goodness.r2,
            loo_rmse_relative: goodness.loo_rmse_relative,
            residual_trend_t: bend_t(&ln_x, &ln_y),
        })
    }
}

/// Student's t of the coefficient of x² in y = a + b x + c x², by taking the straight line out of both x² and y first.
fn bend_t(x: &[f64], y: &[f64]) -> Option<f64> {
    let square: Vec<f64> = x.iter().map(|x| x * x).collect();
    let rest = |values: &[f64]| -> Option<Vec<f64>> {
        let line = FittedLine::fit(x, values)?;
        Some(x.iter().zip(values).map(|(&x, value)| value - line.at(x)).collect())
    };
    let (square, y) = (rest(&square)?, rest(y)?);
    let sum_qq: f64 = square.iter().map(|q| q * q).sum();
    let c = square.iter().zip(&y).map(|(q, y)| q * y).sum::<f64>() / sum_qq;
    let sse: f64 = square.iter().zip(&y).map(|(q, y)| (y - c * q).powi(2)).sum();
    let t = c / (sse / (x.len() as f64 - 3.0) / sum_qq).sqrt();
    (x.len() > 3 && t.is_finite()).then_some(t)
}

/// How an impacted area is written.
pub fn symbol(area: ImpactedArea) -> &'static str {
    match area {
        ImpactedArea::Leaf => "I_L",
        ImpactedArea::Total => "I_T",
        ImpactedArea::ThreeLeaves => "I_3L",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bend_is_told_from_a_straight_cloud() {
        let x: Vec<f64> = (1..=20).map(f64::from).collect();
        let wobble = |x: f64| if (x as u32).is_multiple_of(2) { 0.3 } else { -0.3 };
        let straight: Vec<f64> = x.iter().map(|x| 2.0 + 3.0 * x + wobble(*x)).collect();
        let convex: Vec<f64> = x.iter().map(|x| 0.1 * x * x + wobble(*x)).collect();
        assert!(bend_t(&x, &straight).unwrap().abs() < 1.0);
        assert!(bend_t(&x, &convex).unwrap() > 10.0);
    }

    #[test]
    fn a_power_law_is_found_again() {
        let x: Vec<f64> = (1..=20).map(|i| f64::from(i) * 0.2).collect();
        let y: Vec<f64> = x.iter().map(|x| 2.5 * x.powf(1.5)).collect();
        let power = PowerFit::of(&x, &y).unwrap();
        assert!((power.c - 2.5).abs() < 1e-9 && (power.p - 1.5).abs() < 1e-9);
        assert!(power.loo_rmse_relative < 1e-9);
    }
}
