//! How well what was sprayed fits what was wanted, in a few numbers.

use serde::{Deserialize, Serialize};

use crate::flow::Flow;
use crate::leaves::Area;
use crate::pass::Pass;
use crate::span::total;

/// A share of the litres that is none.
const ROUNDING: f64 = 1e-12;

/// A machine that gives less of what was commanded has sprayed nothing.
const LEAST_SPRAYED: f64 = 0.01;

/// A run's scores. What cannot be told is none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Score {
    /// Share of the wanted leaf area that passed before an open nozzle; none where no leaf passed.
    pub recall: Option<f64>,
    /// Litres while the nozzle was not wanted, as a share of all; none where nothing was sprayed, or less than a hundredth of what a sound machine would.
    pub waste: Option<f64>,
    /// `recall` × (1 − `waste`); 0 where nothing was sprayed and something was wanted.
    pub score: Option<f64>,
    /// All that was sprayed.
    pub litres: f64,
    /// What of it while the nozzle was not wanted.
    pub wasted_litres: f64,
    /// What all nozzles at full flow would have sprayed while the tractor went ahead in its alleys.
    pub constant_litres: f64,
    /// `constant_litres` less what a sound machine would spray for the same commands: what does not come out of a broken one is not saved. None where no command was
    /// heard, and where leaves were wanted and no valve was told to open: such a controller has saved nothing.
    pub saved_litres: Option<f64>,
    /// Leaf area that passed before the nozzles while they were wanted, one-sided, m².
    pub wanted_area_m2: f64,
    /// What of it passed before a shut nozzle, m².
    pub missed_area_m2: f64,
    /// What of `wanted_area_m2` is the row's own trees. A row of one alley is driven as if it repeated before its beginning and behind its end; the rest is of
    /// these repetitions.
    pub row_area_m2: f64,
    /// What of `missed_area_m2` is the row's own trees.
    pub row_missed_area_m2: f64,
    /// `recall` of the row's own trees; none where none of their leaves passed.
    pub row_recall: Option<f64>,
}

impl Score {
    /// The same of valves that were told nothing: how well they did is unknown.
    pub fn unheard(self) -> Self {
        Self { recall: None, waste: None, score: None, saved_litres: None, row_recall: None, ..self }
    }

    /// The same of a machine that may not have been sound: beside `commanded`, one a nozzle, which a sound one gives for the same commands.
    #[must_use]
    pub fn beside_sound(self, commanded: &[Flow]) -> Self {
        let litres = total(commanded.iter().map(Flow::litres));
        let is_idle = litres <= 0.0 && self.wanted_area_m2 > 0.0;
        // What hoses give behind a dead pump, and drips, is no spraying of which a share could be wasted.
        let is_sprayed = self.litres > LEAST_SPRAYED * litres;
        Self {
            saved_litres: (!is_idle).then_some(self.constant_litres - litres),
            waste: self.waste.filter(|_| is_sprayed),
            ..self
        }
    }

    /// Of what `flows`, one a nozzle, did on a pass.
    pub fn of(pass: &Pass, flows: &[Flow]) -> Self {
        let (mut litres, mut wasted, mut full_l_s) = (0.0, 0.0, 0.0);
        let (mut wanted_area, mut hit) = (Area::default(), Area::default());
        for ((nozzle, flow), wanted) in pass.nozzles().iter().zip(flows).zip(pass.wanted()) {
            litres += flow.litres();
            wasted += flow.litres_in(&wanted.gaps(pass.time()));
            wanted_area += pass.area(nozzle.number, wanted);
            hit += pass.area(nozzle.number, &wanted.and(&flow.open));
            full_l_s += nozzle.flow_l_s;
        }
        // What rounding leaves where an edge is wanted when it comes.
        let wasted = if wasted < ROUNDING * litres { 0.0 } else { wasted };
        let constant_litres = full_l_s * pass.drive().going(pass.boom().standstill_m_s).length();
        let share = |hit_m2: f64, of_m2: f64| (of_m2 > 0.0).then(|| (hit_m2 / of_m2).clamp(0.0, 1.0));
        let recall = share(hit.all_m2, wanted_area.all_m2);
        let waste = (litres > 0.0).then(|| (wasted / litres).clamp(0.0, 1.0));
        Self {
            recall,
            waste,
            score: recall.map(|recall| recall * (1.0 - waste.unwrap_or(0.0))),
            litres,
            wasted_litres: wasted,
            constant_litres,
            saved_litres: Some(constant_litres - litres),
            wanted_area_m2: wanted_area.all_m2,
            missed_area_m2: (wanted_area.all_m2 - hit.all_m2).max(0.0),
            row_area_m2: wanted_area.own_m2,
            row_missed_area_m2: (wanted_area.own_m2 - hit.own_m2).max(0.0),
            row_recall: share(hit.own_m2, wanted_area.own_m2),
        }
    }
}
