//! What all stages together do to each measure, over the distance: one panel a measure, one line a model.

use super::axis::Axis;
use super::canvas::{Canvas, Ink};
use super::chart::Chart;
use super::style::{INKS, Key, Mark, legend, legend_height};
use crate::physics::{Effect, Output};

/// Panels side by side.
const COLUMNS: usize = 3;
/// Pixels of a panel.
const PANEL: (u32, u32) = (400, 320);
/// What is drawn.
const DRAWN: [Output; 9] = [
    Output::ImpactedTotal,
    Output::Contact,
    Output::Gap,
    Output::Height,
    Output::Width,
    Output::Volume,
    Output::TreeRowVolume,
    Output::LeafWallArea,
    Output::LeafArea,
];

/// Change against the thin beam over the distance to the row, of every stage together.
pub fn physics(effects: &[Effect]) -> String {
    let device: Vec<&Effect> = effects.iter().filter(|effect| effect.stages == "device").collect();
    let mut models: Vec<&str> = device.iter().map(|effect| effect.model).collect();
    models.dedup();
    models.sort_unstable();
    models.dedup();
    let metres = || device.iter().map(|effect| effect.distance_m);
    let (near_m, far_m) = (metres().fold(f64::INFINITY, f64::min), metres().fold(0.0, f64::max));
    let (from_m, to_m) =
        if near_m < far_m { (near_m - 0.2, far_m + 0.2) } else { (far_m - 1.0, far_m + 1.0) };
    let rows = DRAWN.len().div_ceil(COLUMNS);
    let (width, height) = (PANEL.0 * COLUMNS as u32, PANEL.1 * rows as u32);
    let keys: Vec<Key> = models
        .iter()
        .zip(INKS.into_iter().cycle())
        .map(|(model, ink)| Key::new(Mark::Disc, ink, *model))
        .collect();
    let mut canvas = Canvas::paper((width, height + legend_height(keys.len())));
    let (charts, below) = canvas.all().split_below(height);
    legend(&mut canvas, below, &keys);
    for (panel, output) in charts.grid(rows, COLUMNS).into_iter().zip(DRAWN) {
        let of = |model: &str| -> Vec<(f64, f64)> {
            let shown = device.iter().filter(|effect| effect.output == output && effect.model == model);
            shown.filter_map(|effect| Some((effect.distance_m, 100.0 * effect.change?))).collect()
        };
        let ends = models.iter().flat_map(|model| of(model)).map(|(_, change)| change);
        let (low, high) = ends.fold((-5.0_f64, 5.0_f64), |(low, high), y| (low.min(y), high.max(y)));
        let room = 0.08 * (high - low);
        let (x, y) = (Axis::linear(from_m, to_m), Axis::linear(low - room, high + room));
        let mut chart = Chart::new(&mut canvas, panel, output.name(), x, y);
        chart.axes("distance to the row, m", "change, %");
        chart.path(&[(from_m, 0.0), (to_m, 0.0)], Ink::BLACK.thinned(0.5), 1.0);
        for (model, ink) in models.iter().zip(INKS.into_iter().cycle()) {
            let points = of(model);
            chart.path(&points, ink, 2.0);
            chart.marks(&points, Mark::Disc, ink);
        }
    }
    canvas.svg()
}
