//! Crown volume: cross-sections filled from the outermost return to the row plane per 0.1 m of height, doubled, times their length.

use super::contract::{Estimator, EstimatorInfo, Stretch};
use super::measure::{Measure, Quantity};
use crate::profile::Section;

pub(super) const INFO: EstimatorInfo = EstimatorInfo {
    name: "volume",
    title: "volume from the outermost return to the row plane in cells of 0.1 m, doubled: both sides taken to be alike",
    source: "row lidar volume; Sanz et al. 2013, Agric. For. Meteorol. 171:153",
    quantities: &[Quantity::Volume],
    make: |_| Box::new(Volume(0.0)),
};

/// Cubic metres so far.
#[derive(Clone, Debug)]
struct Volume(f64);

impl Estimator for Volume {
    fn section(&mut self, section: &Section<'_>) {
        self.0 += section.volume_m3();
    }

    fn measures(&self, stretch: &Stretch, out: &mut Vec<Measure>) {
        out.push(Measure::new(INFO.name, Quantity::Volume, (stretch.scanned_m > 0.0).then_some(self.0)));
    }

    fn clear(&mut self) {
        self.0 = 0.0;
    }

    fn boxed(&self) -> Box<dyn Estimator> {
        Box::new(self.clone())
    }
}
