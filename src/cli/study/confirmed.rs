//! Points on seeds that did not choose them: medians with intervals.

use comfy_table::Cell;
use rowscan_canopy::reference::{PAPER, PaperRegression};
use rowscan_study::Whole;
use rowscan_study::areas::symbol;
use rowscan_study::search::{
    ConfirmReport, ConfirmStudy, INTERVAL, LEAST_SEEDS, PointReport, Regression, report_confirmed,
};
use serde::Serialize;

use super::confirmed_markdown;
use super::points::{gates, view, words};
use super::tell::TellArgs;
use crate::cli::grid::Grid;
use crate::cli::output::{self, number};
use crate::cli::{Failure, Format, Outcome};

/// Reports on confirmed points.
pub(super) fn tell(
    args: &TellArgs,
    markdown: bool,
    (header, units): Whole<ConfirmStudy>,
) -> Result<Outcome, Failure> {
    args.no_figure("a confirmation")?;
    let report = report_confirmed(header, &units);
    if markdown {
        output::print(&confirmed_markdown::text(&report))?;
        return Ok(Outcome::Done);
    }
    match args.format {
        Format::Json | Format::Jsonl => output::print_json(args.format, &report)?,
        Format::Csv => {
            let rows: Vec<Row> = report.points.iter().flat_map(rows).collect();
            output::print_rows(args.format, &rows)?;
        }
        Format::Table => output::print(&table(&report))?,
    }
    Ok(Outcome::Done)
}

/// A regression of a point, on a line of CSV.
#[derive(Serialize)]
struct Row {
    point: usize,
    settings: String,
    seeds: usize,
    confirmed: bool,
    slope_distance: Option<f64>,
    slope_distance_low: Option<f64>,
    slope_distance_high: Option<f64>,
    equation: u8,
    view: &'static str,
    area: &'static str,
    slope: f64,
    slope_low: Option<f64>,
    slope_high: Option<f64>,
    paper_slope: f64,
    intercept_m2: f64,
    intercept_m2_low: Option<f64>,
    intercept_m2_high: Option<f64>,
    paper_intercept_m2: f64,
    slope_free: f64,
    intercept_free_m2: f64,
    intercept_free_m2_low: Option<f64>,
    intercept_free_m2_high: Option<f64>,
    r2: f64,
    r2_low: Option<f64>,
    r2_high: Option<f64>,
    paper_r2: f64,
    loo_rmse_relative: f64,
    power: f64,
    power_low: Option<f64>,
    power_high: Option<f64>,
}

fn rows(point: &PointReport) -> impl Iterator<Item = Row> {
    let of = |(own, paper): (&Regression, &PaperRegression)| {
        let (low, high) = (
            |ends: Option<[f64; 2]>| ends.map(|[low, _]| low),
            |ends: Option<[f64; 2]>| ends.map(|[_, high]| high),
        );
        Row {
            point: point.point,
            settings: words(point),
            seeds: point.seeds,
            confirmed: point.confirmed,
            slope_distance: point.slope_distance,
            slope_distance_low: low(point.slope_distance_95),
            slope_distance_high: high(point.slope_distance_95),
            equation: own.equation,
            view: view(paper),
            area: symbol(paper.area),
            slope: own.slope,
            slope_low: low(own.slope_95),
            slope_high: high(own.slope_95),
            paper_slope: paper.slope,
            intercept_m2: own.intercept_m2,
            intercept_m2_low: low(own.intercept_m2_95),
            intercept_m2_high: high(own.intercept_m2_95),
            paper_intercept_m2: paper.intercept_m2,
            slope_free: own.slope_free,
            intercept_free_m2: own.intercept_free_m2,
            intercept_free_m2_low: low(own.intercept_free_m2_95),
            intercept_free_m2_high: high(own.intercept_free_m2_95),
            r2: own.r2,
            r2_low: low(own.r2_95),
            r2_high: high(own.r2_95),
            paper_r2: paper.r2,
            loo_rmse_relative: own.loo_rmse_relative,
            power: own.power,
            power_low: low(own.power_95),
            power_high: high(own.power_95),
        }
    };
    point.regressions.iter().zip(&PAPER).map(of).collect::<Vec<_>>().into_iter()
}

fn table(report: &ConfirmReport) -> String {
    let header = &report.provenance;
    let of_paper = header.settings.search().base.is_of_paper();
    let mut text = String::new();
    for point in &report.points {
        text.push_str(&about(point, of_paper));
        text.push_str(&format!("{}\n\n", regressions(point, of_paper)));
    }
    let all: Vec<&PointReport> = report.points.iter().collect();
    let gates = if of_paper { format!("{}\n", gates(&all)) } else { String::new() };
    format!(
        "{text}{gates}medians over seeds {:?}, in brackets {INTERVAL}; scene {} ({}), rowscan {}\n",
        header.settings.seeds(),
        header.scene,
        header.scene_hash,
        header.rowscan,
    )
}

/// What a point is, and how far it lies from the paper.
fn about(point: &PointReport, of_paper: bool) -> String {
    let settings = if point.settings.is_empty() { "base".to_owned() } else { words(point) };
    let off = match (point.slope_distance, point.slope_distance_95) {
        (Some(off), Some([low, high])) => format!("off {off:.2} [{low:.2}, {high:.2}], "),
        (Some(off), None) => format!("off {off:.2}, "),
        (None, _) if of_paper => "no distance from the paper: not all six slopes are positive; ".to_owned(),
        (None, _) => String::new(),
    };
    let refused =
        point.refused.as_deref().map_or_else(String::new, |why| format!("; not at every seed: {why}"));
    let marked = if point.confirmed {
        String::new()
    } else {
        format!("; UNCONFIRMED: fewer than {LEAST_SEEDS} seeds")
    };
    format!("point {}: {settings}\n{off}{} seeds{refused}{marked}\n", point.point, point.seeds)
}

fn regressions(point: &PointReport, of_paper: bool) -> Grid {
    let mut table = Grid::new();
    let own =
        ["view", "area", "slope", "95 %", "intercept m²", "95 %", "free intercept m²", "95 %", "R²", "95 %"];
    let paper = ["paper slope", "off %", "intercept m²", "R²"];
    output::head(&mut table, own.into_iter().chain(paper.into_iter().filter(|_| of_paper)));
    for (own, paper) in point.regressions.iter().zip(&PAPER) {
        let has_intercept = paper.intercept_m2 != 0.0;
        let ours = [
            Cell::new(view(paper)),
            Cell::new(symbol(paper.area)),
            number(Some(own.slope), 2),
            ends(own.slope_95),
            number(Some(own.intercept_m2).filter(|_| has_intercept), 2),
            ends(own.intercept_m2_95),
            number(Some(own.intercept_free_m2), 2),
            ends(own.intercept_free_m2_95),
            number(Some(own.r2), 2),
            ends(own.r2_95),
        ];
        let theirs = [
            number(Some(paper.slope), 2),
            number(Some(100.0 * (own.slope / paper.slope - 1.0)), 0),
            number(Some(paper.intercept_m2).filter(|_| has_intercept), 2),
            number(Some(paper.r2), 2),
        ];
        table.add_row(ours.into_iter().chain(theirs.into_iter().filter(|_| of_paper)));
    }
    table
}

fn ends(interval: Option<[f64; 2]>) -> Cell {
    Cell::new(interval.map_or_else(String::new, |[low, high]| format!("[{low:.2}, {high:.2}]")))
}
