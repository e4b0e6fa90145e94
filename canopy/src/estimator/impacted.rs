//! Impacted area I_T as a beam without width would have found it: the paper's area, times what a ray would have met over what the beam met.
//!
//! In a sector of the scan plane and a stretch of the row a beam of inflation I meets the canopy with p = 1 − exp(−I t), a ray with
//! 1 − exp(−t) = 1 − (1 − p)^(1/I). Where no beam passes nothing is taken off. I is taken at the mean range of the returns.

use super::contract::{Estimator, EstimatorInfo, Setting, SightedLine, Slice, Stretch};
use super::measure::{Measure, Quantity};
use super::polar_cells::{SECTORS, sector};
use crate::parameters::Parameters;

pub(super) const INFO: EstimatorInfo = EstimatorInfo {
    name: "impacted",
    title: "impacted area I_T as a beam without width would find it",
    source: "Méndez et al. 2013, eq. 4; gap probability of a Boolean model (Steiner), derived",
    quantities: &[Quantity::ImpactedArea],
    make: |setting| Box::new(ImpactedArea::new(setting)),
};

#[derive(Clone, Debug)]
struct ImpactedArea {
    parameters: Parameters,
    sectors: Vec<Sector>,
    closed_m2: f64,
}

/// The beams of one sector over one slice.
#[derive(Clone, Copy, Debug, Default)]
struct Sector {
    fired_m: f64,
    hits_m: f64,
    /// Σ weight · range over the hits.
    range_m2: f64,
    area_m2: f64,
}

impl Sector {
    fn area_m2(&self, parameters: &Parameters) -> f64 {
        if self.hits_m <= 0.0 {
            return 0.0;
        }
        let met = (self.hits_m / self.fired_m).min(1.0);
        let by_ray = 1.0 - (1.0 - met).powf(1.0 / parameters.inflation(self.range_m2 / self.hits_m));
        self.area_m2 * by_ray / met
    }
}

impl ImpactedArea {
    fn new(setting: &Setting) -> Self {
        Self { parameters: setting.parameters, sectors: vec![Sector::default(); SECTORS], closed_m2: 0.0 }
    }

    fn open_m2(&self) -> f64 {
        self.sectors.iter().map(|sector| sector.area_m2(&self.parameters)).sum()
    }
}

impl Estimator for ImpactedArea {
    fn line(&mut self, line: &SightedLine<'_>) {
        for sighting in line.sightings {
            let at = sector(sighting.beam.theta_rad);
            let Some(sector) = self.sectors.get_mut(at) else { continue };
            sector.fired_m += line.weight_m;
            if let Some(contact) = sighting.canopy {
                sector.hits_m += line.weight_m;
                sector.range_m2 += line.weight_m * contact.range_m;
                sector.area_m2 += line.weight_m * contact.range_m * sighting.beam.area_factor;
            }
        }
    }

    fn slice(&mut self, _slice: &Slice<'_>) {
        self.closed_m2 += self.open_m2();
        self.sectors.fill(Sector::default());
    }

    fn measures(&self, stretch: &Stretch, out: &mut Vec<Measure>) {
        let known = stretch.scanned_m > 0.0;
        let area_m2 = known.then(|| self.closed_m2 + self.open_m2());
        out.push(Measure::new(INFO.name, Quantity::ImpactedArea, area_m2));
    }

    fn clear(&mut self) {
        self.sectors.fill(Sector::default());
        self.closed_m2 = 0.0;
    }

    fn boxed(&self) -> Box<dyn Estimator> {
        Box::new(self.clone())
    }
}
