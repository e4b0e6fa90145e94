//! The truth that estimates are held against.

use proptest::prelude::*;
use rowscan_scenes::orchard::{OrchardParameters, Preset};
use rowscan_scenes::{Cylinder, Leaf, Orchard, Tree, TruthGrid};

fn grow(parameters: &OrchardParameters) -> Orchard {
    Orchard::grow(parameters, 6, &|_, _| {}).unwrap()
}

/// A rectangle in the plane x = 0.3.
fn panel(y: [f64; 2], z: [f64; 2]) -> Leaf {
    Leaf::new(vec![[0.3, y[0], z[0]], [0.3, y[1], z[0]], [0.3, y[1], z[1]], [0.3, y[0], z[1]]]).unwrap()
}

#[test]
fn one_leaf_over_the_border_by_hand() {
    // 0.3 m along the row by 0.5 m: from 1.85 to 2.15 in a row 2 m long. Slabs of 0.6 m: 0.6, 1.2, 1.8, 2.0.
    let leaves = vec![panel([1.85, 2.15], [0.9, 1.4])];
    let post = Cylinder::new([0.0, 1.0, 0.0], [0.0, 1.0, 2.0], 0.05).unwrap();
    let orchard = Orchard::from_trees(
        vec![Tree { leaves, wood: vec![post], ..Tree::default() }],
        2.0,
        Some(2.0),
        Some(4.0),
    );
    let truth = orchard.truth_of_row(0, TruthGrid { slab_m: 0.6, band_m: 0.25 });
    assert!((truth.leaf_area_m2 - 0.15).abs() < 1e-12);
    assert!((truth.wood_area_m2 - 0.2 * std::f64::consts::PI).abs() < 1e-12);
    assert!((truth.lai.unwrap() - 0.15 / 8.0).abs() < 1e-12);
    let slabs: Vec<f64> = truth.slabs.iter().map(|slab| slab.leaf_area_m2).collect();
    for (found, expected) in slabs.iter().zip([0.075, 0.0, 0.0, 0.075]) {
        assert!((found - expected).abs() < 1e-12, "{slabs:?}");
    }
    assert_eq!(truth.slabs.last().unwrap().y_to_m, 2.0);
    let leafy = truth.bands.iter().filter(|band| band.leaf_area_m2 > 0.0);
    let bands: Vec<(f64, f64)> = leafy.map(|band| (band.z_from_m, band.leaf_area_m2)).collect();
    for ((from, area), (z, expected)) in bands.iter().zip([(0.75, 0.03), (1.0, 0.075), (1.25, 0.045)]) {
        assert!((from - z).abs() < 1e-12 && (area - expected).abs() < 1e-12, "{bands:?}");
    }
    // The post: all of it at y = 1.0, in the second slab; below the leaf, bands hold wood only; each 0.25 m of 2 m.
    let wood: Vec<f64> = truth.slabs.iter().map(|slab| slab.wood_area_m2).collect();
    assert_eq!(wood, [0.0, truth.wood_area_m2, 0.0, 0.0]);
    for band in truth.bands.iter().filter(|band| band.z_to_m <= 2.0) {
        assert!((band.wood_area_m2 - truth.wood_area_m2 / 8.0).abs() < 1e-12, "{band:?}");
    }
    let tree = &truth.trees[0];
    assert_eq!(
        (tree.cell_ground_m2, tree.cell_lai()),
        (Some(8.0), tree.cell_leaf_area_m2.map(|m2| m2 / 8.0))
    );
    assert!((tree.cell_lai().unwrap() - 0.15 / 8.0).abs() < 1e-12);
    assert_eq!((tree.leaves, tree.y_m, tree.height_m), (1, Some(1.0), 2.0));
}

#[test]
fn leaf_inclinations_are_weighted_by_area() {
    // 1 m² level, 3 m² upright, 2 m² at 45 degrees.
    let level = Leaf::new(vec![[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 1.0, 1.0], [0.0, 1.0, 1.0]]).unwrap();
    let rise = 2f64.sqrt();
    let slant =
        Leaf::new(vec![[0.0, 0.0, 0.0], [rise, 0.0, rise], [rise, 1.0, rise], [0.0, 1.0, 0.0]]).unwrap();
    let leaves = vec![level, panel([0.0, 1.0], [0.0, 3.0]), slant];
    let truth = Orchard::from_organs(leaves, vec![], 2.0).truth();
    let (mean, sd) = (truth.leaf_angle_mean_deg.unwrap(), truth.leaf_angle_sd_deg.unwrap());
    // (0 + 3 · 90 + 2 · 45) / 6 = 60; squares (3 · 8100 + 2 · 2025) / 6 = 4725.
    assert!((mean - 60.0).abs() < 1e-9, "{mean}");
    assert!((sd - 1125f64.sqrt()).abs() < 1e-9, "{sd}");
    let bare = Orchard::from_organs(vec![], vec![], 2.0).truth();
    assert_eq!((bare.leaf_angle_mean_deg, bare.leaf_angle_sd_deg), (None, None));
}

#[test]
fn a_scene_without_spacing_has_no_leaf_area_index() {
    let truth = Orchard::from_organs(vec![panel([0.0, 1.0], [0.0, 1.0])], vec![], f64::INFINITY).truth();
    assert_eq!((truth.lai, truth.trees[0].lai, truth.seed), (None, None, None));
    assert!(truth.slabs.is_empty());
    assert_eq!(truth.leaf_area_m2, 1.0);
}

