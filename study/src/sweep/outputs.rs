//! What a sweep keeps, by name.
//!
//! `ESTIMATOR.QUANTITY` (`voxel.lai`), `error.ESTIMATOR.QUANTITY` (relative to the truth), `truth.QUANTITY`, `estimate.KEY` (a number every
//! estimate holds, `estimate.scans`), `spray.KEY` (of a study with a sprayer, `spray.recall`).

use rowscan_canopy::estimator::{REPORTED, TABLE};
use rowscan_canopy::{Estimate, EstimatorInfo, Measure, Quantity};
use rowscan_scenes::files;
use serde::{Deserialize, Serialize};

use crate::appraisal::{Appraisal, Stretch};

/// One number to keep.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Output {
    name: String,
    kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Measure { estimator: &'static str, quantity: Quantity },
    Error { estimator: &'static str, quantity: Quantity },
    Truth(Quantity),
    Estimate(&'static str),
    Sprayer(&'static str),
}

/// Keys of an estimate that are numbers.
const ESTIMATE_KEYS: &[&str] = &[
    "scans",
    "scans_lost",
    "points_per_scan",
    "scanned_m",
    "impacted_total_area_m2",
    "leaf_area_m2",
    "lai",
    "leaf_area_contact_raw_m2",
    "leaf_area_regression_m2",
];

/// A name that is no output.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "there is no output `{found}`{nearest}; they are ESTIMATOR.QUANTITY, error.ESTIMATOR.QUANTITY, truth.QUANTITY, estimate.KEY, spray.KEY; \
     gaps, porosity and impacted area have a truth in `rowscan study estimators` alone, by a finer scan, and densities and hidden shares have none"
)]
pub struct OutputError {
    found: String,
    nearest: String,
}

/// Every output there is.
fn all() -> impl Iterator<Item = Output> {
    let reported = REPORTED.iter().map(|(name, _)| (*name, Quantity::LeafArea));
    let measured =
        TABLE.iter().flat_map(|info| info.quantities.iter().map(|quantity| (info.name, *quantity)));
    let measures = reported.chain(measured).flat_map(|(estimator, quantity)| {
        let name = format!("{estimator}.{}", quantity.key());
        [
            Output { name: format!("error.{name}"), kind: Kind::Error { estimator, quantity } },
            Output { name, kind: Kind::Measure { estimator, quantity } },
        ]
    });
    let truths = Quantity::ALL
        .iter()
        .map(|quantity| Output { name: format!("truth.{}", quantity.key()), kind: Kind::Truth(*quantity) });
    let keys =
        ESTIMATE_KEYS.iter().map(|key| Output { name: format!("estimate.{key}"), kind: Kind::Estimate(key) });
    let sprayed = super::sprayer::OUTPUTS
        .iter()
        .map(|(key, _)| Output { name: format!("spray.{key}"), kind: Kind::Sprayer(key) });
    let is_known = |output: &Output| output.true_quantity().is_none_or(Appraisal::knows);
    measures.chain(truths).filter(is_known).chain(keys).chain(sprayed)
}

impl TryFrom<String> for Output {
    type Error = OutputError;

    fn try_from(name: String) -> Result<Self, OutputError> {
        if let Some(output) = all().find(|output| output.name == name) {
            return Ok(output);
        }
        let names: Vec<String> = all().map(|output| output.name).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let nearest = files::nearest(&name, &names);
        Err(OutputError { found: name, nearest })
    }
}

impl From<Output> for String {
    fn from(output: Output) -> Self {
        output.name
    }
}

impl Output {
    /// Its name, with the unit.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// True if it is a relative error.
    pub fn is_error(&self) -> bool {
        matches!(self.kind, Kind::Error { .. })
    }

    /// The quantity of which it needs the truth, if any.
    pub(super) fn true_quantity(&self) -> Option<Quantity> {
        match self.kind {
            Kind::Error { quantity, .. } | Kind::Truth(quantity) => Some(quantity),
            Kind::Measure { .. } | Kind::Estimate(_) | Kind::Sprayer(_) => None,
        }
    }

    fn estimator(&self) -> Option<&'static str> {
        match self.kind {
            Kind::Measure { estimator, .. } | Kind::Error { estimator, .. } => Some(estimator),
            Kind::Truth(_) | Kind::Estimate(_) | Kind::Sprayer(_) => None,
        }
    }

    /// True for a share of a sprayer's litres or leaves.
    pub(crate) fn is_share(&self) -> bool {
        self.of_sprayer().is_some_and(|key| super::sprayer::SHARES.contains(&key))
    }

    /// Its key where it is of the sprayer.
    pub(super) fn of_sprayer(&self) -> Option<&'static str> {
        match self.kind {
            Kind::Sprayer(key) => Some(key),
            _ => None,
        }
    }

    /// Its value, where it has one.
    pub(super) fn value(&self, estimate: &Estimate, truth: &Stretch<'_>) -> Option<f64> {
        let measured = |estimator: &str, quantity: Quantity| {
            let asked =
                |m: &Measure| m.estimator == estimator && m.quantity == quantity && m.band_m().is_none();
            estimate.side_by_side().into_iter().find(asked)?.value
        };
        match self.kind {
            Kind::Measure { estimator, quantity } => measured(estimator, quantity),
            Kind::Error { estimator, quantity } => {
                let real = truth.value(quantity, None)?;
                Some((measured(estimator, quantity)? - real) / real).filter(|error| error.is_finite())
            }
            Kind::Truth(quantity) => truth.value(quantity, None),
            Kind::Sprayer(_) => None,
            Kind::Estimate(key) => serde_json::to_value(estimate).ok()?.get(key)?.as_f64(),
        }
    }
}

/// The estimators that these outputs need.
pub(super) fn estimators(outputs: &[Output]) -> Vec<&'static EstimatorInfo> {
    let needed = |info: &&EstimatorInfo| outputs.iter().any(|output| output.estimator() == Some(info.name));
    TABLE.iter().filter(needed).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outputs_have_one_name_each_and_unknown_ones_the_nearest() {
        let mut names: Vec<String> = all().map(|output| output.name).collect();
        let count = names.len();
        names.sort();
        names.dedup();
        assert_eq!(names.len(), count);
        let why = Output::try_from("error.voxl.leaf_area_m2".to_owned()).expect_err("unknown").to_string();
        assert!(why.contains("did you mean `error.voxel.leaf_area_m2`?"), "{why}");
    }

    #[test]
    fn a_truth_that_only_a_finer_scan_tells_is_refused() {
        for quantity in Quantity::ALL {
            let found = Output::try_from(format!("truth.{}", quantity.key()));
            assert_eq!(found.is_ok(), Appraisal::knows(*quantity), "{quantity:?}");
        }
        for name in ["truth.porosity", "error.porosity.porosity", "error.impacted.impacted_total_area_m2"] {
            let why = Output::try_from(name.to_owned()).expect_err("unknown").to_string();
            assert!(why.contains("study estimators"), "{why}");
        }
        assert!(Output::try_from("porosity.porosity".to_owned()).is_ok(), "the measure itself");
    }

    #[test]
    fn keys_of_an_estimate_are_there() {
        let estimate = serde_json::to_value(Estimate::default()).expect("json");
        for key in ESTIMATE_KEYS {
            assert!(estimate.get(key).is_some(), "{key}");
        }
    }
}
