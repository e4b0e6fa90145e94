//! Medians of the presets over many seeds: leaves, leaf area, LAI, spread; and how long growing takes.
//!
//! `cargo run --release -p rowscan-scenes --example presets`

#![allow(clippy::print_stdout, missing_docs)]

use std::time::Instant;

use rowscan_scenes::orchard::{OrchardParameters, Preset};
use rowscan_scenes::{Orchard, Tree};

const SEEDS: u64 = 40;

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    if values.len() % 2 == 1 { values[middle] } else { 0.5 * (values[middle - 1] + values[middle]) }
}

fn row(title: &str, parameters: &OrchardParameters) {
    let parameters = OrchardParameters { trees: Some(1), ..parameters.clone() };
    let started = Instant::now();
    let grown: Vec<Tree> = (1..=SEEDS)
        .map(|seed| match Orchard::grow(&parameters, seed, &|_, _| {}) {
            Ok(orchard) => orchard.trees()[0].clone(),
            Err(error) => {
                println!("{title}: seed {seed}: {error}");
                Tree::default()
            }
        })
        .collect();
    let seconds = started.elapsed().as_secs_f64() / SEEDS as f64;
    let layout = parameters.layout();
    let areas: Vec<f64> = grown.iter().map(Tree::leaf_area_m2).collect();
    let mean = areas.iter().sum::<f64>() / areas.len() as f64;
    let variance = areas.iter().map(|a| (a - mean).powi(2)).sum::<f64>() / (areas.len() - 1) as f64;
    let area = median(areas.iter().copied());
    println!(
        "{title:28} units {:6.0}  leaves {:6.0}  m² {area:6.2}  LAI {:5.2}  CV {:4.2}  s/tree {seconds:.4}",
        median(grown.iter().map(|tree| tree.wood.len() as f64)),
        median(grown.iter().map(|tree| tree.leaves.len() as f64)),
        area / (layout.row_spacing_m * layout.tree_spacing_m),
        variance.sqrt() / mean,
    );
}

fn main() {
    for preset in Preset::ALL {
        row(&preset.to_string(), &OrchardParameters::of(*preset));
    }
    for iterations in [7, 8, 9, 10, 11] {
        let mut paper = OrchardParameters::of(Preset::Paper);
        paper.tree.iterations = Some(iterations);
        row(&format!("paper, {iterations} seasons"), &paper);
    }
    for preset in [Preset::Spindle, Preset::Mature] {
        let mut wild = OrchardParameters::of(preset);
        wild.tree.pruned = Some(false);
        row(&format!("{preset}, unpruned"), &wild);
    }
}
