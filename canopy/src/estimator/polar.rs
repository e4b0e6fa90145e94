//! Leaf area density in polar cells about the scanner, after Walklate et al. (2002): a = −ln(1 − n/N) / (G Δr), N beams entering, n ending.
//!
//! Small samples: −ln((N − n + ½) / (N + ½)), which is free of bias to the first order in 1/N and finite where every beam ends; the
//! half look is a half patch where leaves are wider than the beams are apart. Cells that too few beams entered hold nothing: behind
//! a dense crown's near half the estimate is low, and `occlusion` says how much was not seen.

use super::contract::{Estimator, EstimatorInfo, Setting, SightedLine, Slice, Stretch};
use super::measure::{Measure, Quantity};
use super::polar_cells::{PolarCells, PolarSums};

pub(super) const INFO: EstimatorInfo = EstimatorInfo {
    name: "polar",
    title: "leaf area in polar cells about the scanner by Beer and Lambert's law, misses used; G given, nothing added behind the crown",
    source: "Walklate et al. 2002, Biosyst. Eng. 82:253 (form derived; half-look correction as in binomial logits)",
    quantities: &[Quantity::LeafArea, Quantity::Lai, Quantity::Saturated],
    make: |setting| Box::new(PolarDensity::new(setting)),
};

#[derive(Clone, Debug)]
struct PolarDensity {
    projection: f64,
    cells: PolarCells,
    sums: PolarSums,
}

impl PolarDensity {
    fn new(setting: &Setting) -> Self {
        Self {
            projection: setting.parameters.projection,
            cells: PolarCells::new(setting),
            sums: PolarSums::default(),
        }
    }
}

impl Estimator for PolarDensity {
    fn line(&mut self, line: &SightedLine<'_>) {
        self.cells.line(line);
    }

    fn slice(&mut self, _slice: &Slice<'_>) {
        self.sums += self.cells.slice();
    }

    fn measures(&self, stretch: &Stretch, out: &mut Vec<Measure>) {
        let mut sums = self.sums;
        sums += self.cells.open();
        let leaf_m2 = sums.projected_m2 / self.projection;
        let of = |quantity, value| Measure::new(INFO.name, quantity, value);
        out.push(of(Quantity::LeafArea, (stretch.scanned_m > 0.0).then_some(leaf_m2)));
        out.extend(stretch.ground_m2.map(|ground_m2| of(Quantity::Lai, Some(leaf_m2 / ground_m2))));
        out.push(of(Quantity::Saturated, Some(sums.saturated as f64 / sums.entered as f64)));
    }

    fn clear(&mut self) {
        self.cells.close();
        self.sums = PolarSums::default();
    }

    fn boxed(&self) -> Box<dyn Estimator> {
        Box::new(self.clone())
    }
}
