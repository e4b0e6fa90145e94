//! Copies of few distinct trees, posts, wires and facets are seen as the oracle sees them.

use rayon::ThreadPoolBuilder;
use rowscan_protocol::scan::Pose;
use rowscan_scenes::caster::{
    BeamFan, Beams, Caster, Class, Layers, ParallelBeams, Return, Scratch, brute::Oracle,
};
use rowscan_scenes::orchard::{OrchardParameters, Preset};
use rowscan_scenes::{Facet, Leaf, Orchard, Placement, Surface, Tree};

/// Three rows of four places of two distinct small trees, on posts and wires, with a gap.
fn few() -> OrchardParameters {
    let mut parameters = OrchardParameters {
        rows: Some(3),
        trees: Some(4),
        distinct_trees: Some(2),
        directions: Some(5),
        missing: vec![2].into(),
        ..OrchardParameters::of(Preset::FruitingWall)
    };
    parameters.tree.iterations = Some(7);
    parameters.trellis.post_every = Some(2);
    parameters
}

fn grow(parameters: &OrchardParameters) -> Orchard {
    Orchard::grow(parameters, 5, &|_, _| {}).unwrap()
}

/// The same orchard with every tree made where it stands.
fn spelled_out(orchard: &Orchard) -> Orchard {
    let trees: Vec<Tree> = orchard.trees().map(|tree| tree.into_owned()).collect();
    Orchard::from_trees(trees, orchard.length_m(), None, None).with_supports(orchard.supports().to_vec())
}

fn agree(ours: &[Return], theirs: &[Return]) -> usize {
    assert_eq!(ours.len(), theirs.len());
    for (beam, (ours, theirs)) in ours.iter().zip(theirs).enumerate() {
        assert_eq!(
            (ours.class, ours.tree, ours.organ),
            (theirs.class, theirs.tree, theirs.organ),
            "beam {beam}: {ours:?} {theirs:?}"
        );
        let near = (ours.range_m - theirs.range_m).abs() < 1e-6 || ours.range_m == theirs.range_m;
        assert!(near, "beam {beam}: {ours:?} {theirs:?}");
        assert!((ours.cos_incidence - theirs.cos_incidence).abs() < 1e-4, "beam {beam}: {ours:?} {theirs:?}");
    }
    ours.iter().filter(|found| found.is_hit()).count()
}

/// Odd places, so that no beam grazes an edge to the last bit.
const PLACES: [f64; 7] = [0.0137, 0.5171, 1.0031, 1.7713, 2.4197, 3.3331, 3.9973];

#[test]
fn copies_are_seen_where_they_stand_under_their_own_numbers() {
    let orchard = grow(&few());
    assert_eq!(orchard.distinct_trees().len(), 3, "two trees and the gap");
    assert_eq!((orchard.rows(), orchard.trees_per_row(), orchard.standing().len()), (3, 4, 12));
    let oracle = Oracle::new(&orchard);
    let (caster, fan) = (Caster::new(&orchard), BeamFan::from_degrees(-60.0, 0.5, 241));
    let mut scratch = Scratch::default();
    let mut found = vec![Return::MISS; fan.len()];
    let mut seen = std::collections::BTreeSet::new();
    for y_m in PLACES.into_iter().chain([-17.31, 402.77]) {
        let origin = Pose { x_m: -1.75, y_m, z_m: 1.6 };
        caster.cast(origin, &fan, &mut scratch, &mut found);
        agree(&found, &oracle.cast(origin, &fan));
        seen.extend(found.iter().map(|hit| hit.class as usize));
        seen.extend(found.iter().filter(|hit| hit.class == Class::Leaf).map(|hit| 100 + hit.tree as usize));
    }
    for class in [Class::Leaf, Class::Wood, Class::Ground, Class::None, Class::Post, Class::Wire] {
        assert!(seen.contains(&(class as usize)), "{class:?} was met: {seen:?}");
    }
    assert!(seen.iter().filter(|number| **number >= 100).count() > 6, "trees of several rows: {seen:?}");
}

