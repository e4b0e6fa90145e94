//! Tree area index: the area the canopy turns towards the beams over the ground it stands on, Σ a_jk r_k Δr Δθ / s with G = 1
//! (Walklate et al. 2002). Half the leaf area index where leaves are turned any way.

use super::contract::{Estimator, EstimatorInfo, SightedLine, Slice, Stretch};
use super::measure::{Measure, Quantity};
use super::polar_cells::{PolarCells, PolarSums};

pub(super) const INFO: EstimatorInfo = EstimatorInfo {
    name: "tai",
    title: "tree area index: polar cells with G = 1, over the ground",
    source: "Walklate et al. 2002, Biosyst. Eng. 82:253; Arnó et al. 2013, Precis. Agric. 14:290",
    quantities: &[Quantity::TreeAreaIndex],
    make: |setting| Box::new(TreeAreaIndex { cells: PolarCells::new(setting), sums: PolarSums::default() }),
};

#[derive(Clone, Debug)]
struct TreeAreaIndex {
    cells: PolarCells,
    sums: PolarSums,
}

impl Estimator for TreeAreaIndex {
    fn line(&mut self, line: &SightedLine<'_>) {
        self.cells.line(line);
    }

    fn slice(&mut self, _slice: &Slice<'_>) {
        self.sums += self.cells.slice();
    }

    fn measures(&self, stretch: &Stretch, out: &mut Vec<Measure>) {
        let projected_m2 = self.sums.projected_m2 + self.cells.open().projected_m2;
        let index = stretch.ground_m2.map(|ground_m2| projected_m2 / ground_m2);
        out.push(Measure::new(INFO.name, Quantity::TreeAreaIndex, index));
    }

    fn clear(&mut self) {
        self.cells.close();
        self.sums = PolarSums::default();
    }

    fn boxed(&self) -> Box<dyn Estimator> {
        Box::new(self.clone())
    }
}
