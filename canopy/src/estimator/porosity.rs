//! Optical porosity: the share of beams that pass through the crown between its base and its top, as seen from the scanner.

use super::bands::{Band, Bands, wilson};
use super::contract::{Estimator, EstimatorInfo, Setting, SightedLine, Stretch};
use super::measure::{Measure, Quantity};
use crate::percentile::{BASE_SHARE, Histogram, TOP_SHARE};

pub(super) const INFO: EstimatorInfo = EstimatorInfo {
    name: "porosity",
    title: "share of the beams through the crown, from its 1 % height to its 99.5 % height at the row plane, that pass",
    source: "gap fraction over the crown's height (SCAN-type porosity, Arnó et al. 2013); interval: Wilson 1927",
    quantities: &[Quantity::Porosity],
    make: |setting| Box::new(Porosity::new(setting)),
};

/// Height of a band, metres: how finely base and top cut.
const BAND_M: f64 = 0.1;

#[derive(Clone, Debug)]
struct Porosity {
    bands: Bands,
    heights: Histogram,
}

impl Porosity {
    fn new(setting: &Setting) -> Self {
        Self { bands: Bands::new(setting, BAND_M), heights: Histogram::new() }
    }
}

impl Estimator for Porosity {
    fn line(&mut self, line: &SightedLine<'_>) {
        self.bands.line(line);
        for contact in line.sightings.iter().filter_map(|sighting| sighting.canopy) {
            self.heights.add(contact.z_m, line.weight_m);
        }
    }

    fn measures(&self, _stretch: &Stretch, out: &mut Vec<Measure>) {
        let crown_m = self.heights.percentile(BASE_SHARE).zip(self.heights.percentile(TOP_SHARE));
        let crown = crown_m.map(|(base_m, top_m)| {
            let middle = |edges_m: [f64; 2]| (edges_m[0] + edges_m[1]) / 2.0;
            let inside =
                self.bands.iter().filter(|(edges_m, _)| (base_m..=top_m).contains(&middle(*edges_m)));
            inside.fold(Band::default(), |sum, (_, band)| Band {
                fired: sum.fired + band.fired,
                through: sum.through + band.through,
                beams: sum.beams + band.beams,
                ..sum
            })
        });
        let crown = crown.filter(|crown| crown.beams > 0);
        let share = crown.map(|crown| crown.through / crown.fired);
        let looks = crown.map_or(1.0, |crown| (crown.beams as f64 / self.bands.hits_per_patch()).max(1.0));
        let ends = wilson(share.unwrap_or(0.0), looks);
        out.push(Measure::new(INFO.name, Quantity::Porosity, share).within(ends));
    }

    fn clear(&mut self) {
        self.bands.clear();
        self.heights.clear();
    }

    fn boxed(&self) -> Box<dyn Estimator> {
        Box::new(self.clone())
    }
}
