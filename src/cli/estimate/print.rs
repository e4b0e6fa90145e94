//! Estimates as they are written: a document, rows, tables for people.

use rowscan_canopy::{Estimate, MountReport, TreeEstimate, TreesFound, Warning};
use serde::Serialize;

use super::super::estimators;
use super::super::grid::Grid;
use super::super::output::{self, number};
use super::super::{Failure, Format};
use super::profile::{self, BandLine};
use super::scanner_report::{ScannerReport, codes, row_line};

/// Several of them.
#[derive(Serialize)]
struct All<'a> {
    scanners: &'a [ScannerReport],
}

/// A row with the scanner it is of.
#[derive(Serialize)]
struct Row<'a, T> {
    #[serde(skip_serializing_if = "Option::is_none")]
    scanner: Option<usize>,
    #[serde(flatten)]
    row: &'a T,
    #[serde(flatten)]
    whole: Option<Whole>,
}

/// What a reader of one tree must know of the whole estimate.
#[derive(Serialize)]
struct Whole {
    scans_lost: Option<u64>,
    segments_lost: u64,
    telegrams_bad: u64,
    warnings: String,
}

impl Whole {
    fn of(estimate: &Estimate) -> Self {
        let &Estimate { scans_lost, segments_lost, telegrams_bad, .. } = estimate;
        Self { scans_lost, segments_lost, telegrams_bad, warnings: codes(&estimate.warnings) }
    }
}

/// What a line of CSV is of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub(in super::super) enum By {
    /// A scanner's whole row
    #[default]
    Row,
    /// A tree, by the rig's spacing
    Tree,
    /// A band of height, of the row and of each tree: needs --profile
    Band,
}

/// Writes estimates: one as a document, several as a document of documents; as CSV a line a scanner, a line a tree or a line a band, or the estimators side by side if any
/// were asked for.
pub(super) fn print(format: Format, by: By, all: &[ScannerReport]) -> Result<(), Failure> {
    if by != By::default() && format != Format::Csv {
        output::say("--by says what a line of --format csv is of; this format tells all");
    }
    let has_estimators = all.iter().any(|told| !told.side_by_side.is_empty());
    if by != By::default() && format == Format::Csv && has_estimators {
        output::say(
            "lines are of what --by says: estimators side by side are left out; --format json tells both",
        );
    }
    match (format, all) {
        (Format::Json, [one]) => output::print_json(format, one),
        (Format::Json, all) => output::print_json(format, &All { scanners: all }),
        (Format::Jsonl, all) => all.iter().try_for_each(|told| output::print_json(format, told)),
        (Format::Csv, all) if by == By::Band => bands(format, all),
        (Format::Csv, all) if by == By::Row && has_estimators => {
            output::print_rows(format, &rows(all, |told| &told.side_by_side, |_| None))
        }
        (Format::Csv, all) if by == By::Row => {
            output::print_rows(format, &all.iter().map(row_line).collect::<Result<Vec<_>, _>>()?)
        }
        (Format::Csv, all) => {
            for told in all.iter().filter(|told| told.estimate.trees.is_empty()) {
                let why = codes(&told.estimate.warnings);
                output::say(format_args!(
                    "no tree is told: {}",
                    if why.is_empty() { "there is no rig" } else { &why }
                ));
            }
            let whole = |estimate: &Estimate| Some(Whole::of(estimate));
            let lines = rows(all, |told| &told.estimate.trees, whole);
            if !lines.is_empty() {
                return output::print_rows(format, &lines);
            }
            // The columns are the same whatever is known.
            let scanner = all.first().and_then(|told| told.scanner);
            let whole = Some(Whole::of(&Estimate::default()));
            output::print_header(&Row { scanner, row: &TreeEstimate::default(), whole })
        }
        (Format::Table, all) => all.iter().try_for_each(print_table),
    }
}

/// Says why there is no band.
fn no_band(told: &ScannerReport) {
    let why = codes(&told.estimate.warnings);
    output::say(format_args!("no band is told: {}", if why.is_empty() { "no canopy was met" } else { &why }));
}

