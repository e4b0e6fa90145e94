//! Gap fraction per height band at the row plane, and the leaf area it means by Beer and Lambert's law.
//!
//! P = beams let through / beams fired: ground, next row and escapes have passed the canopy. A band's leaf area is
//! −ln(P) · mean cos θ / G over its face (band height × length), with the whole crown one even slab: clumped leaves are underestimated.
//! The interval is Wilson's, on beams divided by hits a patch.

use super::bands::{Bands, wilson};
use super::contract::{Estimator, EstimatorInfo, Setting, SightedLine, Stretch};
use super::measure::{Measure, Quantity};
use crate::parameters::Parameters;

pub(super) const INFO: EstimatorInfo = EstimatorInfo {
    name: "gap",
    title: "gap fraction per height band at the row plane, and leaf area by Beer and Lambert's law as if the crown were even; G given",
    source: "Beer–Lambert after Monsi & Saeki 1953; interval: Wilson 1927",
    quantities: &[Quantity::GapFraction, Quantity::LeafArea, Quantity::Lai],
    make: |setting| Box::new(GapFraction::new(setting)),
};

/// Height of a band, metres.
const BAND_M: f64 = 0.5;

#[derive(Clone, Debug)]
struct GapFraction {
    parameters: Parameters,
    distance_m: f64,
    bands: Bands,
}

impl GapFraction {
    fn new(setting: &Setting) -> Self {
        let bands = Bands::new(setting, BAND_M);
        Self { parameters: setting.parameters, distance_m: setting.frame.distance_m, bands }
    }
}

impl Estimator for GapFraction {
    fn line(&mut self, line: &SightedLine<'_>) {
        self.bands.line(line);
    }

    fn measures(&self, stretch: &Stretch, out: &mut Vec<Measure>) {
        let correlated = self.bands.hits_per_patch();
        let of = |quantity, value| Measure::new(INFO.name, quantity, value);
        let at = out.len();
        let mut leaf_m2 = 0.0;
        for (edges_m, band) in self.bands.iter().filter(|(_, band)| band.beams > 0) {
            let share = band.through / band.fired;
            let looks = (band.beams as f64 / correlated).max(1.0);
            let gap = of(Quantity::GapFraction, Some(share)).within(wilson(share, looks));
            out.push(gap.of_band(edges_m));
            // As in polar cells: half a look keeps a band without any gap finite.
            let passed = (share * looks + 0.5) / (looks + 0.5);
            let face_m2 = (edges_m[1] - edges_m[0]) * stretch.scanned_m;
            let cosine = band.cosine / band.fired;
            let per_leaf = self.parameters.projection * self.parameters.inflation(self.distance_m / cosine);
            leaf_m2 += -passed.ln() * cosine / per_leaf * face_m2;
        }
        let known = (out.len() > at).then_some(leaf_m2);
        out.insert(at, of(Quantity::LeafArea, known));
        if let Some(ground_m2) = stretch.ground_m2 {
            out.insert(at + 1, of(Quantity::Lai, known.map(|leaf_m2| leaf_m2 / ground_m2)));
        }
    }

    fn clear(&mut self) {
        self.bands.clear();
    }

    fn boxed(&self) -> Box<dyn Estimator> {
        Box::new(self.clone())
    }
}
