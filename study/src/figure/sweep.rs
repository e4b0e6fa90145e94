//! What each axis of a sweep does to the errors: one panel an axis.

use plotters::prelude::*;

use super::{DrawError, FONT, INKS, axes, builder, legend};
use crate::sweep::{Effect, SweepReport};

/// Panels side by side.
const COLUMNS: usize = 3;
/// Pixels of a panel.
const PANEL: (u32, u32) = (420, 360);

/// Mean absolute error (or, of a sweep that keeps none, the mean of each output) over each axis, with its standard error twice over.
pub fn sweep(report: &SweepReport) -> Result<String, DrawError> {
    let study = &report.provenance.settings;
    let errors = study.keep.iter().any(|output| output.is_error());
    let drawn: Vec<&str> =
        study.keep.iter().filter(|output| output.is_error() == errors).map(|output| output.name()).collect();
    let columns = study.sweep.len().clamp(1, COLUMNS);
    let rows = study.sweep.len().div_ceil(columns).max(1);
    let mut svg = String::new();
    {
        let size = (PANEL.0 * columns as u32, PANEL.1 * rows as u32);
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        root.fill(&WHITE)?;
        let middle = |effect: &Effect| if errors { 100.0 * effect.mean_abs } else { effect.mean };
        let half = |effect: &Effect| {
            let se = if errors { 100.0 * effect.mean_abs_se } else { effect.sd / (effect.n as f64).sqrt() };
            2.0 * se
        };
        let shown = |effect: &&Effect| effect.n > 0 && drawn.contains(&effect.output.as_str());
        let ends = report.effects.iter().filter(shown).map(|e| (middle(e) - half(e), middle(e) + half(e)));
        let (low, high) = ends.fold((0.0_f64, 1e-6_f64), |(low, high), (a, b)| (low.min(a), high.max(b)));
        // Room above for the legend.
        let high = low + (high - low) * (1.15 + 0.09 * drawn.len() as f64);
        for (at, (panel, axis)) in root.split_evenly((rows, columns)).iter().zip(&study.sweep).enumerate() {
            let name = axis.name();
            let effects: Vec<&Effect> =
                report.effects.iter().filter(|effect| effect.axis == name).filter(shown).collect();
            let places = Places::of(&effects);
            let mut chart = builder(panel, &name).build_cartesian_2d(places.from..places.to, low..high)?;
            let y = if errors { "mean |error|, %" } else { "mean" };
            axes(&mut chart, if places.named.is_empty() { name.as_str() } else { "" }, y)?;
            for (text, x) in &places.named {
                // Upwards from the axis: names have no place on a scale of numbers.
                let at = (*x, low + 0.02 * (high - low));
                chart.draw_series([Text::new(
                    text.clone(),
                    at,
                    (FONT, 12).into_font().transform(FontTransform::Rotate270),
                )])?;
            }
            for (output, ink) in drawn.iter().zip(INKS.into_iter().cycle()) {
                let points: Vec<(f64, &Effect)> = effects
                    .iter()
                    .filter(|effect| effect.output == *output)
                    .map(|effect| (places.x(effect), *effect))
                    .collect();
                let bars = points.iter().map(|(x, e)| {
                    PathElement::new(vec![(*x, middle(e) - half(e)), (*x, middle(e) + half(e))], ink.mix(0.6))
                });
                chart.draw_series(bars)?;
                if places.named.is_empty() {
                    let line: Vec<_> = points.iter().map(|(x, e)| (*x, middle(e))).collect();
                    chart.draw_series([PathElement::new(line, ink.stroke_width(2))])?;
                }
                let marks = chart
                    .draw_series(points.iter().map(|(x, e)| Circle::new((*x, middle(e)), 4, ink.filled())))?;
                if at == 0 {
                    let label = output.strip_prefix("error.").unwrap_or(output);
                    marks.label(label).legend(move |(x, y)| Circle::new((x + 10, y), 4, ink.filled()));
                }
            }
            if at == 0 {
                legend(&mut chart)?;
            }
        }
        root.present()?;
    }
    Ok(svg)
}

/// Where the values of an axis stand: at their number, or side by side under their names.
struct Places {
    from: f64,
    to: f64,
    named: Vec<(String, f64)>,
}

impl Places {
    fn of(effects: &[&Effect]) -> Self {
        let numbers: Vec<f64> = effects.iter().filter_map(|effect| effect.x).collect();
        if numbers.len() == effects.len() && !numbers.is_empty() {
            let low = numbers.iter().copied().fold(f64::INFINITY, f64::min);
            let high = numbers.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let margin = 0.1 * (high - low).max(1e-6);
            return Self { from: low - margin, to: high + margin, named: Vec::new() };
        }
        let mut named: Vec<(String, f64)> = Vec::new();
        for effect in effects {
            if named.iter().all(|(name, _)| *name != effect.at) {
                named.push((effect.at.clone(), named.len() as f64));
            }
        }
        Self { from: -0.5, to: named.len() as f64 - 0.1, named }
    }

    fn x(&self, effect: &Effect) -> f64 {
        let by_name = || self.named.iter().find(|(name, _)| *name == effect.at).map(|(_, x)| *x);
        effect.x.filter(|_| self.named.is_empty()).or_else(by_name).unwrap_or_default()
    }
}
