//! The list of estimators.

use super::contract::EstimatorInfo;
use super::reported::REPORTED;
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

/// That name, as tables hold it, if it is one of an estimator or of what every estimate holds.
pub fn name_of(name: &str) -> Option<&'static str> {
    let held = REPORTED.iter().map(|(held, _)| *held).find(|held| *held == name);
    held.or_else(|| by_name(name).map(|info| info.name))
}
