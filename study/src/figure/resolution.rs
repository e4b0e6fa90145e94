//! Errors of coarser scans.

use plotters::prelude::*;

use super::{DrawError, INKS, axes, builder, legend};
use crate::resolution::{ResolutionReport, ResolutionRow};

/// Error over advance, one pair of lines an angle between beams.
pub fn resolution(report: &ResolutionReport) -> Result<String, DrawError> {
    /// Smaller errors are drawn here: a logarithm has no zero.
    const LEAST_PERCENT: f64 = 0.01;
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, (760, 480)).into_drawing_area();
        root.fill(&WHITE)?;
        let mm = |row: &ResolutionRow| 1000.0 * row.dy_m;
        let low = report.rows.iter().map(mm).fold(f64::INFINITY, f64::min).max(1e-3);
        let high = report.rows.iter().map(mm).fold(0.0, f64::max).max(2.0 * low);
        let worst = report.rows.iter().map(|row| 100.0 * row.error_p95_abs).fold(6.0, f64::max);
        let mut chart = builder(&root, "I_T against the 2 mm scan at the same Δθ").build_cartesian_2d(
            ((0.8 * low)..(1.2 * high)).log_scale(),
            (LEAST_PERCENT..20.0 * worst).log_scale(),
        )?;
        axes(&mut chart, "advance Δy, mm", "error, %")?;
        let grey = BLACK.mix(0.45).stroke_width(1);
        chart
            .draw_series([PathElement::new(vec![(0.8 * low, 5.0), (1.2 * high, 5.0)], grey)])?
            .label("5 %: the paper's bound, at 20 mm")
            .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 20, y)], grey));
        let mut angles: Vec<f64> = report.rows.iter().map(|row| row.dtheta_deg).collect();
        angles.dedup();
        for (angle, ink) in angles.into_iter().zip(INKS.into_iter().cycle()) {
            let rows = || report.rows.iter().filter(move |row| row.dtheta_deg == angle);
            let bound: Vec<_> =
                rows().map(|row| (mm(row), (100.0 * row.error_p95_abs).max(LEAST_PERCENT))).collect();
            let middle: Vec<_> =
                rows().map(|row| (mm(row), (100.0 * row.error_mean.abs()).max(LEAST_PERCENT))).collect();
            chart
                .draw_series([PathElement::new(bound.clone(), ink.stroke_width(2))])?
                .label(format!("Δθ {angle}°: 95 % of |e| below; open circles, |mean e|"))
                .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 20, y)], ink.stroke_width(2)));
            chart.draw_series(bound.into_iter().map(|at| Circle::new(at, 3, ink.filled())))?;
            chart.draw_series([PathElement::new(middle.clone(), ink.mix(0.6).stroke_width(1))])?;
            chart.draw_series(middle.into_iter().map(|at| Circle::new(at, 4, ink.stroke_width(1))))?;
        }
        legend(&mut chart)?;
        root.present()?;
    }
    Ok(svg)
}
