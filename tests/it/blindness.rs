//! No truth reaches an estimate: when trees change places in the scene, estimates from the bytes alone follow them.

use crate::common;

use common::small_scene;
use rowscan_protocol::model;
use rowscan_scenes::{GeneratorKind, Scene};
use rowscan_study::trial::Trial;

fn run(scene: Scene) -> Trial {
    Trial::run(scene, model::by_name("lms111").expect("known"), None).expect("it runs")
}

/// Trees so far apart that they do not hide each other.
fn sparse(order: &[u32]) -> Scene {
    let mut scene = small_scene();
    // Trained trees are much alike; these are not.
    scene.orchard.generator = Some(GeneratorKind::Hmt);
    scene.orchard.trees = u32::try_from(order.len()).ok();
    scene.orchard.tree_spacing_m = Some(4.0);
    scene.orchard.order = order.to_vec().into();
    scene
}

#[test]
fn estimates_follow_trees_to_their_new_places() {
    let planted = run(sparse(&[0, 1, 2, 3]));
    let moved = run(sparse(&[2, 0, 3, 1]));
    for (place, tree) in [2, 0, 3, 1].into_iter().enumerate() {
        let (before, after) = (&planted.estimate.trees[tree], &moved.estimate.trees[place]);
        let (truth_before, truth_after) = (&planted.truth.trees[tree], &moved.truth.trees[place]);
        assert!((truth_before.leaf_area_m2 - truth_after.leaf_area_m2).abs() < 1e-9, "the same tree moved");
        let relative = (after.impacted_total_area_m2 - before.impacted_total_area_m2).abs()
            / before.impacted_total_area_m2;
        // Spacing is a whole number of scan steps, so the same lines cut the same leaves.
        assert!(relative < 0.02, "tree {tree} at place {place}: I_T off by {relative:.3}");
    }
    let areas: Vec<f64> = planted.truth.trees.iter().map(|tree| tree.leaf_area_m2).collect();
    let spread =
        areas.iter().copied().fold(f64::MIN, f64::max) / areas.iter().copied().fold(f64::MAX, f64::min);
    assert!(spread > 1.2, "trees too alike to tell whether estimates follow: {areas:?}");
}

#[test]
fn a_missing_tree_leaves_a_gap_in_the_estimate() {
    let mut scene = sparse(&[0, 1, 2, 3]);
    scene.orchard.missing = vec![2].into();
    let trial = run(scene);
    let gap = &trial.estimate.trees[2];
    assert!(gap.impacted_total_area_m2 < 0.02, "I_T of the gap: {}", gap.impacted_total_area_m2);
    assert!(trial.estimate.trees[1].impacted_total_area_m2 > 0.2);
}
