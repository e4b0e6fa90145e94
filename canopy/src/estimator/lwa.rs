//! Leaf wall area: 2 × canopy height × 10⁴ / row spacing, m²/ha, both faces; canopy height is top less base, section by section, so that
//! gaps in the row count as no wall.

use super::contract::{Estimator, EstimatorInfo, Stretch};
use super::measure::{Measure, Quantity};
use super::trv::HECTARE_M2;
use crate::profile::Section;

pub(super) const INFO: EstimatorInfo = EstimatorInfo {
    name: "lwa",
    title: "leaf wall area: twice the mean height of the canopy, from lowest to highest return per 0.1 m of row, over row spacing",
    source: "EPPO PP 1/239 (3)",
    quantities: &[Quantity::LeafWallArea],
    make: |setting| Box::new(LeafWall { wall_m2: 0.0, row_spacing_m: setting.row_spacing_m }),
};

#[derive(Clone, Debug)]
struct LeafWall {
    /// One face, m².
    wall_m2: f64,
    row_spacing_m: Option<f64>,
}

impl Estimator for LeafWall {
    fn section(&mut self, section: &Section<'_>) {
        let [base_m, top_m] = section.extent_m().unwrap_or_default();
        self.wall_m2 += (top_m - base_m) * section.length_m;
    }

    fn measures(&self, stretch: &Stretch, out: &mut Vec<Measure>) {
        let per_metre_m = self.wall_m2 / stretch.scanned_m;
        let m2_ha = self.row_spacing_m.map(|spacing_m| 2.0 * per_metre_m * HECTARE_M2 / spacing_m);
        out.push(Measure::new(INFO.name, Quantity::LeafWallArea, m2_ha));
    }

    fn clear(&mut self) {
        self.wall_m2 = 0.0;
    }

    fn boxed(&self) -> Box<dyn Estimator> {
        Box::new(self.clone())
    }
}
