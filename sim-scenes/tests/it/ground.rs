//! Ground and rows: soil, grass, gaps, young trees and headlands; told apart, and nothing where they are off.

use rowscan_protocol::rig::Attitude;
use rowscan_protocol::scan::Pose;
use rowscan_scenes::caster::brute::Oracle;
use rowscan_scenes::orchard::{ByRow, OrchardParameters, Preset};
use rowscan_scenes::{BeamFan, Caster, Class, GroundOverrides, Orchard, Return, Scene, Scratch, Surface};

fn grow(parameters: &OrchardParameters) -> Orchard {
    Orchard::grow(parameters, 3, &|_, _| {}).unwrap()
}

fn small() -> OrchardParameters {
    let mut parameters =
        OrchardParameters { trees: Some(3), rows: Some(2), ..OrchardParameters::of(Preset::Spindle) };
    parameters.tree.iterations = Some(4);
    parameters
}

fn rough() -> OrchardParameters {
    let ground = GroundOverrides {
        roughness_m: Some(0.03),
        slope_deg: Some(4.0),
        grass_height_m: Some(0.12),
        grass_per_m2: Some(60.0),
        weed_height_m: Some(0.3),
        ..GroundOverrides::default()
    };
    OrchardParameters { ground, ..small() }
}

/// Lines of a fan past rough ground against the oracle; how many returns of each class.
fn compare(fan: &BeamFan, lines: u32) -> impl Fn(Class) -> usize {
    let orchard = grow(&rough());
    let (oracle, caster) = (Oracle::new(&orchard), Caster::new(&orchard));
    let (mut scratch, mut found) = (Scratch::default(), vec![Return::MISS; fan.len()]);
    let mut counts = [0usize; 8];
    for k in 0..lines {
        // The first line lies in an edge of the soil's cells.
        let pose = Pose { x_m: -1.9 + 0.013 * f64::from(k), y_m: 0.137 * f64::from(k) - 1.0, z_m: 1.6 };
        caster.cast(pose, fan, &mut scratch, &mut found);
        for (beam, (fast, slow)) in found.iter().zip(oracle.cast(pose, fan)).enumerate() {
            assert_eq!((fast.class, fast.tree), (slow.class, slow.tree), "line {k}, beam {beam}");
            let off_m = (fast.range_m - slow.range_m).abs();
            assert!(fast.range_m == slow.range_m || off_m < 1e-6, "line {k}, beam {beam}: {off_m}");
            counts[fast.class as usize] += 1;
        }
    }
    move |class| counts[class as usize]
}

#[test]
fn every_return_from_soil_and_grass_is_the_oracles() {
    let still = BeamFan::from_degrees(-100.0, 1.7, 80);
    let attitude = Attitude { yaw_rad: 0.3, pitch_rad: -0.2, roll_rad: 0.05 };
    let leaning = still.clone().leaning(attitude.axes());
    for (fan, lines) in [(still.clone().advancing(0.003), 40), (still, 40), (leaning, 3)] {
        let met = compare(&fan, lines);
        let counts = [met(Class::Ground), met(Class::Grass), met(Class::Leaf)].map(|count| count as u32);
        assert!(counts[0] > 5 * lines && counts[1] > lines && counts[2] > lines, "{counts:?}");
    }
}

/// Soil alone, in cells of a quarter of a metre, whose corners and edges binary numbers hold.
fn clods() -> Orchard {
    let ground =
        GroundOverrides { roughness_m: Some(0.05), cell_m: Some(0.25), ..GroundOverrides::default() };
    let layout = OrchardParameters { trees: Some(4), tree_spacing_m: Some(1.0), ..small() };
    let orchard = grow(&OrchardParameters { ground, row_spacing_m: Some(4.0), ..layout });
    Orchard::from_trees(vec![], orchard.length_m(), None, None).with_ground(orchard.ground().clone())
}

