//! Points of a search in words.

use comfy_table::Cell;
use rowscan_canopy::reference::{PaperRegression, View};
use rowscan_study::areas::Rule;
use rowscan_study::search::PointReport;
use serde_json::Value;

use crate::cli::grid::Grid;
use crate::cli::output::{self, number};

/// The share of seeds at which each gate holds.
pub(super) fn gates(points: &[&PointReport]) -> Grid {
    let mut table = Grid::new();
    output::head(&mut table, ["gates held, % of seeds"].into_iter().chain(Rule::ALL.map(Rule::words)));
    for point in points {
        let mut row =
            vec![Cell::new(if point.point == 0 { "base".to_owned() } else { point.point.to_string() })];
        row.extend(point.gates.iter().map(|(_, share)| number(Some(100.0 * share), 0)));
        table.add_row(row);
    }
    table
}

/// Least to greatest.
pub(super) fn range(values: impl Iterator<Item = f64> + Clone) -> String {
    let (least, greatest) =
        (values.clone().fold(f64::INFINITY, f64::min), values.fold(f64::NEG_INFINITY, f64::max));
    if least <= greatest { format!("{least:.2}-{greatest:.2}") } else { String::new() }
}

/// The settings of a point on a line.
pub(super) fn words(point: &PointReport) -> String {
    let settings: Vec<String> =
        point.settings.iter().map(|(key, value)| format!("{} {}", short(key), plain(value))).collect();
    settings.join(", ")
}

/// A key without its tables, but for the two scans'.
fn short(key: &str) -> &str {
    let last = key.rsplit('.').next().unwrap_or(key);
    let scan = key.starts_with("lateral.") || key.starts_with("zenith.");
    if scan { key } else { last }
}

fn plain(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Array(items) => items.iter().map(plain).collect::<Vec<_>>().join("/"),
        Value::Object(items) => {
            items.iter().map(|(key, value)| format!("{key} {}", plain(value))).collect::<Vec<_>>().join(" ")
        }
        value => value.to_string(),
    }
}

/// The view of a regression.
pub(super) fn view(paper: &PaperRegression) -> &'static str {
    match paper.view {
        View::Lateral => "lateral",
        View::Zenith => "zenith",
    }
}
