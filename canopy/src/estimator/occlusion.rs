//! What was not seen: voxels hidden behind others, and voxels no beam leads to. Every density rests on the rest.

use super::contract::{Estimator, EstimatorInfo, Slice, Stretch};
use super::measure::{Measure, Quantity};
use crate::voxels::Unseen;

pub(super) const INFO: EstimatorInfo = EstimatorInfo {
    name: "occlusion",
    title: "shares of the voxel region that were hidden, and that no beam leads to",
    source: "Béland et al. 2014, Agric. For. Meteorol. 184:82",
    quantities: &[Quantity::Occluded, Quantity::NeverVisited],
    make: |_| Box::new(Occlusion::default()),
};

#[derive(Clone, Debug, Default)]
struct Occlusion {
    unseen: Unseen,
}

impl Estimator for Occlusion {
    fn slice(&mut self, slice: &Slice<'_>) {
        let Unseen { of, occluded, never_visited } = slice.voxels.unseen();
        self.unseen.of += of;
        self.unseen.occluded += occluded;
        self.unseen.never_visited += never_visited;
    }

    fn measures(&self, _stretch: &Stretch, out: &mut Vec<Measure>) {
        let share = |count: u64| Some(count as f64 / self.unseen.of as f64);
        out.push(Measure::new(INFO.name, Quantity::Occluded, share(self.unseen.occluded)));
        out.push(Measure::new(INFO.name, Quantity::NeverVisited, share(self.unseen.never_visited)));
    }

    fn clear(&mut self) {
        self.unseen = Unseen::default();
    }

    fn boxed(&self) -> Box<dyn Estimator> {
        Box::new(self.clone())
    }
}
