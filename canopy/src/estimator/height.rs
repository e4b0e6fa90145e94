//! Height percentiles of the canopy returns.

use super::contract::{Estimator, EstimatorInfo, SightedLine, Stretch};
use super::measure::{Measure, Quantity};
use crate::percentile::{BASE_SHARE, Histogram, TOP_SHARE};

pub(super) const INFO: EstimatorInfo = EstimatorInfo {
    name: "height",
    title: "1, 50 and 99.5 % of the canopy returns' heights above ground",
    source: "percentiles; Palacín et al. 2007, IEEE Trans. Instrum. Meas. 56:1377 use the highest return",
    quantities: &[Quantity::Height, Quantity::MedianHeight, Quantity::Base],
    make: |_| Box::new(Heights(Histogram::new())),
};

#[derive(Clone, Debug)]
struct Heights(Histogram);

impl Estimator for Heights {
    fn line(&mut self, line: &SightedLine<'_>) {
        for contact in line.sightings.iter().filter_map(|sighting| sighting.canopy) {
            self.0.add(contact.z_m, line.weight_m);
        }
    }

    fn measures(&self, _stretch: &Stretch, out: &mut Vec<Measure>) {
        let shares =
            [(Quantity::Height, TOP_SHARE), (Quantity::MedianHeight, 0.5), (Quantity::Base, BASE_SHARE)];
        out.extend(
            shares.map(|(quantity, share)| Measure::new(INFO.name, quantity, self.0.percentile(share))),
        );
    }

    fn clear(&mut self) {
        self.0.clear();
    }

    fn boxed(&self) -> Box<dyn Estimator> {
        Box::new(self.clone())
    }
}
