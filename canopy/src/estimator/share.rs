//! Leaf area density voxel by voxel, each hit counted by the share of the spot that came back.
//!
//! Share is linear: averaged over places, the share of a spot on leaves is how often a ray would meet one, whatever spot and clumping. What a leaf
//! leaves of the spot goes on within the pulse. It needs remission that tells power ([`RemissionScale`](crate::RemissionScale)); without, it tells nothing.

use super::contract::{Estimator, EstimatorInfo, Setting, Slice, Stretch};
use super::measure::{Measure, Quantity};

pub(super) const INFO: EstimatorInfo = EstimatorInfo {
    name: "share",
    title: "leaf area density in voxels by the shares of spots that remission tells, misses used; G given",
    source: "Schraik et al. 2021, Silva Fennica 55:10533",
    quantities: &[Quantity::LeafArea, Quantity::Lai],
    make: |setting| Box::new(Share::new(setting)),
};

#[derive(Clone, Debug)]
struct Share {
    /// None where remission is not read.
    leaf_m2: Option<f64>,
}

impl Share {
    fn new(setting: &Setting) -> Self {
        Self { leaf_m2: setting.parameters.remission.map(|_| 0.0) }
    }
}

impl Estimator for Share {
    fn slice(&mut self, slice: &Slice<'_>) {
        if let Some(leaf_m2) = &mut self.leaf_m2 {
            *leaf_m2 += slice.voxels.share_leaf_area_m2();
        }
    }

    fn measures(&self, stretch: &Stretch, out: &mut Vec<Measure>) {
        let of = |quantity, value| Measure::new(INFO.name, quantity, value);
        let leaf_m2 = self.leaf_m2.filter(|_| stretch.scanned_m > 0.0);
        out.push(of(Quantity::LeafArea, leaf_m2));
        if let Some(ground_m2) = stretch.ground_m2 {
            out.push(of(Quantity::Lai, leaf_m2.map(|leaf_m2| leaf_m2 / ground_m2)));
        }
    }

    fn clear(&mut self) {
        self.leaf_m2 = self.leaf_m2.map(|_| 0.0);
    }

    fn boxed(&self) -> Box<dyn Estimator> {
        Box::new(self.clone())
    }
}
