//! Every point of a search beside the paper.

use rowscan_canopy::reference::{ImpactedArea, PAPER, PaperRegression, View as Side};
use serde::Serialize;
use serde_json::{Map, Value};

use super::bootstrap::Draws;
use super::{SearchStudy, Tried};
use crate::areas::{Fit, Gate, Rule, View, gates, views};
use crate::{Header, Unit, median};

/// Fewest seeds that confirm a point.
pub const LEAST_SEEDS: usize = 10;

/// What the search found.
#[derive(Clone, Debug, Serialize)]
pub struct SearchReport {
    /// Version, seed, scene, settings.
    pub provenance: Header<SearchStudy>,
    /// The paper's regressions.
    pub paper: &'static [PaperRegression],
    /// All points, in their order.
    pub points: Vec<PointReport>,
}

/// One point, by its medians over the seeds.
#[derive(Clone, Debug, Serialize)]
pub struct PointReport {
    /// Its number; 0 is the base.
    pub point: usize,
    /// True if it turns one knob alone.
    pub single: bool,
    /// What it sets.
    pub settings: Map<String, Value>,
    /// Seeds at which it could be.
    pub seeds: usize,
    /// Why it could not at the others.
    pub refused: Option<String>,
    /// True if these seeds had no part in choosing it, and are enough for an interval.
    pub confirmed: bool,
    /// Eqs. (5) to (10), in the paper's order; empty where no seed has all six.
    pub regressions: Vec<Regression>,
    /// Root mean square of ln(slope / paper's slope) over the six: 0.1 is 10 %. None where a slope is not positive.
    pub slope_distance: Option<f64>,
    /// Its interval, of a confirmed point.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slope_distance_95: Option<[f64; 2]>,
    /// The least of R² minus the paper's.
    pub r2_lead: Option<f64>,
    /// Slopes of I_L and I_3L from beside over those from above, and of I_T; the paper has 1.78, 1.95, 1.30.
    pub lateral_over_zenith: Option<[f64; 3]>,
    /// Median over seeds of the middle orchard's leaf area, m².
    pub leaf_area_m2: Option<f64>,
    /// Median over seeds of the greatest leaf area over the least.
    pub leaf_area_max_over_min: Option<f64>,
    /// Share of the seeds at which each gate holds in all views and areas.
    pub gates: Vec<(Rule, f64)>,
}

/// A regression by its medians, in the paper's form; with intervals of the medians for a confirmed point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Regression {
    /// The paper's equation.
    pub equation: u8,
    /// m² of leaf a m² impacted.
    pub slope: f64,
    /// Its interval.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slope_95: Option<[f64; 2]>,
    /// m²; 0 where the line goes through the origin.
    pub intercept_m2: f64,
    /// Its interval, for a line with an intercept.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub intercept_m2_95: Option<[f64; 2]>,
    /// Slope of the line with an intercept, whatever the paper's form.
    pub slope_free: f64,
    /// Its intercept, m².
    pub intercept_free_m2: f64,
    /// Its interval.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub intercept_free_m2_95: Option<[f64; 2]>,
    /// Centred R².
    pub r2: f64,
    /// Its interval.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub r2_95: Option<[f64; 2]>,
    /// Leave-one-out error over the mean leaf area.
    pub loo_rmse_relative: f64,
    /// Exponent of the power law.
    pub power: f64,
    /// Its interval.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub power_95: Option<[f64; 2]>,
}

/// Reports on a whole search.
pub fn report(provenance: Header<SearchStudy>, units: &[Unit<Tried>]) -> SearchReport {
    let search = &provenance.settings;
    let points = units.chunks(search.seeds.len().max(1)).enumerate();
    let points = points.map(|(point, units)| PointReport::of(search, point, units)).collect();
    SearchReport { provenance, paper: &PAPER, points }
}

impl SearchReport {
    /// Points in the order of their distance from the paper's slopes, the nearest first; those without a distance are left out.
    pub fn nearest(&self) -> Vec<&PointReport> {
        let mut points: Vec<_> = self.points.iter().filter(|point| point.slope_distance.is_some()).collect();
        points.sort_by(|a, b| {
            let distance = |point: &PointReport| point.slope_distance.unwrap_or(f64::INFINITY);
            distance(a).total_cmp(&distance(b))
        });
        points
    }
}

impl PointReport {
    /// The point on seeds that it was not chosen by.
    pub(super) fn confirmed(search: &SearchStudy, point: usize, units: &[Unit<Tried>]) -> Self {
        let mut report = Self::of(search, point, units);
        let tried = || units.iter().map(|unit| &unit.result).filter(|tried| tried.refused.is_none());
        let found: Vec<[View; 2]> = tried().map(|tried| views(&tried.orchards).into()).collect();
        if found.len() < LEAST_SEEDS {
            return report;
        }
        report.confirmed = true;
        if !search.base.is_of_paper() {
            report.gates.clear();
            (report.slope_distance, report.r2_lead) = (None, None);
        }
        let fits: Option<Vec<Vec<Fit>>> = PAPER.iter().map(|paper| fits_of(paper, &found)).collect();
        let Some(fits) = fits else { return report };
        let draws = Draws::new(search.base.scene.seed, point, found.len());
        for (own, fits) in report.regressions.iter_mut().zip(&fits) {
            own.widen(fits, &draws);
        }
        report.slope_distance_95 = draws.interval(|draw| {
            let slope = |fits: &Vec<Fit>| median(drawn(fits, draw).map(|fit| fit.slope).collect());
            report.slope_distance.and(slope_distance(&fits.iter().map(slope).collect::<Option<Vec<f64>>>()?))
        });
        report
    }

