//! Straight lines by least squares, and how good they are.

/// y = intercept + slope · x.
#[derive(Clone, Debug, PartialEq)]
pub struct FittedLine {
    /// y at x = 0; 0 for a line through the origin.
    pub intercept: f64,
    /// Rise of y a unit of x.
    pub slope: f64,
    form: Form,
}

/// What the leverage of a point depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Form {
    Free { n: f64, mean_x: f64, sum_xx: f64 },
    Origin { n: f64, sum_xx: f64 },
}

impl FittedLine {
    /// Ordinary least squares. None where x does not spread, or where one point alone decides the line (without it the others' x are
    /// all the same).
    pub fn fit(x: &[f64], y: &[f64]) -> Option<Self> {
        Self::fit_for(x, y, 0.0)
    }

    /// The same for later points whose x has an error of standard deviation `x_sd` that these points do not show. The line that predicts them best is
    /// flatter (ridge regression).
    pub fn fit_for(x: &[f64], y: &[f64], x_sd: f64) -> Option<Self> {
        let (mean_x, mean_y) = (mean(x), mean(y));
        let scatter: f64 = x.iter().map(|x| (x - mean_x).powi(2)).sum();
        let sum_xx = scatter + x.len() as f64 * x_sd * x_sd;
        let sum_xy: f64 = x.iter().zip(y).map(|(x, y)| (x - mean_x) * (y - mean_y)).sum();
        if !spread(x) {
            return None;
        }
        let slope = sum_xy / sum_xx;
        let form = Form::Free { n: x.len() as f64, mean_x, sum_xx };
        Self { intercept: mean_y - slope * mean_x, slope, form }.steady(x)
    }

    /// Least squares through the origin. None where all x but one are 0.
    pub fn through_origin(x: &[f64], y: &[f64]) -> Option<Self> {
        let sum_xx: f64 = x.iter().map(|x| x * x).sum();
        let sum_xy: f64 = x.iter().zip(y).map(|(x, y)| x * y).sum();
        Self { intercept: 0.0, slope: sum_xy / sum_xx, form: Form::Origin { n: x.len() as f64, sum_xx } }
            .steady(x)
    }

    /// The line at `x`.
    pub fn at(&self, x: f64) -> f64 {
        self.intercept + self.slope * x
    }

    /// What the line fitted without point i says of point i: y − e / (1 − h), the closed form of refitting n times. `x` and `y` are those
    /// it was fitted to.
    pub fn left_out<'a>(&'a self, x: &'a [f64], y: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
        x.iter().zip(y).map(|(&x, &y)| y - (y - self.at(x)) / (1.0 - self.leverage(x)))
    }

    /// Standard deviation of the points about the line it was fitted to, with the degrees of freedom that the line leaves.
    pub fn residual_sd(&self, x: &[f64], y: &[f64]) -> f64 {
        let squares: f64 = x.iter().zip(y).map(|(&x, &y)| (y - self.at(x)).powi(2)).sum();
        (squares / self.freedom()).sqrt()
    }

    /// Half the width of the 95 % confidence band of the line's mean at `x`, by Student's t, from the [`Self::residual_sd`] of its points.
    pub fn half_band(&self, x: f64, residual_sd: f64) -> f64 {
        student_t_95(self.freedom()) * residual_sd * self.leverage(x).sqrt()
    }

    /// Points less what the line takes.
    fn freedom(&self) -> f64 {
        match self.form {
            Form::Free { n, .. } => n - 2.0,
            Form::Origin { n, .. } => n - 1.0,
        }
    }

    fn steady(self, x: &[f64]) -> Option<Self> {
        let steady = !x.is_empty() && x.iter().all(|&x| self.leverage(x) <= 1.0 - 1e-9);
        (steady && self.slope.is_finite() && self.intercept.is_finite()).then_some(self)
    }

    fn leverage(&self, x: f64) -> f64 {
        match self.form {
            Form::Free { n, mean_x, sum_xx } => 1.0 / n + (x - mean_x).powi(2) / sum_xx,
            Form::Origin { sum_xx, .. } => x * x / sum_xx,
        }
    }
}

/// How well a fit meets the values it was made for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Goodness {
    /// 1 − SSE / Σ(y − mean)².
    pub r2: f64,
    /// 1 − SSE / Σy²: what some programs report for lines through the origin; never lower.
    pub r2_uncentred: f64,
    /// Root mean square of the leave-one-out errors over the mean of y.
    pub loo_rmse_relative: f64,
}

impl Goodness {
    /// Of fitted values, and of the values fitted without each point, against `y`.
    pub fn of(y: &[f64], fitted: impl Iterator<Item = f64>, left_out: impl Iterator<Item = f64>) -> Self {
        let mean_y = mean(y);
        let sse: f64 = y.iter().zip(fitted).map(|(y, f)| (y - f).powi(2)).sum();
        let loo: f64 = y.iter().zip(left_out).map(|(y, f)| (y - f).powi(2)).sum();
        Self {
            r2: 1.0 - sse / y.iter().map(|y| (y - mean_y).powi(2)).sum::<f64>(),
            r2_uncentred: 1.0 - sse / y.iter().map(|y| y * y).sum::<f64>(),
            loo_rmse_relative: (loo / y.len() as f64).sqrt() / mean_y,
        }
    }

    /// Of a line against the points it was fitted to.
    pub fn of_line(line: &FittedLine, x: &[f64], y: &[f64]) -> Self {
        Self::of(y, x.iter().map(|&x| line.at(x)), line.left_out(x, y))
    }
}

/// Standard normal quantile of a two-sided 95 % interval.
pub const Z95: f64 = 1.959_963_985;

