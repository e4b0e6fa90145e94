//! The six regressions, beside the paper's.

use serde::Serialize;

use super::fits::{View, max_over_min, views};
use super::gates::{Gate, gates};
use super::{AreasStudy, Orchard};
use crate::{Header, Unit};

/// What the study found. Areas in m², slopes in m² of leaf a m² impacted.
#[derive(Clone, Debug, Serialize)]
pub struct AreasReport {
    /// Version, seed, scene, settings.
    pub provenance: Header<AreasStudy>,
    /// Largest leaf area over smallest: a regression's R² grows with it.
    pub leaf_area_max_over_min: f64,
    /// What the paper's orchards should hold, and whether they do; nothing of other orchards.
    pub gates: Vec<Gate>,
    /// From beside the row.
    pub lateral: View,
    /// From above.
    pub zenith: View,
    /// Every orchard.
    pub orchards: Vec<Orchard>,
}

/// Regresses a whole study.
pub fn report(provenance: Header<AreasStudy>, units: Vec<Unit<Orchard>>) -> AreasReport {
    let orchards: Vec<Orchard> = units.into_iter().map(|unit| unit.result).collect();
    let (lateral, zenith) = views(&orchards);
    let of_paper = provenance.settings.is_of_paper();
    let gates = if of_paper { gates(&orchards, [&lateral, &zenith]) } else { Vec::new() };
    let [lateral, zenith] = [lateral, zenith].map(|view| if of_paper { view } else { view.without_paper() });
    AreasReport {
        provenance,
        leaf_area_max_over_min: max_over_min(&orchards),
        gates,
        lateral,
        zenith,
        orchards,
    }
}