    fn of(search: &SearchStudy, point: usize, units: &[Unit<Tried>]) -> Self {
        let tried = || units.iter().map(|unit| &unit.result).filter(|tried| tried.refused.is_none());
        let found: Vec<[View; 2]> = tried().map(|tried| views(&tried.orchards).into()).collect();
        let gates: Vec<Vec<Gate>> = tried()
            .zip(&found)
            .map(|(tried, [lateral, zenith])| gates(&tried.orchards, [lateral, zenith]))
            .collect();
        let held = |rule: Rule| {
            let holds =
                |gates: &&Vec<Gate>| gates.iter().filter(|gate| gate.rule == rule).all(|gate| gate.holds);
            (rule, gates.iter().filter(holds).count() as f64 / gates.len().max(1) as f64)
        };
        let spread = gates.iter().flatten().filter(|gate| gate.rule == Rule::Spread);
        let middle = tried()
            .filter_map(|tried| median(tried.orchards.iter().map(|orchard| orchard.leaf_area_m2).collect()));
        let regressions: Vec<Regression> =
            PAPER.iter().filter_map(|paper| Regression::of(paper, &found)).collect();
        let regressions = if regressions.len() == PAPER.len() { regressions } else { Vec::new() };
        Self {
            point,
            single: search.is_single(point),
            settings: search
                .settings(point)
                .into_iter()
                .map(|(key, value)| (key.to_owned(), serde_json::to_value(value).unwrap_or_default()))
                .collect(),
            seeds: found.len(),
            refused: units.iter().find_map(|unit| unit.result.refused.clone()),
            confirmed: false,
            slope_distance: slope_distance(&regressions.iter().map(|own| own.slope).collect::<Vec<_>>()),
            slope_distance_95: None,
            r2_lead: regressions
                .iter()
                .zip(&PAPER)
                .map(|(own, paper)| own.r2 - paper.r2)
                .min_by(f64::total_cmp),
            lateral_over_zenith: match regressions.as_slice() {
                [leaf, total, three, leaf_above, total_above, three_above] => Some([
                    leaf.slope / leaf_above.slope,
                    total.slope / total_above.slope,
                    three.slope / three_above.slope,
                ]),
                _ => None,
            },
            leaf_area_m2: median(middle.collect()),
            leaf_area_max_over_min: median(spread.filter_map(|gate| gate.found).collect()),
            gates: if gates.is_empty() { Vec::new() } else { Rule::ALL.map(held).to_vec() },
            regressions,
        }
    }
}

/// The fits of one of the paper's equations, by seed; None where a seed has none.
fn fits_of(paper: &PaperRegression, found: &[[View; 2]]) -> Option<Vec<Fit>> {
    let fit = |[lateral, zenith]: &[View; 2]| -> Option<Fit> {
        let view = if paper.view == Side::Lateral { lateral } else { zenith };
        match paper.area {
            ImpactedArea::Leaf => view.leaf.clone(),
            ImpactedArea::Total => view.total.clone(),
            ImpactedArea::ThreeLeaves => view.three_leaves.clone(),
        }
    };
    found.iter().map(fit).collect()
}

/// The fits of drawn seeds.
fn drawn<'a>(fits: &'a [Fit], draw: &'a [usize]) -> impl Iterator<Item = &'a Fit> {
    draw.iter().filter_map(|seed| fits.get(*seed))
}

impl Regression {
    fn of(paper: &PaperRegression, found: &[[View; 2]]) -> Option<Self> {
        let fits = fits_of(paper, found)?;
        let middle = |value: fn(&Fit) -> f64| median(fits.iter().map(value).collect());
        Some(Self {
            equation: paper.equation,
            slope: middle(|fit| fit.slope)?,
            slope_95: None,
            intercept_m2: middle(|fit| fit.intercept_m2.unwrap_or(0.0))?,
            intercept_m2_95: None,
            slope_free: middle(|fit| fit.slope_free)?,
            intercept_free_m2: middle(|fit| fit.intercept_free_m2)?,
            intercept_free_m2_95: None,
            r2: middle(|fit| fit.r2)?,
            r2_95: None,
            loo_rmse_relative: middle(|fit| fit.loo_rmse_relative)?,
            power: middle(power)?,
            power_95: None,
        })
    }

    /// Adds the intervals.
    fn widen(&mut self, fits: &[Fit], draws: &Draws) {
        let of =
            |value: fn(&Fit) -> f64| draws.interval(|draw| median(drawn(fits, draw).map(value).collect()));
        self.slope_95 = of(|fit| fit.slope);
        let free = fits.iter().all(|fit| fit.intercept_m2.is_some());
        self.intercept_m2_95 = of(|fit| fit.intercept_m2.unwrap_or(0.0)).filter(|_| free);
        self.intercept_free_m2_95 = of(|fit| fit.intercept_free_m2);
        self.r2_95 = of(|fit| fit.r2);
        self.power_95 = of(power);
    }
}

fn power(fit: &Fit) -> f64 {
    fit.power.map_or(f64::NAN, |power| power.p)
}

/// Of six slopes, in the paper's order.
fn slope_distance(slopes: &[f64]) -> Option<f64> {
    if slopes.is_empty() || slopes.iter().any(|slope| *slope <= 0.0) {
        return None;
    }
    let squares = slopes.iter().zip(&PAPER).map(|(slope, paper)| (slope / paper.slope).ln().powi(2));
    Some((squares.sum::<f64>() / slopes.len() as f64).sqrt())
}