/// Student's t that 97.5 % stay below, by the expansion about the normal quantile (Abramowitz and Stegun 26.7.5): to a thousandth from 5 degrees of
/// freedom on.
pub fn student_t_95(freedom: f64) -> f64 {
    student_t(Z95, freedom)
}

/// Student's t that 99.5 % stay below, by the same expansion.
pub(crate) fn student_t_99(freedom: f64) -> f64 {
    student_t(2.575_829_304, freedom)
}

fn student_t(z: f64, freedom: f64) -> f64 {
    let terms = [
        (z.powi(3) + z) / 4.0,
        (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / 96.0,
        (3.0 * z.powi(7) + 19.0 * z.powi(5) + 17.0 * z.powi(3) - 15.0 * z) / 384.0,
        (79.0 * z.powi(9) + 776.0 * z.powi(7) + 1482.0 * z.powi(5) - 1920.0 * z.powi(3) - 945.0 * z)
            / 92_160.0,
    ];
    terms.iter().rev().fold(0.0, |sum, term| (sum + term) / freedom) + z
}

/// Arithmetic mean; NaN of nothing.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// True if the values differ by more than rounding.
pub fn spread(values: &[f64]) -> bool {
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    high - low > 1e-9 * high.abs().max(low.abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn student_s_t_and_the_band_of_a_line_are_the_tables() {
        for (freedom, table) in [(5.0, 2.5706), (10.0, 2.2281), (18.0, 2.1009), (100.0, 1.9840)] {
            assert!((student_t_95(freedom) - table).abs() < 2e-3, "{freedom} {}", student_t_95(freedom));
        }
        // Ten points at x = ±1 about y = 0, off by ±1: s² = 10 / 8, and at x = 0 the mean's own error, s / √10.
        let x: Vec<f64> = (0..10).map(|i| if i < 5 { -1.0 } else { 1.0 }).collect();
        let y: Vec<f64> = [1.0, -1.0, 1.0, -1.0, 0.0, 1.0, -1.0, 1.0, -1.0, 0.0].to_vec();
        let line = FittedLine::fit(&x, &y).unwrap();
        let sd = line.residual_sd(&x, &y);
        assert!((sd - 1.0).abs() < 1e-12, "eight squares of 1 over eight: {sd}");
        assert!((line.half_band(0.0, sd) - 2.306 / 10.0f64.sqrt()).abs() < 1e-3);
        assert!((line.half_band(1.0, sd) / line.half_band(0.0, sd) - 2.0f64.sqrt()).abs() < 1e-12);
        let origin = FittedLine::through_origin(&x, &y).unwrap();
        assert_eq!(origin.half_band(0.0, origin.residual_sd(&x, &y)), 0.0);
    }

    const X: [f64; 5] = [1.0, 2.0, 4.0, 7.0, 11.0];
    const Y: [f64; 5] = [1.5, 4.0, 9.0, 13.0, 24.0];

    /// Leaves out one point after the other and fits again.
    fn refitted(fit: fn(&[f64], &[f64]) -> Option<FittedLine>) -> Vec<f64> {
        (0..X.len())
            .map(|skip| {
                let rest = |values: &[f64]| -> Vec<f64> {
                    values.iter().enumerate().filter(|(i, _)| *i != skip).map(|(_, v)| *v).collect()
                };
                fit(&rest(&X), &rest(&Y)).unwrap().at(X[skip])
            })
            .collect()
    }

    #[test]
    fn leaving_one_out_in_closed_form_is_refitting_without_it() {
        for fit in [FittedLine::fit, FittedLine::through_origin] {
            let line = fit(&X, &Y).unwrap();
            for (closed, anew) in line.left_out(&X, &Y).zip(refitted(fit)) {
                assert!((closed - anew).abs() < 1e-12, "{closed} {anew}");
            }
        }
    }

    #[test]
    fn a_line_is_found_again_and_its_goodness_is_whole() {
        let y: Vec<f64> = X.iter().map(|x| 3.0 - 0.5 * x).collect();
        let line = FittedLine::fit(&X, &y).unwrap();
        assert!((line.intercept - 3.0).abs() < 1e-12 && (line.slope + 0.5).abs() < 1e-12);
        let goodness = Goodness::of_line(&line, &X, &y);
        assert!((goodness.r2 - 1.0).abs() < 1e-12 && (goodness.r2_uncentred - 1.0).abs() < 1e-12);
        assert!(goodness.loo_rmse_relative.abs() < 1e-12);
    }

    #[test]
    fn a_line_for_points_that_are_off_is_flatter_by_their_share_of_the_scatter() {
        let plain = FittedLine::fit(&X, &Y).unwrap();
        let scatter = X.iter().map(|x| (x - mean(&X)).powi(2)).sum::<f64>() / X.len() as f64;
        let half = FittedLine::fit_for(&X, &Y, scatter.sqrt()).unwrap();
        assert!((half.slope - plain.slope / 2.0).abs() < 1e-12);
        assert!((half.at(mean(&X)) - mean(&Y)).abs() < 1e-12);
        assert_eq!(FittedLine::fit_for(&X, &Y, 0.0), Some(plain));
    }

    #[test]
    fn a_line_needs_spread() {
        assert_eq!(FittedLine::fit(&[2.0, 2.0, 2.0], &[1.0, 2.0, 3.0]), None);
        assert_eq!(FittedLine::fit(&[2.0, 2.0, 5.0], &[1.0, 2.0, 3.0]), None, "one point alone decides it");
        assert_eq!(FittedLine::through_origin(&[0.0, 0.0, 5.0], &[1.0, 2.0, 3.0]), None);
        assert_eq!(FittedLine::fit(&[], &[]), None);
    }
}