/// A line a band.
fn bands(format: Format, all: &[ScannerReport]) -> Result<(), Failure> {
    let lists: Vec<(&ScannerReport, Vec<BandLine>)> = all
        .iter()
        .map(|told| (told, told.profile.as_ref().map(profile::lines).unwrap_or_default()))
        .collect();
    for (told, _) in lists.iter().filter(|(_, lines)| lines.is_empty()) {
        no_band(told);
    }
    let mut rows = Vec::new();
    for (told, lines) in &lists {
        let whole = || Some(Whole::of(&told.estimate));
        rows.extend(lines.iter().map(|row| Row { scanner: told.scanner, row, whole: whole() }));
    }
    if !rows.is_empty() {
        return output::print_rows(format, &rows);
    }
    // The columns are the same whatever is known.
    let scanner = all.first().and_then(|told| told.scanner);
    let whole = Some(Whole::of(&Estimate::default()));
    let asks_truth = all.iter().filter_map(|told| told.profile.as_ref()).any(|told| told.asks_truth);
    output::print_header(&Row { scanner, row: &BandLine::empty(asks_truth), whole })
}

fn rows<'a, T>(
    all: &'a [ScannerReport],
    of: impl Fn(&'a ScannerReport) -> &'a Vec<T>,
    whole: impl Fn(&Estimate) -> Option<Whole>,
) -> Vec<Row<'a, T>> {
    let mut rows = Vec::new();
    for told in all {
        let row = |row| Row { scanner: told.scanner, row, whole: whole(&told.estimate) };
        rows.extend(of(told).iter().map(row));
    }
    rows
}

fn print_table(told: &ScannerReport) -> Result<(), Failure> {
    let ScannerReport { scanner, source, estimate, profile, side_by_side } = told;
    if let (Some(scanner), Some(source)) = (scanner, source) {
        output::print(&format!("scanner {scanner}, {source}\n"))?;
    }
    output::print(&facts(estimate))?;
    if !estimate.trees.is_empty() {
        output::print(&trees(estimate))?;
    }
    match profile {
        Some(profile) if profile.row.is_empty() => no_band(told),
        Some(profile) => output::print(&profile::table(profile))?,
        None => {}
    }
    for found in &estimate.trees_found {
        output::print(&trees_found(found))?;
    }
    if !side_by_side.is_empty() {
        output::print(&estimators::table(side_by_side))?;
    }
    output::print(&warnings(&estimate.warnings))
}

/// The row's numbers, a line each.
fn facts(estimate: &Estimate) -> String {
    let mut text = String::new();
    let mut line = |name: &str, value: String| text.push_str(&format!("{name:<22}{value}\n"));
    let known = |value: Option<f64>, decimals: usize, unit: &str| {
        value.map_or_else(|| "unknown".to_owned(), |value| format!("{value:.decimals$} {unit}"))
    };
    line(
        "scans",
        format!(
            "{} ({} repeated, {} lost, {} left out, {} bad telegrams)",
            estimate.scans,
            estimate.scans_repeated,
            estimate.scans_lost.map_or_else(|| "an unknown number".to_owned(), |lost| lost.to_string()),
            estimate.scans_excluded,
            estimate.telegrams_bad
        ),
    );
    if estimate.scans_late > 0 {
        line(
            "scans late",
            format!("{}, behind scans that followed them: they are no line of the row", estimate.scans_late),
        );
    }
    let segments = [
        ("segments lost", estimate.segments_lost),
        ("segments doubled", estimate.segments_doubled),
        ("segments contrary", estimate.segments_contradicting),
    ];
    for (name, count) in segments.into_iter().filter(|(_, count)| *count > 0) {
        line(name, count.to_string());
    }
    line(
        "scan frequency",
        format!(
            "{} measured, {} stated",
            known(estimate.scan_frequency_hz, 3, "Hz"),
            known(estimate.scan_frequency_nominal_hz, 2, "Hz")
        ),
    );
    if let Some(mount) = estimate.mount {
        let MountReport { height_m, distance_m, offset_y_m, yaw_deg, pitch_deg, roll_deg } = mount;
        let place = format!("{height_m} m high, {distance_m} m from the row axis, {offset_y_m} m ahead");
        line("mount, by the rig", format!("{place}; yaw {yaw_deg}°, pitch {pitch_deg}°, roll {roll_deg}°"));
    }
    line("points a scan", estimate.points_per_scan.map_or_else(|| "unknown".into(), |n| n.to_string()));
    let ranges = &estimate.ranges;
    line(
        "ranges",
        format!(
            "{} returns, {} misses; {} to {}, mean {}",
            ranges.returns,
            ranges.misses,
            known(ranges.min_m, 3, "m"),
            known(ranges.max_m, 3, "m"),
            known(ranges.mean_m, 3, "m")
        ),
    );
    let by = estimate.advance_source.map_or_else(String::new, |source| format!(" by {}", source.name()));
    line("advance", known(estimate.advance_m, 3, "m") + &by);
    if let Some(sides) = estimate.other_side {
        let from = if sides.opposite { "its other side" } else { "the same side" };
        let alike =
            sides.correlation.map_or_else(String::new, |r| format!("; what both saw correlates by {r:.2}"));
        line(
            "two passes as one",
            format!(
                "the other one from {from}, {} slices of {}; {} voxels that this one did not see{alike}",
                sides.slices_joined,
                sides.slices_joined + sides.slices_alone,
                sides.voxels_revealed
            ),
        );
    }
    line("impacted area I_T", known(estimate.impacted_total_area_m2, 3, "m²"));
    line("leaf area", known(estimate.leaf.areas.best_m2().ok(), 2, "m²"));
    for (name, ends) in
        [("  95 %", estimate.leaf.interval_m2), ("  sampling error", estimate.leaf.sampling_error_m2)]
    {
        if let Some([low_m2, high_m2]) = ends {
            line(name, format!("{low_m2:.2} to {high_m2:.2} m²"));
        }
    }
    line("  by contact", known(estimate.leaf.areas.contact_m2().ok(), 2, "m²"));
    if let Ok(share_m2) = estimate.leaf.areas.share_m2() {
        line("  by shares of spots", known(Some(share_m2), 2, "m²"));
    }
    line("  by I_T", known(estimate.leaf.areas.regression_m2().ok(), 2, "m²"));
    line("LAI", known(estimate.leaf.areas.lai().ok(), 2, ""));
    text
}

