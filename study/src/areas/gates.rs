//! What twenty such orchards should hold, and whether these do. A gate that does not hold is reported, not moved.
//!
//! Limits: spread and R² are those a probe with another program allowed for; the leave-one-out error is what the first of our own runs
//! held for I_3L, asked of all; the bend's is the 1 % point of Student's t with 17 degrees of freedom.

use std::fmt;

use rowscan_canopy::reference::{ImpactedArea, View as Side};
use serde::{Deserialize, Serialize};

use super::Orchard;
use super::fits::{Fit, View, max_over_min, symbol};

/// Kinds of gates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Rule {
    /// Largest leaf area over smallest: at least 8, or R² says nothing.
    Spread,
    /// Centred R² of the paper's form: at least 0.85 for I_L, 0.80 for I_T, 0.93 for I_3L.
    R2,
    /// Centred R² through the origin: I_3L not below I_L, I_L not below I_T. Given is the least lead.
    R2Order,
    /// Slopes through the origin: I_L above I_T above I_3L. Given is the least ratio.
    SlopeOrder,
    /// Leave-one-out error of the paper's form over the mean leaf area: at most 0.45.
    LeaveOneOut,
    /// Student's t of a bend in the power law: between −2.9 and 2.9 (1 % of straight clouds of 20 lie beyond). Given is |t|.
    Bend,
    /// Median leaf area of a number of iterations over that of the number before: above 1. Given is the least.
    Seasons,
}

impl Rule {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Spread,
        Self::R2,
        Self::R2Order,
        Self::SlopeOrder,
        Self::LeaveOneOut,
        Self::Bend,
        Self::Seasons,
    ];

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Spread => "L_A max/min",
            Self::R2 => "R²",
            Self::R2Order => "order of R²",
            Self::SlopeOrder => "order of slopes",
            Self::LeaveOneOut => "leave-one-out",
            Self::Bend => "bend |t| of the power law",
            Self::Seasons => "L_A by season",
        }
    }
}

/// One gate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Gate {
    /// What it asks.
    pub rule: Rule,
    /// Of which view; None for what concerns the orchards alone.
    pub view: Option<Side>,
    /// Of which regression; None for what concerns all of a view.
    pub area: Option<ImpactedArea>,
    /// What these orchards have; None where there is no fit.
    pub found: Option<f64>,
    /// What is asked.
    pub limit: f64,
    /// Whether the limit is a lower one.
    pub at_least: bool,
    /// Whether it holds; what has no value does not.
    pub holds: bool,
}

impl Gate {
    fn new(rule: Rule, place: (Option<Side>, Option<ImpactedArea>), found: Option<f64>, limit: f64) -> Self {
        let at_least = !matches!(rule, Rule::LeaveOneOut | Rule::Bend);
        let holds = found.is_some_and(|found| if at_least { found >= limit } else { found <= limit });
        Self { rule, view: place.0, area: place.1, found, limit, at_least, holds }
    }
}

impl fmt::Display for Gate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.view {
            Some(Side::Lateral) => f.write_str("lateral ")?,
            Some(Side::Zenith) => f.write_str("zenith ")?,
            None => {}
        }
        if let Some(area) = self.area {
            write!(f, "{} ", symbol(area))?;
        }
        f.write_str(self.rule.words())?;
        let relation = if self.at_least { "at least" } else { "at most" };
        match self.found {
            Some(found) => write!(f, " {found:.3} ({relation} {})", self.limit),
            None => write!(f, " unknown ({relation} {})", self.limit),
        }
    }
}

/// All gates of a study: `views` are lateral and zenith.
pub fn gates(orchards: &[Orchard], views: [&View; 2]) -> Vec<Gate> {
    let mut gates = vec![
        Gate::new(Rule::Spread, (None, None), Some(max_over_min(orchards)), 8.0),
        Gate::new(Rule::Seasons, (None, None), least_growth(orchards), 1.0),
    ];
    for (view, side) in views.into_iter().zip([Side::Lateral, Side::Zenith]) {
        let whole = (Some(side), None);
        let ordered = |value: fn(&Fit) -> f64, least: fn([f64; 3]) -> f64| {
            let [leaf, total, three] = view.fits().map(|(_, fit)| fit.map(value));
            Some(least([leaf?, total?, three?]))
        };
        let lead = ordered(|fit| fit.r2_origin, |[leaf, total, three]| (three - leaf).min(leaf - total));
        let ratio = ordered(|fit| fit.slope_origin, |[leaf, total, three]| (leaf / total).min(total / three));
        gates.push(Gate::new(Rule::R2Order, whole, lead, 0.0));
        gates.push(Gate::new(Rule::SlopeOrder, whole, ratio, 1.0));
        for (area, fit) in view.fits() {
            let least_r2 = match area {
                ImpactedArea::Leaf => 0.85,
                ImpactedArea::Total => 0.80,
                ImpactedArea::ThreeLeaves => 0.93,
            };
            let place = (Some(side), Some(area));
            let bend = fit.and_then(|fit| fit.power?.residual_trend_t).map(f64::abs);
            gates.push(Gate::new(Rule::R2, place, fit.map(|fit| fit.r2), least_r2));
            gates.push(Gate::new(Rule::LeaveOneOut, place, fit.map(|fit| fit.loo_rmse_relative), 0.45));
            gates.push(Gate::new(Rule::Bend, place, bend, 2.9));
        }
    }
    gates
}

/// The least ratio of the median leaf areas of two numbers of iterations that follow each other; None where there is one number only.
fn least_growth(orchards: &[Orchard]) -> Option<f64> {
    let mut seasons: Vec<u32> = orchards.iter().map(|orchard| orchard.iterations).collect();
    seasons.sort_unstable();
    seasons.dedup();
    let median = |season: u32| {
        let of_season = orchards.iter().filter(|orchard| orchard.iterations == season);
        crate::median(of_season.map(|orchard| orchard.leaf_area_m2).collect())
    };
    let ratios = seasons.windows(2).filter_map(|pair| match pair {
        [before, after] => Some(median(*after)? / median(*before)?),
        _ => None,
    });
    ratios.min_by(f64::total_cmp)
}
