//! Confirmed points as the tables of docs/paper.md.

use rowscan_canopy::reference::PAPER;
use rowscan_study::areas::symbol;
use rowscan_study::search::{ConfirmReport, PointReport};

use super::points::{range, view, words};

/// The regressions of a single point; of several a line each.
pub(super) fn text(report: &ConfirmReport) -> String {
    match report.points.as_slice() {
        [point] => regressions(point),
        points => slopes(points),
    }
}

/// A number with its interval.
fn with_ends(value: f64, ends: Option<[f64; 2]>) -> String {
    ends.map_or_else(|| format!("{value:.2}"), |[low, high]| format!("{value:.2} [{low:.2}, {high:.2}]"))
}

fn regressions(point: &PointReport) -> String {
    let mut text = String::from(
        "| view | area | slope | paper | off | intercept, m² | paper | free line's intercept, m² | R² | paper |\n\
         |---|---|---|---|---|---|---|---|---|---|\n",
    );
    for (own, paper) in point.regressions.iter().zip(&PAPER) {
        let free = paper.intercept_m2 != 0.0;
        let where_free = |words: String| if free { words } else { "–".to_owned() };
        text.push_str(&format!(
            "| {} | {} | {} | {:.2} | {:+.0} % | {} | {} | {} | {} | {:.2} |\n",
            view(paper),
            symbol(paper.area),
            with_ends(own.slope, own.slope_95),
            paper.slope,
            // Without a sign for what rounds to nothing.
            (100.0 * (own.slope / paper.slope - 1.0)).round() + 0.0,
            where_free(with_ends(own.intercept_m2, own.intercept_m2_95)),
            where_free(format!("{:.2}", paper.intercept_m2)),
            with_ends(own.intercept_free_m2, own.intercept_free_m2_95),
            with_ends(own.r2, own.r2_95),
            paper.r2,
        ));
    }
    text
}

fn slopes(points: &[PointReport]) -> String {
    let mut text = String::from(
        "| settings | lateral I_L | I_T | I_3L | zenith I_L | I_T | I_3L | R² | off |\n|---|---|---|---|---|---|---|---|---|\n| **paper** |",
    );
    PAPER.iter().for_each(|paper| text.push_str(&format!(" {:.2} |", paper.slope)));
    text.push_str(&format!(" {} | |\n", range(PAPER.iter().map(|paper| paper.r2))));
    for point in points {
        let settings = if point.settings.is_empty() { "base".to_owned() } else { words(point) };
        text.push_str(&format!("| {settings} |"));
        for place in 0..PAPER.len() {
            let own = point.regressions.get(place);
            let slope = own.map_or_else(|| "–".to_owned(), |own| with_ends(own.slope, own.slope_95));
            text.push_str(&format!(" {slope} |"));
        }
        let off = point
            .slope_distance
            .map_or_else(|| "–".to_owned(), |off| with_ends(off, point.slope_distance_95));
        let marked = if point.confirmed { "" } else { ", unconfirmed" };
        text.push_str(&format!(" {} | {off}{marked} |\n", range(point.regressions.iter().map(|own| own.r2))));
    }
    text
}
