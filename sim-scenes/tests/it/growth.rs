//! Whole orchards: the same on any number of threads, a tree for every place, presets as described.

use rayon::ThreadPoolBuilder;
use rowscan_scenes::growth::{MatrixSource, RuleSource};
use rowscan_scenes::orchard::{OrchardParameters, Preset};
use rowscan_scenes::{GeneratorKind, GrowError, Orchard, Tree};

fn grow(parameters: &OrchardParameters, seed: u64) -> Orchard {
    Orchard::grow(parameters, seed, &|_, _| {}).unwrap()
}

/// FNV-1a over the bits of every coordinate and radius.
fn fingerprint(orchard: &Orchard) -> u64 {
    let leaf_bits = |tree: &Tree| -> Vec<u64> {
        let outlines =
            tree.leaves.iter().flat_map(|leaf| leaf.outline().iter().flatten().map(|c| c.to_bits()));
        let wood = tree.wood.iter().flat_map(|piece| {
            piece.base().into_iter().chain(piece.tip()).chain([piece.radius_m()]).map(f64::to_bits)
        });
        outlines.chain(wood).chain([u64::MAX]).collect()
    };
    let bits = orchard.trees().flat_map(|tree| leaf_bits(&tree));
    bits.fold(0xcbf2_9ce4_8422_2325, |hash, word| (hash ^ word).wrapping_mul(0x0100_0000_01b3))
}

fn small(preset: Preset) -> OrchardParameters {
    let mut parameters = OrchardParameters { trees: Some(5), rows: Some(2), ..OrchardParameters::of(preset) };
    parameters.tree.iterations = Some(8);
    parameters.tree.leaf_twist_deg = Some(20.0);
    parameters.tree.shady_percent = Some(70.0);
    parameters
}

#[test]
fn the_same_seed_gives_the_same_bytes_on_1_2_and_7_threads() {
    let mut parameters = small(Preset::Spindle);
    for scope in ["tree", "orchard"] {
        parameters.tree.shady_scope = Some(match scope {
            "tree" => rowscan_scenes::growth::shade::ShadeScope::Tree,
            _ => rowscan_scenes::growth::shade::ShadeScope::Orchard,
        });
        let prints: Vec<u64> = [1, 2, 7]
            .into_iter()
            .map(|threads| {
                let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| fingerprint(&grow(&parameters, 11)))
            })
            .collect();
        assert!(prints.iter().all(|print| *print == prints[0]), "{scope}: {prints:x?}");
        assert_ne!(prints[0], fingerprint(&grow(&parameters, 12)));
    }
}

/// Pins the default scene's recipe. If this changes, every orchard anyone has grown changes: say so in the release notes.
#[test]
fn the_default_row_is_the_one_it_has_always_been() {
    let orchard = grow(&OrchardParameters::of(Preset::Spindle), 1);
    let leaves: usize = orchard.trees().map(|tree| tree.leaves.len()).sum();
    assert_eq!((leaves, fingerprint(&orchard)), (PINNED_LEAVES, PINNED_FINGERPRINT));
}

const PINNED_LEAVES: usize = 57_836;
const PINNED_FINGERPRINT: u64 = 30_645_423_821_107_490;

#[test]
fn every_place_has_its_own_tree_in_the_middle_of_its_cell() {
    let parameters = small(Preset::Spindle);
    let orchard = grow(&parameters, 3);
    assert_eq!((orchard.trees().len(), orchard.rows(), orchard.trees_per_row()), (10, 2, 5));
    assert_eq!(orchard.length_m(), 7.5);
    for (number, tree) in orchard.trees().enumerate() {
        let foot = [(number / 5) as f64 * 4.0, ((number % 5) as f64 + 0.5) * 1.5, 0.0];
        assert_eq!(tree.wood[0].base(), foot);
    }
    let areas: Vec<u64> = orchard.trees().map(|tree| tree.leaf_area_m2().to_bits()).collect();
    let distinct: std::collections::BTreeSet<_> = areas.iter().collect();
    assert_eq!(distinct.len(), 10, "rows and places have their own seeds");
}

