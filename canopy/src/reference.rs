//! The paper's six regressions, eqs. (5) to (10), for comparison. Never an estimator: they hold for its own simulated
//! orchards of an unknown number of trees, and I_L and I_3L need leaf labels that no scanner gives.

use serde::Serialize;

/// One of the paper's regressions: L_A = slope · I + intercept.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PaperRegression {
    /// Equation number.
    pub equation: u8,
    /// Where the scanner stood.
    pub view: View,
    /// The impacted area regressed on.
    pub area: ImpactedArea,
    /// m² of leaf a m² impacted.
    pub slope: f64,
    /// m² an orchard (the paper prints dm²); 0 where the line goes through the origin.
    pub intercept_m2: f64,
    /// As printed; the paper does not say whether centred.
    pub r2: f64,
}

/// Where the paper's scanner stood.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum View {
    /// Beside the row, angular sweep.
    Lateral,
    /// Above the row, parallel beams.
    Zenith,
}

/// The paper's impacted areas.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum ImpactedArea {
    /// I_L: first hits on leaves.
    #[serde(rename = "I_L")]
    Leaf,
    /// I_T: first hits on leaves or wood.
    #[serde(rename = "I_T")]
    Total,
    /// I_3L: the first three leaves of a beam.
    #[serde(rename = "I_3L")]
    ThreeLeaves,
}

/// Equations (5) to (10), from 20 orchards each.
pub static PAPER: [PaperRegression; 6] = [
    line(5, View::Lateral, ImpactedArea::Leaf, 12.67, 0.0, 0.95),
    line(6, View::Lateral, ImpactedArea::Total, 8.70, -2.0915, 0.94),
    line(7, View::Lateral, ImpactedArea::ThreeLeaves, 6.40, 0.0, 0.97),
    line(8, View::Zenith, ImpactedArea::Leaf, 7.10, 0.0, 0.97),
    line(9, View::Zenith, ImpactedArea::Total, 6.71, -1.2984, 0.96),
    line(10, View::Zenith, ImpactedArea::ThreeLeaves, 3.29, 0.0, 0.99),
];

const fn line(
    equation: u8,
    view: View,
    area: ImpactedArea,
    slope: f64,
    intercept_m2: f64,
    r2: f64,
) -> PaperRegression {
    PaperRegression { equation, view, area, slope, intercept_m2, r2 }
}

impl PaperRegression {
    /// Leaf area, m², the paper's line gives for an orchard's impacted area, m².
    pub fn leaf_area_m2(&self, impacted_m2: f64) -> f64 {
        self.slope * impacted_m2 + self.intercept_m2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bare_tree_has_the_impacted_area_the_paper_implies() {
        // Where L_A = 0: 24.0 dm² lateral, 19.4 dm² zenith (the paper's eqs. 6 and 9 solved).
        let bare = |r: &PaperRegression| -r.intercept_m2 / r.slope;
        let [_, lateral, _, _, zenith, _] = &PAPER;
        assert!((bare(lateral) - 0.240).abs() < 5e-4, "{}", bare(lateral));
        assert!((bare(zenith) - 0.194).abs() < 5e-4, "{}", bare(zenith));
        assert_eq!(lateral.leaf_area_m2(0.0), -2.0915);
    }
}