/// Beams that pass exactly through corners and along edges, where a triangle that is looked at alone may be missed by rounding.
#[test]
fn nothing_passes_between_the_triangles_of_the_soil() {
    let orchard = clods();
    let (oracle, caster) = (Oracle::new(&orchard), Caster::new(&orchard));
    let soil = &orchard.ground().facets;
    let mut scratch = Scratch::default();
    let mut found = [Return::MISS];
    let mut count = 0;
    for facet in soil.iter().filter(|facet| facet.polygon.outline().iter().all(|v| v[0] > 0.2 && v[0] < 4.0))
    {
        let [a, b, c] = facet.polygon.outline() else { panic!("a triangle") };
        let middle = |p: &[f64; 3], q: &[f64; 3]| std::array::from_fn(|i| 0.5 * (p[i] + q[i]));
        for target in [*a, middle(a, b), middle(b, c), middle(c, a)] {
            let pose = Pose { x_m: 1.75, y_m: target[1], z_m: 1.6 };
            let (x, z) = (target[0] - pose.x_m, target[2] - pose.z_m);
            let fan = BeamFan::from_degrees(z.atan2(x).to_degrees(), 1.0, 1);
            caster.cast(pose, &fan, &mut scratch, &mut found);
            let slow = oracle.cast(pose, &fan)[0];
            let range_m = x.hypot(z);
            // Another clod may stand before it; behind it lies only the plane.
            assert!(slow.range_m < range_m + 1e-6, "oracle {slow:?}, {target:?} at {range_m}");
            assert!((found[0].range_m - slow.range_m).abs() < 1e-6, "{:?}, oracle {slow:?}", found[0]);
            count += 1;
        }
    }
    assert!(count > 1000, "{count}");
}

#[test]
fn grass_is_told_apart_and_changes_neither_leaf_nor_wood() {
    let (bare, grown) = (grow(&small()), grow(&rough()));
    let (without, with) = (bare.truth(), grown.truth());
    assert!(without.grass_area_m2 == 0.0 && with.grass_area_m2 > 0.5);
    assert_eq!(with.leaf_area_m2, without.leaf_area_m2);
    assert!((with.wood_area_m2 / without.wood_area_m2 - 1.0).abs() < 1e-9);
    let blades: f64 = grown
        .ground()
        .facets
        .iter()
        .filter(|facet| facet.surface == Surface::Grass)
        .map(|facet| facet.polygon.area_m2())
        .sum();
    let of_rows: f64 =
        (0..2).map(|row| grown.truth_of_row(row, rowscan_scenes::TruthGrid::default()).grass_area_m2).sum();
    assert!((blades - of_rows).abs() < 1e-9, "each blade belongs to one row");
}

#[test]
fn a_level_bare_ground_is_the_plane_bit_for_bit() {
    let orchard = grow(&small());
    assert!(orchard.ground().facets.is_empty() && orchard.ground().plane_m == 0.0);
    let lowered = orchard.clone().with_ground(rowscan_scenes::Ground::default());
    assert_eq!(orchard, lowered);
    // Straight down from 1.6 m the plane is at 1.6 m to the last bit.
    let fan = BeamFan::from_degrees(-90.0, 1.0, 1);
    let mut found = [Return::MISS];
    let pose = Pose { x_m: -1.9, y_m: 0.3, z_m: 1.6 };
    Caster::new(&orchard).cast(pose, &fan, &mut Scratch::default(), &mut found);
    assert_eq!((found[0].class, found[0].range_m), (Class::Ground, 1.6));
}

#[test]
fn rows_stand_on_the_slope() {
    let mut parameters = small();
    parameters.ground.slope_deg = Some(10.0);
    parameters.trellis.post_every = Some(1);
    let orchard = grow(&parameters);
    let rise_m = 4.0 * 10f64.to_radians().tan();
    for (tree, row) in [(0, 0.0), (3, 1.0)] {
        let foot = orchard.tree(tree).unwrap().wood[0].base();
        assert!((foot[2] - row * rise_m).abs() < 1e-9, "{foot:?}");
    }
    let posts: Vec<f64> = orchard.supports().iter().map(|post| post.shape.base()[2]).collect();
    assert!(posts[..3].iter().all(|z| *z == 0.0) && posts[3..].iter().all(|z| (z - rise_m).abs() < 1e-9));
}