/// The trees, and in words what their leaf areas are.
fn trees(estimate: &Estimate) -> String {
    let mut table = Grid::new();
    output::head(
        &mut table,
        ["tree", "y m", "I_T m²", "leaf m² by I_T", "leaf m²", "95 % m²", "LAI", "height m", "volume m³"],
    );
    for tree in &estimate.trees {
        let interval = tree.leaf.interval_m2;
        let mark = if tree.complete { "" } else { "*" };
        table.add_row([
            output::right(format!("{}{mark}", tree.tree)),
            number(Some(tree.y_m), 2),
            number(Some(tree.impacted_total_area_m2), 3),
            number(tree.leaf.areas.regression_m2().ok(), 2),
            number(tree.leaf.areas.best_m2().ok(), 2),
            output::right(
                interval.map_or_else(|| "–".into(), |[low, high]| format!("{low:.2} to {high:.2}")),
            ),
            number(tree.leaf.areas.lai().ok(), 2),
            number(tree.height_m, 2),
            number(Some(tree.volume_m3), 2),
        ]);
    }
    let mut text = format!("{table}\n");
    if estimate.trees.iter().any(|tree| !tree.complete) {
        text.push_str("* not scanned from end to end: its numbers are of the part that was\n");
    }
    if let Some(drawn) = estimate.pieces.and_then(|pieces| pieces.trees) {
        text.push_str(&format!(
            "leaf m² of a tree: what was measured of it, drawn toward the row's mean, with reliability {:.2} (0: the mean, 1: as measured); \
             leaf_area_unshrunk_m2 in --format json and csv is as measured\n",
            drawn.reliability
        ));
    }
    text
}

/// The trees that one way of cutting the row finds.
fn trees_found(found: &TreesFound) -> String {
    let mut table = Grid::new();
    output::head(&mut table, ["tree", "y m", "from m", "to m", "I_T m²", "leaf m² by contact, raw"]);
    for (number_of, tree) in found.trees.iter().enumerate() {
        table.add_row([
            number(Some(number_of as f64), 0),
            number(Some(tree.y_m), 2),
            number(Some(tree.y_from_m), 2),
            number(Some(tree.y_to_m), 2),
            number(Some(tree.impacted_total_area_m2), 3),
            number(tree.leaf_area_contact_raw_m2, 2),
        ]);
    }
    format!("{} trees found by {}\n{table}\n", found.trees.len(), found.method.name())
}

/// What the reader must know beside the numbers.
pub(crate) fn warnings(warnings: &[Warning]) -> String {
    warnings.iter().map(|warning| format!("warning: {warning}\n")).collect()
}
