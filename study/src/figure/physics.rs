//! What all stages together do to each measure, over the distance: one panel a measure, one line a model.

use plotters::prelude::*;

use super::DrawError;
use super::style::{INKS, Key, Mark, axes, builder, figure, legend, legend_height};
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
pub fn physics(effects: &[Effect]) -> Result<String, DrawError> {
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
    figure((width, height + legend_height(keys.len())), |root| {
        let (charts, below) = root.split_vertically(height);
        legend(&below, 72, &keys)?;
        for (panel, output) in charts.split_evenly((rows, COLUMNS)).iter().zip(DRAWN) {
            let of = |model: &str| -> Vec<(f64, f64)> {
                let shown = device.iter().filter(|effect| effect.output == output && effect.model == model);
                shown.filter_map(|effect| Some((effect.distance_m, 100.0 * effect.change?))).collect()
            };
            let ends = models.iter().flat_map(|model| of(model)).map(|(_, change)| change);
            let (low, high) = ends.fold((-5.0_f64, 5.0_f64), |(low, high), y| (low.min(y), high.max(y)));
            let room = 0.08 * (high - low);
            let mut chart =
                builder(panel, output.name()).build_cartesian_2d(from_m..to_m, low - room..high + room)?;
            axes(&mut chart, "distance to the row, m", "change, %")?;
            let zero = BLACK.mix(0.5).stroke_width(1);
            chart.draw_series([PathElement::new(vec![(from_m, 0.0), (to_m, 0.0)], zero)])?;
            for (model, ink) in models.iter().zip(INKS.into_iter().cycle()) {
                let points = of(model);
                chart.draw_series([PathElement::new(points.clone(), ink.stroke_width(2))])?;
                chart.draw_series(points.into_iter().map(|place| Mark::Disc.at(place, ink)))?;
            }
        }
        Ok(())
    })
}
