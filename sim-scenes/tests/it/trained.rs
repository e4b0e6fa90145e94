//! Trained trees: each system has the form it is called after, and sits in the published frames.

use rowscan_scenes::orchard::{OrchardParameters, Preset};
use rowscan_scenes::{CanopyForm, GeneratorKind, Leaf, Orchard, Tree, builtin};

fn grow(parameters: &OrchardParameters, seed: u64) -> Orchard {
    Orchard::grow(parameters, seed, &|_, _| {}).unwrap()
}

fn of(preset: Preset, seed: u64) -> Orchard {
    grow(&OrchardParameters::of(preset), seed)
}

/// Height and width (metres) that the sources of docs/orchards.md give for a system.
fn published_size(preset: Preset) -> Option<([f64; 2], [f64; 2])> {
    Some(match preset {
        Preset::Spindle => ([2.4, 3.5], [0.9, 1.8]),
        Preset::TallSpindle => ([3.0, 3.7], [0.7, 1.3]),
        Preset::Mature => ([3.0, 3.8], [1.2, 2.2]),
        Preset::Vase => ([2.5, 4.0], [2.0, 4.0]),
        Preset::FruitingWall => ([2.5, 3.5], [0.5, 1.0]),
        Preset::Hedge => ([1.8, 2.5], [0.7, 1.3]),
        Preset::Paper => return None,
    })
}

#[test]
fn every_system_sits_in_the_published_frames_for_several_seeds() {
    let within = |value: f64, [low, high]: [f64; 2], what: &str| {
        assert!((low..=high).contains(&value), "{what}: {value} is not within {low} to {high}");
    };
    for (preset, size) in Preset::ALL.iter().filter_map(|preset| Some((*preset, published_size(*preset)?))) {
        for seed in [1, 101, 202] {
            let orchard = of(preset, seed);
            let form = CanopyForm::of_row(&orchard, 0).unwrap();
            let what = |quantity: &str| format!("{preset}, seed {seed}: {quantity}");
            within(orchard.truth().lai.unwrap(), [1.0, 3.0], &what("LAI"));
            within(form.leaf_area_density_m2_m3, [1.8, 5.4], &what("leaf area density"));
            within(form.inclination_deg, [30.0, 60.0], &what("inclination"));
            within(form.height_m, size.0, &what("height"));
            within(form.width_m, size.1, &what("width"));
            within(form.gap_fraction, [0.1, 0.7], &what("gap fraction"));
            // No leaf angle makes less than flat ones by the inclination, or more than erect ones.
            within(form.projection, [0.2, 0.64], &what("G(0)"));
        }
    }
}

#[test]
fn leaves_stand_on_the_wood_of_the_season_everywhere_but_in_the_paper() {
    for preset in Preset::ALL {
        let shares = of(*preset, 3).foliage().unwrap();
        match preset {
            Preset::Paper => assert!(shares.older_share > 0.3, "{shares:?}"),
            _ => assert!(shares.older_share == 0.0 && shares.spur_share > 0.2, "{preset}: {shares:?}"),
        }
        let cut = OrchardParameters {
            generator: Some(GeneratorKind::Hmt),
            trees: Some(2),
            ..OrchardParameters::of(*preset)
        };
        let older = grow(&cut, 3).foliage().unwrap().older_share;
        assert_eq!(older == 0.0, *preset != Preset::Paper, "{preset} by hidden Markov trees: {older}");
    }
    let mut kept = OrchardParameters::of(Preset::Paper);
    kept.tree.leaf_lifetime = Some(rowscan_scenes::growth::LeafLifetime::CurrentSeason);
    assert_eq!(grow(&kept, 3).foliage().unwrap().older_share, 0.0);
}

/// Middle of the thick wood at a height, relative to the foot.
fn leader_at(tree: &Tree, height_m: f64) -> Option<[f64; 2]> {
    let [foot_x, foot_y, _] = tree.wood.first()?.base();
    let crossing = tree.wood.iter().filter(|piece| piece.base()[2] <= height_m && piece.tip()[2] > height_m);
    let thickest = crossing.max_by(|a, b| a.radius_m().total_cmp(&b.radius_m()))?;
    let share = (height_m - thickest.base()[2]) / (thickest.tip()[2] - thickest.base()[2]);
    let at = |axis: usize| thickest.base()[axis] + share * (thickest.tip()[axis] - thickest.base()[axis]);
    Some([at(0) - foot_x, at(1) - foot_y])
}

#[test]
fn a_spindle_has_a_leader_to_its_top_and_a_vase_has_none() {
    for seed in 1..=3 {
        for tree in of(Preset::Spindle, seed).trees() {
            for height_m in [0.3, 1.0, 2.0, 2.6] {
                let [x, y] = leader_at(&tree, height_m).unwrap();
                assert!(x.hypot(y) < 0.4, "seed {seed}: the leader is {x} {y} off at {height_m} m");
            }
        }
        for tree in of(Preset::Vase, seed).trees() {
            let [x, y] = leader_at(&tree, 2.0).unwrap();
            assert!(x.hypot(y) > 0.4, "seed {seed}: a leader stands in the open centre, {x} {y}");
        }
    }
}

