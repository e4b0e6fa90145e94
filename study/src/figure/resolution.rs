//! Errors of coarser scans.

use super::axis::Axis;
use super::canvas::{Canvas, Ink};
use super::chart::Chart;
use super::style::{INKS, Key, Mark, legend, legend_height};
use crate::resolution::{ResolutionReport, ResolutionRow};

/// Pixels of the chart.
const CHART: (u32, u32) = (760, 440);
/// Smaller errors are drawn here: a logarithm has no zero.
const LEAST_PERCENT: f64 = 0.01;

/// Error over advance: what 95 % of the errors stay below and their standard deviation, one pair of lines an angle between beams.
pub fn resolution(report: &ResolutionReport) -> String {
    let mut angles: Vec<f64> = report.rows.iter().map(|row| row.dtheta_deg).collect();
    angles.dedup();
    let mut keys = vec![Key::new(Mark::Dashes, Ink::BLACK, "5 %: the paper's bound, at 20 mm")];
    for (angle, ink) in angles.iter().zip(INKS.into_iter().cycle()) {
        keys.push(Key::new(
            Mark::Disc,
            ink,
            format!("Δθ {angle}°: 95 % of |error| below; rings: standard deviation"),
        ));
    }
    let mut canvas = Canvas::paper((CHART.0, CHART.1 + legend_height(keys.len())));
    let (place, below) = canvas.all().split_below(CHART.1);
    legend(&mut canvas, below, &keys);
    let mm = |row: &ResolutionRow| 1000.0 * row.dy_m;
    let low = report.rows.iter().map(mm).fold(f64::INFINITY, f64::min).max(1e-3);
    let high = report.rows.iter().map(mm).fold(0.0, f64::max).max(2.0 * low);
    let worst = report.rows.iter().map(|row| 100.0 * row.error_p95_abs).fold(6.0, f64::max);
    let least = report.rows.iter().map(|row| 100.0 * row.error_sd).filter(|percent| *percent > 0.0);
    let least = (0.7 * least.fold(1.0, f64::min)).max(LEAST_PERCENT);
    let (from, to) = (0.8 * low, 1.2 * high);
    let (x, y) = (Axis::logarithmic(from, to), Axis::logarithmic(least, 1.5 * worst));
    let title = "I_T of coarser advances against 2 mm, same Δθ, random starts";
    let mut chart = Chart::new(&mut canvas, place, title, x, y);
    chart.axes("advance Δy, mm", "error of I_T, %");
    let along = |share: f64| (from * (to / from).powf(share), 5.0);
    for k in 0..30 {
        let dash = [along(f64::from(k) / 30.0), along((f64::from(k) + 0.6) / 30.0)];
        chart.path(&dash, Ink::BLACK, 1.0);
    }
    for (angle, ink) in angles.iter().zip(INKS.into_iter().cycle()) {
        // The reference itself has no error to draw.
        let rows =
            || report.rows.iter().filter(move |row| row.dtheta_deg == *angle && row.error_p95_abs > 0.0);
        let path = |value: fn(&ResolutionRow) -> f64| -> Vec<(f64, f64)> {
            rows().map(|row| (mm(row), (100.0 * value(row)).max(least))).collect()
        };
        for (mark, width, points) in
            [(Mark::Disc, 2.0, path(|row| row.error_p95_abs)), (Mark::Ring, 1.0, path(|row| row.error_sd))]
        {
            chart.path(&points, ink, width);
            chart.marks(&points, mark, ink);
        }
    }
    canvas.svg()
}
