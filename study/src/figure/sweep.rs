//! What each axis of a sweep does to the errors: one panel an axis.

use super::axis::Axis;
use super::canvas::{Area, Canvas, Ink};
use super::chart::Chart;
use super::style::{INKS, Key, Mark, legend, legend_height};
use super::words;
use crate::sweep::{Effect, Output, SweepReport};

/// Panels side by side.
const COLUMNS: usize = 3;
/// Pixels of a panel.
const PANEL: (u32, u32) = (420, 360);

/// Mean absolute error (or, of a sweep that keeps none, the mean of each share of a sprayer, or else of each output) over each axis, with its standard error twice over: a band along
/// numbers, a bar at a category.
pub fn sweep(report: &SweepReport) -> String {
    let study = &report.provenance.settings;
    let scale = Scale::of(report);
    let columns = study.sweep.len().clamp(1, COLUMNS);
    let rows = study.sweep.len().div_ceil(columns).max(1);
    let mut keys: Vec<Key> = scale
        .drawn
        .iter()
        .zip(INKS.into_iter().cycle())
        .map(|(output, ink)| Key::new(Mark::Disc, ink, words::of_output(output)))
        .collect();
    keys.push(Key::new(Mark::Band, Ink::BLACK, "band or bar: twice the standard error of the mean"));
    let (width, height) = (PANEL.0 * columns as u32, PANEL.1 * rows as u32);
    let mut canvas = Canvas::paper((width, height + legend_height(keys.len())));
    let (charts, below) = canvas.all().split_below(height);
    legend(&mut canvas, below, &keys);
    for (area, axis) in charts.grid(rows, columns).into_iter().zip(&study.sweep) {
        let name = axis.name();
        let of_axis = |effect: &&Effect| effect.axis == name && scale.shows(effect);
        panel(
            &mut canvas,
            area,
            &words::of_axis(&name),
            &scale,
            &report.effects.iter().filter(of_axis).collect::<Vec<_>>(),
        );
    }
    canvas.svg()
}

/// What is drawn of every effect, and between which bounds.
struct Scale<'a> {
    errors: bool,
    drawn: Vec<&'a str>,
    low: f64,
    high: f64,
}

impl<'a> Scale<'a> {
    fn of(report: &'a SweepReport) -> Self {
        let keep = &report.provenance.settings.keep;
        let errors = keep.iter().any(|output| output.is_error());
        // Shares and litres have no scale in common.
        let shares = !errors && keep.iter().any(|output| output.is_share());
        let is_drawn = |output: &&Output| output.is_error() == errors && output.is_share() == shares;
        let drawn = keep.iter().filter(is_drawn).map(|output| output.name());
        let mut scale = Self { errors, drawn: drawn.collect(), low: 0.0, high: 1e-6 };
        for effect in &report.effects {
            if scale.shows(effect) {
                let [low, high] = scale.ends(effect);
                (scale.low, scale.high) = (scale.low.min(low), scale.high.max(high));
            }
        }
        scale
    }

    fn shows(&self, effect: &Effect) -> bool {
        effect.n > 0 && self.drawn.contains(&effect.output.as_str())
    }

    fn middle(&self, effect: &Effect) -> f64 {
        if self.errors { 100.0 * effect.mean_abs } else { effect.mean }
    }

    fn ends(&self, effect: &Effect) -> [f64; 2] {
        let se = if self.errors { effect.mean_abs_se.map(|se| 100.0 * se) } else { effect.mean_se };
        // Of a single value nothing is known: no bar.
        [-2.0, 2.0].map(|times| self.middle(effect) + times * se.unwrap_or(0.0))
    }
}

fn panel(canvas: &mut Canvas, area: Area, name: &str, scale: &Scale<'_>, effects: &[&Effect]) {
    let places = Places::of(effects);
    let named = !places.named.is_empty();
    let x = Axis::linear(places.from, places.to);
    let y = Axis::linear(scale.low, scale.low + 1.05 * (scale.high - scale.low));
    let mut chart = Chart::new(canvas, area, name, x, y);
    let y_name = if scale.errors { "mean |error|, %" } else { "mean" };
    if named {
        chart.axes_of_categories(&places.named, y_name);
    } else {
        chart.axes(name, y_name);
    }
    for (output, ink) in scale.drawn.iter().zip(INKS.into_iter().cycle()) {
        let points: Vec<(f64, &Effect)> = effects
            .iter()
            .filter(|effect| effect.output == *output)
            .map(|effect| (places.x(effect), *effect))
            .collect();
        let path = |value: &dyn Fn(&Effect) -> f64| -> Vec<(f64, f64)> {
            points.iter().map(|(x, effect)| (*x, value(effect))).collect()
        };
        let [below, above] = [0, 1].map(|end| path(&|effect| scale.ends(effect)[end]));
        let middles = path(&|effect| scale.middle(effect));
        if named {
            for (from, to) in below.into_iter().zip(above) {
                chart.path(&[from, to], ink.thinned(0.6), 1.0);
            }
        } else {
            chart.band(&below, &above, ink);
            chart.path(&middles, ink, 2.0);
        }
        chart.marks(&middles, Mark::Disc, ink);
    }
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
        Self { from: -0.5, to: named.len() as f64 - 0.5, named }
    }

    fn x(&self, effect: &Effect) -> f64 {
        let by_name = || self.named.iter().find(|(name, _)| *name == effect.at).map(|(_, x)| *x);
        effect.x.filter(|_| self.named.is_empty()).or_else(by_name).unwrap_or_default()
    }
}
