//! What canopy a scene is: its description for warnings, from the scene and from what was grown. It never enters an estimate.

use rowscan_canopy::{CanopyClass, RowClass};
use rowscan_scenes::{Scene, Truth};

/// The class of a scene's first row, of which this is the truth.
pub fn row_class(scene: &Scene, truth: &Truth) -> RowClass {
    let leaves: usize = truth.trees.iter().map(|tree| tree.leaves).sum();
    // Fruit stops beams, and is no leaf.
    let wood_m2 = truth.wood_area_m2 + truth.post_area_m2 + truth.wire_area_m2 + truth.fruit_area_m2;
    let surface_m2 = wood_m2 + 2.0 * truth.leaf_area_m2;
    RowClass {
        preset: Some(scene.orchard.training_system()),
        canopy: CanopyClass {
            leaf_angle_deg: truth.leaf_angle_mean_deg,
            leaf_area_cm2: (leaves > 0).then(|| truth.leaf_area_m2 * 1e4 / leaves as f64),
            season: Some(scene.orchard.season.to_string()),
            generator: Some(scene.orchard.generator().to_string()),
            wood_share: (surface_m2 > 0.0).then(|| wood_m2 / surface_m2),
        },
    }
}

/// The class of a scene's rows as far as it says so itself that they are bare: what is known before anything is grown.
pub fn bare_class(scene: &Scene) -> Option<RowClass> {
    let season = scene.orchard.season;
    let canopy =
        CanopyClass { season: Some(season.to_string()), wood_share: Some(1.0), ..CanopyClass::default() };
    (season.share() <= 0.0).then_some(RowClass { preset: None, canopy })
}

/// What several rows of one scene are on average.
pub fn mean_class<'a>(rows: impl Iterator<Item = &'a RowClass> + Clone) -> RowClass {
    let Some(first) = rows.clone().next() else { return RowClass::default() };
    let mean = |of: fn(&CanopyClass) -> Option<f64>| {
        let values: Vec<f64> = rows.clone().filter_map(|row| of(&row.canopy)).collect();
        (!values.is_empty()).then(|| rowscan_canopy::regression::mean(&values))
    };
    RowClass {
        canopy: CanopyClass {
            leaf_angle_deg: mean(|canopy| canopy.leaf_angle_deg),
            leaf_area_cm2: mean(|canopy| canopy.leaf_area_cm2),
            wood_share: mean(|canopy| canopy.wood_share),
            ..first.canopy.clone()
        },
        ..first.clone()
    }
}