/// Leaf area by what `of` says of a leaf in a tree's own frame.
fn area_where(tree: &Tree, of: impl Fn([f64; 3]) -> bool) -> f64 {
    let [x, y, _] = tree.wood[0].base();
    let here = |leaf: &&Leaf| {
        let at = leaf.centroid();
        of([at[0] - x, at[1] - y, at[2]])
    };
    tree.leaves.iter().filter(here).map(Leaf::area_m2).sum()
}

#[test]
fn a_spindle_is_a_cone_a_wall_is_flat_and_a_vase_is_open() {
    let mean_out = |tree: &Tree, low: f64, high: f64| {
        let [x, y, _] = tree.wood[0].base();
        let slice = tree.leaves.iter().filter(|leaf| (low..high).contains(&leaf.centroid()[2]));
        let out = slice.map(|leaf| (leaf.centroid()[0] - x).hypot(leaf.centroid()[1] - y));
        let out: Vec<f64> = out.collect();
        out.iter().sum::<f64>() / out.len() as f64
    };
    let spindle = of(Preset::Spindle, 5);
    let mean = |low, high| spindle.trees().map(|tree| mean_out(&tree, low, high)).sum::<f64>() / 12.0;
    assert!(mean(0.8, 1.4) > 1.25 * mean(2.2, 2.8), "{} {}", mean(0.8, 1.4), mean(2.2, 2.8));
    for tree in of(Preset::FruitingWall, 5).trees() {
        let whole = tree.leaf_area_m2();
        assert_eq!(area_where(&tree, |[x, ..]| x.abs() > 0.5), 0.0, "sheared");
        assert!(area_where(&tree, |[_, y, _]| y.abs() > 0.25) > 0.3 * whole, "arms reach along the wires");
    }
    for tree in of(Preset::Vase, 5).trees() {
        // Within half of the cone that is cut free every winter stands little: what the season grew into it.
        let open = |[x, y, z]: [f64; 3]| z > 0.9 && x.hypot(y) < 0.5 * 26f64.to_radians().tan() * (z - 0.9);
        assert!(area_where(&tree, open) < 0.05 * tree.leaf_area_m2());
    }
}

#[test]
fn arms_of_a_palmette_lie_on_the_wires() {
    let orchard = of(Preset::FruitingWall, 2);
    for tree in orchard.trees() {
        let level = |height_m: f64| -> f64 {
            let near = tree.wood.iter().filter(|piece| (piece.base()[2] - height_m).abs() < 0.08);
            let along =
                near.filter(|piece| (piece.tip()[1] - piece.base()[1]).abs() > 0.9 * piece.length_m());
            along.map(|piece| piece.length_m()).sum()
        };
        // Two arms of some 0.4 m a wire; between wires only chance lies that flat along the row.
        let (wires, between): (f64, f64) =
            ([1.1, 1.6, 2.1].map(level).iter().sum(), [1.35, 1.85, 2.35].map(level).iter().sum());
        assert!(wires > 1.2 && wires > between, "{wires} m on the wires, {between} m between them");
    }
}

#[test]
fn petioles_end_outside_the_wood_that_bears_them() {
    for preset in [Preset::Paper, Preset::Spindle] {
        let mut parameters = OrchardParameters { trees: Some(1), ..OrchardParameters::of(preset) };
        // Thick trunks, and petioles of which 120 mm would swallow every one.
        parameters.tree.trunk_floor_diameter_m = Some(0.12);
        let orchard = grow(&parameters, 1);
        let tree = orchard.tree(0).unwrap();
        let trunk = tree.wood[0];
        let [x, y, _] = trunk.base();
        let (low, high) = (trunk.base()[2], trunk.tip()[2]);
        for leaf in tree.leaves.iter().filter(|leaf| (low..high).contains(&leaf.outline()[0][2])) {
            let [foot_x, foot_y, _] = leaf.outline()[0];
            let off = (foot_x - x).hypot(foot_y - y);
            assert!(off > trunk.radius_m(), "{preset}: a blade begins {off} m from the middle of the trunk");
        }
    }
}

#[test]
fn stiff_wood_stands_up_and_a_heavy_crop_pulls_it_down() {
    let mean_height = |young_gpa: f64, crop_per_spur: f64| {
        let mut parameters = OrchardParameters { trees: Some(4), ..OrchardParameters::of(Preset::Spindle) };
        parameters.training.young_gpa = Some(young_gpa);
        parameters.training.crop_per_spur = Some(crop_per_spur);
        let orchard = grow(&parameters, 4);
        let leaves: Vec<f64> = orchard
            .trees()
            .flat_map(|t| t.leaves.iter().map(|l| l.centroid()[2]).collect::<Vec<_>>())
            .collect();
        leaves.iter().sum::<f64>() / leaves.len() as f64
    };
    let (stiff, usual, laden) = (mean_height(500.0, 0.3), mean_height(5.0, 0.3), mean_height(5.0, 1.5));
    assert!(stiff > usual && usual > laden, "{stiff} {usual} {laden}");
}

#[test]
fn a_palmette_without_wires_is_refused() {
    let mut parameters = OrchardParameters::of(Preset::FruitingWall);
    parameters.trellis.wires = Some(0);
    let error = parameters.validate().unwrap_err().to_string();
    assert!(error.contains("orchard.training.form") && error.contains("orchard.trellis.wires"), "{error}");
}

#[test]
fn every_preset_has_a_scene_of_its_name() {
    for preset in Preset::NAMES {
        assert!(builtin::text(preset).is_some(), "{preset}");
    }
}
