//! The list of estimators.

use super::contract::EstimatorInfo;
use super::{gap, height, impacted, lwa, occlusion, polar, porosity, tai, trv, volume, voxel, width};

/// Every estimator. To add one: its file, its line here.
pub static TABLE: &[EstimatorInfo] = &[
    voxel::INFO,
    polar::INFO,
    tai::INFO,
    gap::INFO,
    porosity::INFO,
    impacted::INFO,
    height::INFO,
    width::INFO,
    volume::INFO,
    trv::INFO,
    lwa::INFO,
    occlusion::INFO,
];

/// The estimator of that name.
pub fn by_name(name: &str) -> Option<&'static EstimatorInfo> {
    TABLE.iter().find(|info| info.name == name)
}
