//! A scanner's estimate as it is written, and its whole row as a line of CSV.

use rowscan_canopy::{Estimate, Warning};
use rowscan_study::profile_beside::ProfileBeside;
use rowscan_study::side_by_side::Beside;
use serde::Serialize;
use serde_json::{Map, Value};

use super::super::Failure;

/// One scanner's estimate with its estimators side by side.
#[derive(Serialize)]
pub(super) struct ScannerReport {
    /// The rig's scanner; told of several only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) scanner: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) source: Option<String>,
    #[serde(flatten)]
    pub(super) estimate: Estimate,
    /// The canopy by height, as the estimate has it, with the truth beside it if that was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) profile: Option<ProfileBeside>,
    /// The row's numbers with the truth beside them; only if estimators were asked for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) side_by_side: Vec<Beside>,
}

/// The codes of warnings, each once, with blanks between them.
pub(super) fn codes(warnings: &[Warning]) -> String {
    Warning::codes(warnings).join(" ")
}

/// The columns, in their order: the same whatever is known, with a rig or without. Lists and tables are told by the other formats.
const COLUMNS: &[&str] = &[
    "scans",
    "scans_repeated",
    "scans_late",
    "scans_lost",
    "turns_left_out",
    "scans_excluded",
    "telegrams_bad",
    "segments_lost",
    "segments_doubled",
    "segments_contradicting",
    "points_per_scan",
    "scan_frequency_hz",
    "scan_frequency_nominal_hz",
    "advance_m",
    "advance_source",
    "scanned_m",
    "canopy_m",
    "crown_depth_m",
    "impacted_total_area_m2",
    "leaf_area_m2",
    "leaf_area_withheld",
    "leaf_area_interval_m2",
    "leaf_area_sampling_error_m2",
    "lai",
    "leaf_area_estimator",
    "leaf_area_spot_relative_sd",
    "leaf_area_contact_m2",
    "leaf_area_contact_raw_m2",
    "leaf_area_share_m2",
    "leaf_area_share_raw_m2",
    "leaf_area_regression_m2",
    "regression",
    "leaf_area_null_m2",
];

/// The line, which begins with the scanner and its source where several are told and ends with the codes of its warnings. What is not known is null: an
/// empty cell.
pub(super) fn row_line(told: &ScannerReport) -> Result<Map<String, Value>, Failure> {
    let failed = |cause: serde_json::Error| Failure::Write { what: "CSV".to_owned(), cause: cause.into() };
    let mut known = match serde_json::to_value(&told.estimate).map_err(failed)? {
        Value::Object(known) => known,
        _ => Map::new(),
    };
    let scanner = told.scanner.map(|scanner| ("scanner".to_owned(), Value::from(scanner)));
    let source = told.source.clone().map(|source| ("source".to_owned(), Value::from(source)));
    let numbers = COLUMNS.iter().map(|name| ((*name).to_owned(), known.remove(*name).unwrap_or_default()));
    let warnings = ("warnings".to_owned(), Value::String(codes(&told.estimate.warnings)));
    Ok(scanner.into_iter().chain(source).chain(numbers).chain([warnings]).collect())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

    use super::*;

    fn line(scanner: Option<usize>, estimate: Estimate) -> Map<String, Value> {
        let source = scanner.map(|_| "run.mcap".to_owned());
        row_line(&ScannerReport { scanner, source, estimate, profile: None, side_by_side: Vec::new() })
            .unwrap()
    }

    #[test]
    fn a_line_has_the_same_columns_whatever_is_known() {
        let nothing = line(None, Estimate::default());
        let names: Vec<&String> = nothing.keys().collect();
        let known = Estimate {
            scans: 3,
            advance_m: Some(1.5),
            contact: Some(rowscan_canopy::estimate::ContactReport::default()),
            ..Estimate::default()
        };
        let something = line(None, known);
        assert_eq!(something.keys().collect::<Vec<_>>(), names);
        assert_eq!((&something["advance_m"], &nothing["advance_m"]), (&Value::from(1.5), &Value::Null));
        assert_eq!(nothing["leaf_area_m2"], Value::Null, "an area that is not known is never 0");
        let several = line(Some(1), Estimate::default());
        assert_eq!((&several["scanner"], &several["source"]), (&1.into(), &"run.mcap".into()));
        assert_eq!(several.keys().skip(2).collect::<Vec<_>>(), names);
    }
}
