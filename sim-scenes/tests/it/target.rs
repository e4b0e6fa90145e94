//! Leaf area by season and by demand.

use std::collections::BTreeSet;

use rowscan_scenes::orchard::{OrchardParameters, Preset};
use rowscan_scenes::season::Season;
use rowscan_scenes::{GeneratorKind, GrowError, Orchard, TargetError};

fn spindle(target_lai: Option<f64>) -> OrchardParameters {
    let mut parameters =
        OrchardParameters { trees: Some(4), target_lai, ..OrchardParameters::of(Preset::Spindle) };
    parameters.tree.pruned = Some(true);
    parameters
}

fn grow(parameters: &OrchardParameters) -> Orchard {
    Orchard::grow(parameters, 2, &|_, _| {}).unwrap()
}

#[test]
fn a_target_is_reached_by_thinning_and_by_adding_and_it_is_said() {
    let grown = grow(&spindle(None)).truth();
    assert_eq!(grown.adjustment, None);
    let natural = grown.lai.unwrap();
    for factor in [0.3, 0.9, 1.2, 3.0] {
        let target = natural * factor;
        let orchard = grow(&spindle(Some(target)));
        let truth = orchard.truth();
        assert!((truth.lai.unwrap() / target - 1.0).abs() < 0.01, "{factor}: {:?}", truth.lai);
        let adjustment = truth.adjustment.unwrap();
        assert!((adjustment.grown_lai - natural).abs() < 1e-12 && adjustment.target_lai == target);
        let (thinned, seeded) = (adjustment.leaves_thinned, adjustment.leaves_seeded);
        assert_eq!((thinned > 0, seeded > 0), (factor < 1.0, factor > 1.0));
        let leaves: usize = grown.trees.iter().map(|tree| tree.leaves).sum();
        assert_eq!(orchard.count(|tree| tree.leaves.len()) + thinned, leaves + seeded);
        let json = serde_json::to_value(&truth).unwrap();
        assert!(json["target_lai"].is_number() && json["leaves_seeded"].is_number(), "{json}");
        // Nothing is added outside the envelope, and wood stays as it grew.
        let inside = |v: &[f64; 3]| v[0].abs() <= 1.05 + 1e-9 && (0.6 - 1e-9..=3.0 + 1e-9).contains(&v[2]);
        assert!(orchard.trees().all(|tree| tree.leaves.iter().flat_map(|leaf| leaf.outline()).all(inside)));
        // Up to twice its own leaves a tree's own wood bears them.
        assert_eq!(truth.wood_area_m2 == grown.wood_area_m2, factor <= 2.0, "{factor}");
        assert_eq!(orchard.foliage().unwrap().older_share, 0.0, "no leaf is added on old wood");
    }
}

#[test]
fn leaves_beyond_twice_a_trees_own_stand_on_shoots_that_are_added() {
    let natural = grow(&spindle(None));
    let of = |factor: f64| grow(&spindle(Some(factor * natural.truth().lai.unwrap())));
    let wood = |orchard: &Orchard| orchard.count(|tree| tree.wood.len());
    // Cells of 0.1 m with a leaf in them.
    let cells = |orchard: &Orchard| {
        let cell = |leaf: &rowscan_scenes::Leaf| leaf.centroid().map(|m| (m / 0.1).floor() as i32);
        orchard
            .trees()
            .flat_map(|tree| tree.leaves.iter().map(cell).collect::<Vec<_>>())
            .collect::<BTreeSet<_>>()
            .len()
    };
    let (fewer, eight) = (of(1.8), of(8.0));
    assert_eq!(wood(&fewer), wood(&natural));
    let leaves = natural.count(|tree| tree.leaves.len());
    let shoots = wood(&eight) - wood(&natural);
    let on_shoots = eight.count(|tree| tree.leaves.len()) - 2 * leaves;
    // Twelve a shoot; the least tree of four has its shoots earlier.
    let expected = on_shoots as f64 / 12.0;
    assert!((0.98 * expected..1.25 * expected).contains(&(shoots as f64)), "{shoots} {expected}");
    assert!(cells(&eight) as f64 > 1.5 * cells(&fewer) as f64, "{} {}", cells(&eight), cells(&fewer));
    let inside = |v: &[f64; 3]| v[0].abs() <= 1.05 + 1e-9 && (0.6 - 1e-9..=3.0 + 1e-9).contains(&v[2]);
    let ends = |tree: &rowscan_scenes::Tree| -> Vec<[f64; 3]> {
        tree.wood
            .iter()
            .filter(|wood| wood.radius_m() == 0.002)
            .flat_map(|wood| [wood.base(), wood.tip()])
            .collect()
    };
    assert!(eight.trees().flat_map(|tree| ends(&tree)).all(|point| inside(&point)));
    assert!(eight.trees().all(|tree| tree.leaves.iter().flat_map(|leaf| leaf.outline()).all(inside)));
    assert_eq!(eight.foliage().unwrap().older_share, 0.0);
}