#[test]
fn gaps_and_orders_may_differ_from_row_to_row() {
    let missing = ByRow::Each(vec![vec![1], vec![0, 2]]);
    let order = ByRow::Each(vec![vec![2, 1, 0], vec![]]);
    let straight = grow(&small());
    let orchard = grow(&OrchardParameters { missing, order, ..small() });
    let bare: Vec<bool> = orchard.trees().map(|tree| tree.wood.is_empty()).collect();
    assert_eq!(bare, [false, true, false, true, false, true]);
    let leaves = |orchard: &Orchard, tree| orchard.tree(tree).unwrap().leaves.len();
    assert_eq!(leaves(&orchard, 0), leaves(&straight, 2));
    assert_eq!(leaves(&orchard, 4), leaves(&straight, 4));
}

#[test]
fn a_replanted_tree_is_young_and_its_neighbours_are_as_they_were() {
    let (before, after) = (grow(&small()), grow(&OrchardParameters { replanted: vec![1].into(), ..small() }));
    assert_eq!(before.tree(0), after.tree(0));
    let height = |orchard: &Orchard| orchard.truth().trees[1].height_m;
    let leaves = |orchard: &Orchard| orchard.tree(1).unwrap().leaves.len();
    assert!(height(&after) < height(&before) && leaves(&after) * 2 < leaves(&before) && leaves(&after) > 0);
    // Among copies too.
    let copies = OrchardParameters { distinct_trees: Some(2), replanted: vec![1].into(), ..small() };
    assert_eq!(grow(&copies).tree(1).unwrap().leaves.len(), grow(&copies).tree(4).unwrap().leaves.len());
    assert!(leaves(&grow(&copies)) * 2 < leaves(&before));
}

#[test]
fn rows_may_begin_and_end() {
    let orchard = grow(&OrchardParameters { trees: Some(7), row_ends: Some(2), ..small() });
    let bare: Vec<bool> = orchard.trees_of_row(0).map(|tree| tree.wood.is_empty()).collect();
    assert_eq!(bare, [true, true, false, false, false, true, true]);
}

#[test]
fn what_cannot_be_is_refused_by_key() {
    let refusal = |text: &str| {
        let scene: Scene = toml::from_str(&format!("version = 1\n[orchard]\n{text}")).unwrap();
        scene.validate().unwrap_err().to_string()
    };
    for (text, parts) in [
        ("rows = 2\nmissing = [[1], [12]]", ["orchard.missing", "places from 0 to 11"]),
        ("rows = 2\nmissing = [[1]]", ["orchard.missing", "2 lists, one a row"]),
        ("rows = 2\ntrees = 2\norder = [[1, 1], []]", ["orchard.order", "every number from 0 to 1 once"]),
        ("replanted = [40]", ["orchard.replanted", "places from 0 to 11"]),
        ("generator = 'lsystem'\nreplanted = [4]", ["orchard.replanted", "hmt, trained"]),
        ("row_ends = 6", ["orchard.row_ends", "less than half of orchard.trees"]),
        ("[orchard.ground]\nslope_deg = 60", ["orchard.ground.slope_deg", "-45 to 45"]),
    ] {
        let found = refusal(text);
        assert!(parts.iter().all(|part| found.contains(part)), "{text}: {found}");
    }
    let wrong = toml::from_str::<Scene>("version = 1\n[orchard]\nmissing = 'all'").unwrap_err().to_string();
    assert!(wrong.contains("a list of places, or a list of such lists"), "{wrong}");
}