#[test]
fn order_moves_whole_trees_and_missing_leaves_gaps() {
    let straight = grow(&small(Preset::Spindle), 3);
    let order = vec![4, 2, 0, 1, 3];
    let moved = grow(
        &OrchardParameters { order: order.clone().into(), missing: vec![1].into(), ..small(Preset::Spindle) },
        3,
    );
    for row in 0..2 {
        for (place, tree) in order.iter().enumerate() {
            let (there, here) =
                (&straight.tree(row * 5 + *tree as usize).unwrap(), &moved.tree(row * 5 + place).unwrap());
            if place == 1 {
                assert!(here.leaves.is_empty() && here.wood.is_empty());
                continue;
            }
            assert_eq!((here.leaves.len(), here.wood.len()), (there.leaves.len(), there.wood.len()));
            let shift = (place as f64 - f64::from(*tree)) * 1.5;
            let (from, to) = (there.leaves[7].outline()[0], here.leaves[7].outline()[0]);
            assert!((to[0] - from[0]).abs() < 1e-12 && (to[1] - from[1] - shift).abs() < 1e-12);
        }
    }
}

#[test]
fn a_stricter_shady_threshold_leaves_fewer_leaves_and_101_leaves_all() {
    let leaves = |percent: f64| {
        let mut parameters = OrchardParameters { trees: Some(2), ..OrchardParameters::of(Preset::Paper) };
        parameters.tree.shady_percent = Some(percent);
        parameters.tree.iterations = Some(11);
        let orchard = grow(&parameters, 4);
        orchard.trees().map(|tree| tree.leaves.len()).collect::<Vec<_>>()
    };
    let kept: Vec<_> = [40.0, 60.0, 70.0, 80.0, 100.1].into_iter().map(leaves).collect();
    for pair in kept.windows(2) {
        assert!(pair[0].iter().zip(&pair[1]).all(|(strict, mild)| strict < mild), "{kept:?}");
    }
    assert_eq!(kept[4], leaves(101.0));
}

#[test]
fn a_branching_matrix_equal_to_the_first_keeps_the_law_of_growth() {
    // The draws differ, the law does not: mean number of growth units over many trees, by a two-sample t-test at 4 sigma.
    let mean = |branching: Option<MatrixSource>| {
        let mut parameters = OrchardParameters { trees: Some(400), ..OrchardParameters::of(Preset::Paper) };
        parameters.tree.iterations = Some(6);
        parameters.tree.branching_transitions = branching.map(rowscan_scenes::growth::BranchingSource::Own);
        let counts: Vec<f64> = grow(&parameters, 9).trees().map(|tree| tree.wood.len() as f64).collect();
        let mean = counts.iter().sum::<f64>() / 400.0;
        let variance = counts.iter().map(|c| (c - mean).powi(2)).sum::<f64>() / 399.0;
        (mean, variance / 400.0)
    };
    let (one, own) = (mean(None), mean(Some(MatrixSource::named("P_fuji"))));
    assert!((one.0 - own.0).abs() < 4.0 * (one.1 + own.1).sqrt(), "{one:?} {own:?}");
    assert_ne!(one.0, own.0);
    let edges = mean(Some(MatrixSource::named("P_fuji_branching")));
    assert!(edges.0 > 1.0 && edges.0 != own.0);
}

#[test]
fn an_explosion_is_an_error_that_says_which_tree_and_what_to_do() {
    let generator = Some(GeneratorKind::Hmt);
    let mut parameters =
        OrchardParameters { trees: Some(4), generator, ..OrchardParameters::of(Preset::Spindle) };
    parameters.tree.rules = Some(RuleSource::Inline(vec!["++++".into(); 4]));
    parameters.tree.iterations = Some(40);
    parameters.tree.max_metamers = Some(20_000);
    let error = Orchard::grow(&parameters, 1, &|_, _| {}).unwrap_err();
    assert!(matches!(error, GrowError::Exploded { row: 0, tree: 0, limit: 20_000, .. }), "{error}");
    assert!(error.to_string().contains("orchard.tree.max_metamers"));
    let mut trained = OrchardParameters { trees: Some(2), ..OrchardParameters::of(Preset::Spindle) };
    trained.training.side_shoots = Some(20.0);
    trained.tree.max_metamers = Some(20_000);
    let error = Orchard::grow(&trained, 1, &|_, _| {}).unwrap_err();
    assert!(matches!(error, GrowError::Exploded { tree: 0, limit: 20_000, .. }), "{error}");
}

#[test]
fn leaf_area_grows_with_the_seasons() {
    let median = |iterations: u32| {
        let mut parameters = OrchardParameters { trees: Some(40), ..OrchardParameters::of(Preset::Paper) };
        parameters.tree.iterations = Some(iterations);
        let mut areas: Vec<f64> = grow(&parameters, 2).trees().map(|tree| tree.leaf_area_m2()).collect();
        areas.sort_by(f64::total_cmp);
        areas[20]
    };
    let medians: Vec<f64> = [5, 7, 9, 11].into_iter().map(median).collect();
    assert!(medians.windows(2).all(|pair| pair[0] < pair[1]), "{medians:?}");
}