#[test]
fn the_same_target_takes_the_same_leaves_on_any_number_of_threads() {
    let parameters = OrchardParameters { season: Season::Bloom, ..spindle(Some(0.9)) };
    let grown: Vec<Orchard> = [1, 3]
        .into_iter()
        .map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| grow(&parameters))
        })
        .collect();
    assert_eq!(grown[0], grown[1]);
}

#[test]
fn a_target_counts_copies() {
    let few = OrchardParameters { distinct_trees: Some(2), trees: Some(30), ..spindle(Some(0.7)) };
    let truth = grow(&few).truth();
    assert!((truth.lai.unwrap() / 0.7 - 1.0).abs() < 0.01, "{:?}", truth.lai);
}

#[test]
fn bare_trees_cannot_be_given_leaves() {
    let bare = OrchardParameters { season: Season::Dormant, ..spindle(Some(1.0)) };
    let error = Orchard::grow(&bare, 1, &|_, _| {}).unwrap_err();
    assert!(matches!(error, GrowError::Target(TargetError::Nothing { lacking: "leaves", .. })), "{error}");
    let wall = OrchardParameters { generator: Some(GeneratorKind::Analytic), ..spindle(Some(90.0)) };
    let error = Orchard::grow(&wall, 1, &|_, _| {}).unwrap_err();
    assert!(error.to_string().contains("trees without wood that grew here"), "{error}");
}

#[test]
fn seasons_rise_from_bare_to_full() {
    let area = |season| grow(&OrchardParameters { season, ..spindle(None) }).truth().leaf_area_m2;
    let areas: Vec<f64> = Season::ALL.iter().map(|season| area(*season)).collect();
    assert_eq!(areas[0], 0.0);
    assert!(areas[..6].windows(2).all(|pair| pair[0] < pair[1]), "{areas:?}");
    assert!(areas[6] < areas[5], "leaves fall");
}

/// Rows of copies are as far off as single trees, and look even.
#[test]
fn rows_of_a_few_distinct_trees_are_told() {
    let told = |distinct_trees: u32, trees: u32| {
        let parameters = OrchardParameters {
            distinct_trees: Some(distinct_trees),
            trees: Some(trees),
            ..OrchardParameters::of(Preset::Spindle)
        };
        grow(&parameters).remarks().iter().map(ToString::to_string).collect::<Vec<_>>()
    };
    for (distinct_trees, trees) in [(0, 9), (8, 9), (3, 3), (1, 1)] {
        assert_eq!(told(distinct_trees, trees), Vec::<String>::new(), "{distinct_trees} of {trees}");
    }
    for (distinct_trees, trees) in [(1, 9), (7, 9), (1, 2)] {
        let told = told(distinct_trees, trees);
        let expected = format!("orchard.distinct_trees: expected 8 or more, or 0, found {distinct_trees}");
        assert!(matches!(told.as_slice(), [one] if one.starts_with(&expected)), "{told:?}");
    }
}