#[test]
fn slabs_bands_and_trees_each_sum_to_the_row() {
    for preset in [Preset::Spindle, Preset::Paper] {
        let mut parameters = OrchardParameters { missing: vec![1].into(), ..OrchardParameters::of(preset) };
        parameters.trees = Some(4);
        let orchard = grow(&parameters);
        for grid in [TruthGrid::default(), TruthGrid { slab_m: 0.37, band_m: 0.11 }] {
            let truth = orchard.truth_of_row(0, grid);
            assert!(truth.leaf_area_m2 > 1.0);
            for sum in [
                truth.slabs.iter().map(|slab| slab.leaf_area_m2).sum::<f64>(),
                truth.bands.iter().map(|band| band.leaf_area_m2).sum(),
                truth.trees.iter().map(|tree| tree.leaf_area_m2).sum(),
            ] {
                assert!((sum - truth.leaf_area_m2).abs() < 1e-9, "{sum} of {}", truth.leaf_area_m2);
            }
            for sum in [
                truth.slabs.iter().map(|slab| slab.wood_area_m2).sum::<f64>(),
                truth.bands.iter().map(|band| band.wood_area_m2).sum(),
            ] {
                assert!((sum - truth.wood_area_m2).abs() < 1e-9);
            }
            assert!(truth.slabs.windows(2).all(|pair| pair[0].y_to_m == pair[1].y_from_m));
            assert!(truth.slabs.iter().all(|slab| slab.leaf_area_m2 >= -1e-12));
            assert_eq!(truth.trees[1].leaf_area_m2, 0.0);
            let ground = truth.trees.len() as f64
                * orchard.tree_spacing_m().unwrap()
                * orchard.row_spacing_m().unwrap();
            assert!((truth.lai.unwrap() * ground - truth.leaf_area_m2).abs() < 1e-9);
        }
    }
}

#[test]
fn cells_hold_what_stands_between_a_trees_borders() {
    // Three trees 2 m apart; the middle one's only leaf reaches half a metre into the third one's cell.
    let leaf = Leaf::new(panel([3.0, 4.5], [1.0, 2.0]).outline().to_vec()).unwrap();
    let trees = vec![Tree::default(), Tree { leaves: vec![leaf], ..Tree::default() }, Tree::default()];
    let truth = Orchard::from_trees(trees, 6.0, Some(2.0), None).truth();
    let cells: Vec<f64> = truth.trees.iter().map(|tree| tree.cell_leaf_area_m2.unwrap()).collect();
    assert!((cells[1] - 1.0).abs() < 1e-12 && (cells[2] - 0.5).abs() < 1e-12 && cells[0] == 0.0, "{cells:?}");
    assert!((truth.trees[1].leaf_area_m2 - 1.5).abs() < 1e-12);
}

#[test]
fn truth_follows_positions_and_rows() {
    let parameters = OrchardParameters { trees: Some(4), rows: Some(2), ..OrchardParameters::default() };
    let moved = OrchardParameters { order: vec![2, 0, 3, 1].into(), ..parameters.clone() };
    let (straight, moved) = (grow(&parameters), grow(&moved));
    let areas = |orchard: &Orchard, row| -> Vec<f64> {
        let truth = orchard.truth_of_row(row, TruthGrid::default());
        truth.trees.iter().map(|tree| tree.leaf_area_m2).collect()
    };
    let first = areas(&straight, 0);
    assert_eq!(areas(&moved, 0), [first[2], first[0], first[3], first[1]]);
    assert_ne!(first, areas(&straight, 1));
    assert!(areas(&straight, 2).is_empty());
}

proptest! {
    /// The slab area of a tilted triangle against its own closed form: the area below y grows as the square of the distance from
    /// the lowest vertex, scaled to 1 at the middle one.
    #[test]
    fn a_triangle_is_cut_as_its_similar_triangle(
        y0 in 0.0..1.0f64, rise in 0.1..2.0f64, more in 0.0..1.0f64, x in -1.0..1.0f64, z in -1.0..1.0f64, cut in 0.0..1.0f64,
    ) {
        let (a, b, c) = ([0.0, y0, 0.0], [x, y0 + rise, z + 2.0], [-z, y0 + rise + more, x - 2.0]);
        let leaf = Leaf::new(vec![a, b, c]).unwrap();
        // The part of the triangle below the middle vertex's level: its share is rise / (rise + more).
        let share = rise / (rise + more) * cut * cut;
        let slab_m = y0 + rise * cut;
        let orchard = Orchard::from_organs(vec![leaf.clone()], vec![], 2.0 * slab_m + 10.0);
        let truth = orchard.truth_of_row(0, TruthGrid { slab_m, band_m: 0.3 });
        prop_assert!((truth.slabs[0].leaf_area_m2 - share * leaf.area_m2()).abs() < 1e-9 * leaf.area_m2().max(1.0));
        let bands: f64 = truth.bands.iter().map(|band| band.leaf_area_m2).sum();
        prop_assert!((bands - leaf.area_m2()).abs() < 1e-12);
    }
}
