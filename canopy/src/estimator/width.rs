//! Width percentiles: twice the half width of the side that was scanned.

use super::contract::{Estimator, EstimatorInfo, Setting, SightedLine, Stretch};
use super::measure::{Measure, Quantity};
use crate::percentile::{Histogram, TOP_SHARE};

pub(super) const INFO: EstimatorInfo = EstimatorInfo {
    name: "width",
    title: "twice the 50 and 99.5 % half widths of the returns before the row plane: both sides taken to be alike",
    source: "percentiles",
    quantities: &[Quantity::Width, Quantity::MedianWidth],
    make: |setting| Box::new(Widths::new(setting)),
};

#[derive(Clone, Debug)]
struct Widths(HalfWidths);

impl Widths {
    fn new(setting: &Setting) -> Self {
        Self(HalfWidths::new(setting))
    }
}

/// Distances of canopy returns before the row plane.
#[derive(Clone, Debug)]
pub(super) struct HalfWidths {
    histogram: Histogram,
    distance_m: f64,
}

impl HalfWidths {
    pub(super) fn new(setting: &Setting) -> Self {
        Self { histogram: Histogram::new(), distance_m: setting.frame.distance_m }
    }

    pub(super) fn line(&mut self, line: &SightedLine<'_>) {
        for contact in line.sightings.iter().filter_map(|sighting| sighting.canopy) {
            if contact.x_m <= self.distance_m {
                self.histogram.add(self.distance_m - contact.x_m, line.weight_m);
            }
        }
    }

    /// Twice the half width that a share stays within, metres.
    pub(super) fn width_m(&self, share: f64) -> Option<f64> {
        self.histogram.percentile(share).map(|half_m| 2.0 * half_m)
    }

    pub(super) fn clear(&mut self) {
        self.histogram.clear();
    }
}

impl Estimator for Widths {
    fn line(&mut self, line: &SightedLine<'_>) {
        self.0.line(line);
    }

    fn measures(&self, _stretch: &Stretch, out: &mut Vec<Measure>) {
        let shares = [(Quantity::Width, TOP_SHARE), (Quantity::MedianWidth, 0.5)];
        out.extend(shares.map(|(quantity, share)| Measure::new(INFO.name, quantity, self.0.width_m(share))));
    }

    fn clear(&mut self) {
        self.0.clear();
    }

    fn boxed(&self) -> Box<dyn Estimator> {
        Box::new(self.clone())
    }
}