#[test]
fn moving_and_parallel_beams_and_layers_see_copies_too() {
    let orchard = grow(&few());
    let (oracle, caster) = (Oracle::new(&orchard), Caster::new(&orchard));
    let fans: [Beams; 3] = [
        BeamFan::from_degrees(-40.0, 0.5, 220).advancing(1e-4).into(),
        ParallelBeams::lateral(0.1, 0.0311, 100).into(),
        BeamFan::from_degrees(-45.0, 0.7, 200).into(),
    ];
    let mut scratch = Scratch::default();
    let mut layers = Layers::default();
    for beams in &fans {
        let mut hits = 0;
        for y_m in PLACES {
            let origin =
                Pose { x_m: -1.75, y_m, z_m: if matches!(beams, Beams::Parallel(_)) { 0.0 } else { 1.6 } };
            caster.cast_layers(origin, beams, 3, &mut scratch, &mut layers);
            let nearest: Vec<Return> =
                beams.rays(origin).map(|(start, direction)| oracle.ray(start, direction)).collect();
            hits += agree(layers.nearest(), &nearest);
            for (beam, (start, direction)) in beams.rays(origin).enumerate() {
                agree(layers.leaves(beam), &oracle.leaves(start, direction, 3));
            }
        }
        assert!(hits > 200, "{hits}");
    }
}

#[test]
fn copies_cost_no_truth() {
    let orchard = grow(&few());
    let plain = spelled_out(&orchard);
    let truth = orchard.truth_of_row(1, Default::default());
    let areas: Vec<f64> = plain.trees().skip(4).take(4).map(|tree| tree.leaf_area_m2()).collect();
    assert_eq!(truth.trees.iter().map(|tree| tree.leaf_area_m2).collect::<Vec<_>>(), areas);
    assert_eq!(areas[2], 0.0, "the gap");
    let slabs: f64 = truth.slabs.iter().map(|slab| slab.leaf_area_m2).sum();
    assert!((slabs - truth.leaf_area_m2).abs() < 1e-9);
    assert!(truth.post_area_m2 > 0.5 && truth.wire_area_m2 > 0.1);
    assert_eq!(orchard.count(|tree| tree.leaves.len()), plain.count(|tree| tree.leaves.len()));
}

#[test]
fn copies_repeat_by_seed_whatever_the_threads() {
    let parameters = few();
    let grown: Vec<Orchard> = [1, 2, 7]
        .into_iter()
        .map(|threads| {
            ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| grow(&parameters))
        })
        .collect();
    assert!(grown.iter().all(|orchard| *orchard == grown[0]));
    let turns = |seed| -> Vec<u64> {
        let orchard = Orchard::grow(&parameters, seed, &|_, _| {}).unwrap();
        orchard.standing().map(|(_, placement)| placement.turn_deg().to_bits()).collect()
    };
    assert_ne!(turns(5), turns(6));
}

#[test]
fn facets_end_beams_and_carry_their_class() {
    let square = |x: f64, y: f64, z: f64, half: f64| {
        Leaf::new([
            [x, y - half, z - half],
            [x + 0.01, y + half, z - half],
            [x + 0.01, y + half, z + half],
            [x, y - half, z + half],
        ])
        .unwrap()
    };
    let facet = |surface, x, y, z| Facet { surface, polygon: square(x, y, z, 0.3) };
    let facets = vec![
        facet(Surface::Bark, 0.0, 0.5, 1.0),
        facet(Surface::Fruit, 0.4, 0.5, 1.9),
        facet(Surface::Post, 0.4, 0.5, 0.4),
        facet(Surface::Wire, 0.2, 1.2, 1.4),
    ];
    // One leaf before the bark, one behind it that no beam through the bark may count.
    let leaves = vec![square(-0.2, 0.5, 1.0, 0.1), square(0.3, 0.5, 1.0, 0.2)];
    let tree = Tree { leaves, facets, ..Tree::default() };
    let here = (0, Placement::HERE);
    let copy = (0, Placement::at([0.7, 0.9, 0.0]).turned(10.0));
    let orchard = Orchard::from_placed(vec![tree], vec![here, copy], 2.0, None, None);
    let (oracle, caster) = (Oracle::new(&orchard), Caster::new(&orchard));
    let beams = Beams::from(BeamFan::from_degrees(-50.0, 0.31, 300));
    let (mut scratch, mut layers) = (Scratch::default(), Layers::default());
    let mut classes = std::collections::BTreeSet::new();
    for y_m in [0.2713, 0.5519, 0.7001, 1.1313, 1.4477] {
        let origin = Pose { x_m: -1.5, y_m, z_m: 1.3 };
        caster.cast_layers(origin, &beams, 2, &mut scratch, &mut layers);
        let nearest: Vec<Return> =
            beams.rays(origin).map(|(start, direction)| oracle.ray(start, direction)).collect();
        agree(layers.nearest(), &nearest);
        classes.extend(nearest.iter().map(|hit| hit.class.name()));
        for (beam, (start, direction)) in beams.rays(origin).enumerate() {
            agree(layers.leaves(beam), &oracle.leaves(start, direction, 2));
        }
    }
    for class in ["leaf", "wood", "fruit", "post", "wire"] {
        assert!(classes.contains(class), "{class}: {classes:?}");
    }
}
