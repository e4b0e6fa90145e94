//! Tree row volume: height × width × 10⁴ / row spacing, m³/ha, as growers reckon doses.

use super::contract::{Estimator, EstimatorInfo, Setting, SightedLine, Stretch};
use super::measure::{Measure, Quantity};
use super::width::HalfWidths;
use crate::percentile::{Histogram, TOP_SHARE};

pub(super) const INFO: EstimatorInfo = EstimatorInfo {
    name: "trv",
    title: "tree row volume: 99.5 % height × 99.5 % width over row spacing",
    source: "Byers et al. 1971, HortScience 6:468; Sutton & Unrath 1984",
    quantities: &[Quantity::TreeRowVolume],
    make: |setting| Box::new(TreeRowVolume::new(setting)),
};

/// Square metres in a hectare.
pub(super) const HECTARE_M2: f64 = 10_000.0;

#[derive(Clone, Debug)]
struct TreeRowVolume {
    heights: Histogram,
    widths: HalfWidths,
    row_spacing_m: Option<f64>,
}

impl TreeRowVolume {
    fn new(setting: &Setting) -> Self {
        Self {
            heights: Histogram::new(),
            widths: HalfWidths::new(setting),
            row_spacing_m: setting.row_spacing_m,
        }
    }
}

impl Estimator for TreeRowVolume {
    fn line(&mut self, line: &SightedLine<'_>) {
        self.widths.line(line);
        for contact in line.sightings.iter().filter_map(|sighting| sighting.canopy) {
            self.heights.add(contact.z_m, line.weight_m);
        }
    }

    fn measures(&self, _stretch: &Stretch, out: &mut Vec<Measure>) {
        let area_m2 =
            self.heights.percentile(TOP_SHARE).zip(self.widths.width_m(TOP_SHARE)).map(|(h, w)| h * w);
        let m3_ha =
            area_m2.zip(self.row_spacing_m).map(|(area_m2, spacing_m)| area_m2 * HECTARE_M2 / spacing_m);
        out.push(Measure::new(INFO.name, Quantity::TreeRowVolume, m3_ha));
    }

    fn clear(&mut self) {
        self.heights.clear();
        self.widths.clear();
    }

    fn boxed(&self) -> Box<dyn Estimator> {
        Box::new(self.clone())
    }
}
