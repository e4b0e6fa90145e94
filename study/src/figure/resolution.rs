//! Errors of coarser scans.

use plotters::prelude::*;

use super::DrawError;
use super::style::{INKS, Key, Mark, axes, builder, figure, legend, legend_height};
use crate::resolution::{ResolutionReport, ResolutionRow};

/// Pixels of the chart.
const CHART: (u32, u32) = (760, 440);
/// Smaller errors are drawn here: a logarithm has no zero.
const LEAST_PERCENT: f64 = 0.01;

/// Error over advance: what 95 % of the errors stay below and their standard deviation, one pair of lines an angle between beams.
pub fn resolution(report: &ResolutionReport) -> Result<String, DrawError> {
    let mut angles: Vec<f64> = report.rows.iter().map(|row| row.dtheta_deg).collect();
    angles.dedup();
    let mut keys = vec![Key::new(Mark::Dashes, BLACK, "5 %: the paper's bound, at 20 mm")];
    for (angle, ink) in angles.iter().zip(INKS.into_iter().cycle()) {
        keys.push(Key::new(
            Mark::Disc,
            ink,
            format!("Δθ {angle}°: 95 % of |error| below; rings: standard deviation"),
        ));
    }
    figure((CHART.0, CHART.1 + legend_height(keys.len())), |root| {
        let (chart, below) = root.split_vertically(CHART.1);
        legend(&below, 72, &keys)?;
        let mm = |row: &ResolutionRow| 1000.0 * row.dy_m;
        let low = report.rows.iter().map(mm).fold(f64::INFINITY, f64::min).max(1e-3);
        let high = report.rows.iter().map(mm).fold(0.0, f64::max).max(2.0 * low);
        let worst = report.rows.iter().map(|row| 100.0 * row.error_p95_abs).fold(6.0, f64::max);
        let least = report.rows.iter().map(|row| 100.0 * row.error_sd).filter(|percent| *percent > 0.0);
        let least = (0.7 * least.fold(1.0, f64::min)).max(LEAST_PERCENT);
        let mut chart = builder(&chart, "I_T of coarser advances against 2 mm, same Δθ, random starts")
            .build_cartesian_2d(((0.8 * low)..(1.2 * high)).log_scale(), (least..1.5 * worst).log_scale())?;
        axes(&mut chart, "advance Δy, mm", "error of I_T, %")?;
        let (from, to) = ((0.8 * low).ln(), (1.2 * high).ln());
        let along = |share: f64| ((from + share * (to - from)).exp(), 5.0);
        let dash = |k: u32| {
            PathElement::new(
                vec![along(f64::from(k) / 30.0), along((f64::from(k) + 0.6) / 30.0)],
                BLACK.stroke_width(1),
            )
        };
        chart.draw_series((0..30).map(dash))?;
        for (angle, ink) in angles.iter().zip(INKS.into_iter().cycle()) {
            // The reference itself has no error to draw.
            let rows =
                || report.rows.iter().filter(move |row| row.dtheta_deg == *angle && row.error_p95_abs > 0.0);
            let path = |value: fn(&ResolutionRow) -> f64| -> Vec<(f64, f64)> {
                rows().map(|row| (mm(row), (100.0 * value(row)).max(least))).collect()
            };
            for (mark, width, points) in
                [(Mark::Disc, 2, path(|row| row.error_p95_abs)), (Mark::Ring, 1, path(|row| row.error_sd))]
            {
                chart.draw_series([PathElement::new(points.clone(), ink.stroke_width(width))])?;
                chart.draw_series(points.into_iter().map(|at| mark.at(at, ink)))?;
            }
        }
        Ok(())
    })
}
