//! The six scans on shapes whose areas are known, and what must hold on any orchard.

use std::borrow::Cow;

use rowscan_scenes::orchard::{OrchardParameters, Preset};
use rowscan_scenes::scan::{Sampling, ScanAreas, ScanError, ScanKind, ScanPlan, ScanSettings, Target};
use rowscan_scenes::{Caster, Cylinder, Leaf, Orchard, Tree};

fn scan(orchard: &Orchard, settings: &ScanSettings) -> ScanAreas {
    let target = Target::row(orchard, 0).unwrap();
    ScanPlan::new(&target, settings).unwrap().areas(&Caster::new(orchard))
}

/// A wall x = 0, 4 m high, over the whole period of 3 m.
fn wall() -> Orchard {
    let corners = [[0.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 3.0, 4.0], [0.0, 0.0, 4.0]];
    Orchard::from_organs(vec![Leaf::new(corners.to_vec()).unwrap()], Vec::new(), 3.0)
}

fn small(iterations: u32) -> Orchard {
    let mut parameters = OrchardParameters::of(Preset::Paper);
    parameters.trees = Some(2);
    parameters.tree.iterations = Some(iterations);
    Orchard::grow(&parameters, 5, &|_, _| {}).unwrap()
}

fn coarse(kind: ScanKind) -> ScanSettings {
    ScanSettings {
        kind,
        dy_m: 0.05,
        dtheta_deg: 1.0,
        pitch_m: 0.05,
        distance_m: 4.0,
        ..ScanSettings::default()
    }
}

#[test]
fn a_wall_gives_both_forms_of_equation_3_exactly() {
    let (from, to, step) = (-30.0_f64, 40.0_f64, 0.25_f64);
    let count = 281;
    let delta = step.to_radians();
    for (kind, sampling) in [
        (ScanKind::Lateral, Sampling::Start),
        (ScanKind::Opposite, Sampling::Start),
        (ScanKind::Lateral, Sampling::Centre),
    ] {
        let settings = ScanSettings {
            kind,
            sampling,
            dy_m: 0.01,
            range: Some((from, to)),
            distance_m: 2.0,
            ..ScanSettings::default()
        };
        let found = scan(&wall(), &settings);
        let tangents: f64 = (0..count).map(|j| (from + f64::from(j) * step).to_radians().tan()).sum();
        let width_and_distance = 3.0 * 2.0;
        let expected = width_and_distance
            * match sampling {
                Sampling::Start => f64::from(count) * delta.sin() - (1.0 - delta.cos()) * tangents,
                Sampling::Centre => f64::from(count) * 2.0 * (delta / 2.0).sin(),
            };
        assert!(
            (found.total_m2 / expected - 1.0).abs() < 1e-12,
            "{kind} {sampling}: {} {expected}",
            found.total_m2
        );
        assert_eq!((found.leaf_m2, found.three_leaves_m2), (found.total_m2, found.total_m2));
    }
}

#[test]
fn level_beams_measure_a_wall_and_what_is_in_sight_of_it_exactly() {
    for kind in [ScanKind::LateralOrthogonal, ScanKind::OppositeOrthogonal] {
        let found =
            scan(&wall(), &ScanSettings { kind, dy_m: 0.01, pitch_m: 0.01, ..ScanSettings::default() });
        for area in [found.leaf_m2, found.total_m2, found.three_leaves_m2, found.visible_leaf_area_m2] {
            assert!((area - 12.0).abs() < 1e-9, "{kind}: {area}");
        }
    }
}

#[test]
fn a_slanted_leaf_is_projected_by_i_l_and_whole_in_what_is_visible() {
    // One metre square, half of its slope up, seen from above: projected cos 60° of itself.
    let (c, s) = (0.5, 0.75_f64.sqrt());
    let corners = [[0.0, 0.0, 1.0], [0.0, 1.0, 1.0], [c, 1.0, 1.0 + s], [c, 0.0, 1.0 + s]];
    let orchard = Orchard::from_organs(vec![Leaf::new(corners.to_vec()).unwrap()], Vec::new(), 1.0);
    let kind = ScanKind::ZenithOrthogonal;
    let found = scan(&orchard, &ScanSettings { kind, dy_m: 0.01, pitch_m: 0.005, ..ScanSettings::default() });
    assert!((found.leaf_m2 - 0.5).abs() < 1e-9, "{}", found.leaf_m2);
    assert!((found.visible_leaf_area_m2 - 1.0).abs() < 1e-6, "{}", found.visible_leaf_area_m2);
    // By angle from straight above, the projection is no longer exact, but its limit is the same to second order in the height.
    let far = ScanSettings {
        kind: ScanKind::Zenith,
        dy_m: 0.01,
        dtheta_deg: 0.002,
        overhead_m: Some(200.0),
        sampling: Sampling::Centre,
        ..ScanSettings::default()
    };
    let found = scan(&orchard, &far);
    assert!((found.leaf_m2 - 0.5).abs() < 0.01, "{}", found.leaf_m2);
}

/// The paper fixes the range of beams in every displacement, here one holds for all lines: whatever covers the canopy gives its areas.
#[test]
fn beams_beyond_the_canopy_add_nothing() {
    let orchard = small(8);
    let target = Target::row(&orchard, 0).unwrap();
    for kind in ScanKind::ALL.iter().copied() {
        let settings = coarse(kind);
        let plan = ScanPlan::new(&target, &settings).unwrap();
        let step = plan.swept(1) - plan.swept(0);
        let last = plan.swept(plan.beams().len() - 1);
        // Middles of cells where level and plumb beams stand, so that the wider range has the same ones.
        let half = if kind.is_angular() { 0.0 } else { step / 2.0 };
        let range = Some((plan.swept(0) - half - 7.0 * step, last + half + 5.0 * step));
        let wide = ScanPlan::new(&target, &ScanSettings { range, ..settings }).unwrap();
        assert_eq!(wide.beams().len(), plan.beams().len() + 12, "{kind}");
        let caster = Caster::new(&orchard);
        let (own, wide) = (plan.areas(&caster), wide.areas(&caster));
        for (own, wide) in [(own.total_m2, wide.total_m2), (own.three_leaves_m2, wide.three_leaves_m2)] {
            assert!((own / wide - 1.0).abs() < 1e-12, "{kind}: {own} {wide}");
        }
    }
}

#[test]
fn what_must_hold_on_any_orchard() {
    let orchard = small(8);
    for kind in ScanKind::ALL.iter().copied() {
        let ScanAreas { leaf_m2, total_m2, three_leaves_m2, visible_leaf_area_m2 } =
            scan(&orchard, &coarse(kind));
        assert!(0.0 < leaf_m2 && leaf_m2 <= total_m2, "{kind}");
        assert!(leaf_m2 <= three_leaves_m2, "{kind}");
        if !kind.is_angular() {
            assert!(three_leaves_m2 <= 3.0 * leaf_m2 * (1.0 + 1e-12), "{kind}");
            assert!(visible_leaf_area_m2 >= leaf_m2 * (1.0 - 1e-6), "{kind}");
        }
    }
}

#[test]
fn bare_trees_have_no_leaf_area_but_an_impacted_one() {
    let trees = small(8).trees().map(|tree| Tree { wood: tree.wood.clone(), ..Tree::default() }).collect();
    let bare = Orchard::from_trees(trees, 6.0, Some(3.0), Some(5.0));
    for kind in ScanKind::ALL.iter().copied() {
        let found = scan(&bare, &coarse(kind));
        assert_eq!(
            (found.leaf_m2, found.three_leaves_m2, found.visible_leaf_area_m2),
            (0.0, 0.0, 0.0),
            "{kind}"
        );
        assert!(found.total_m2 > 0.0, "{kind}");
    }
}

#[test]
fn moving_the_row_by_whole_advances_changes_nothing() {
    let orchard = small(7);
    let moved: Vec<Tree> = orchard.trees().map(|tree| tree.translated([0.0, 0.25, 0.0])).collect();
    let moved = Orchard::from_trees(moved, orchard.length_m(), Some(3.0), Some(5.0));
    for kind in ScanKind::ALL.iter().copied() {
        // An advance that binary fractions hold, so that the places of the lines are the same to the last bit or nearly so.
        let settings = ScanSettings { dy_m: 0.0625, ..coarse(kind) };
        let (here, there) = (scan(&orchard, &settings), scan(&moved, &settings));
        assert!((here.total_m2 / there.total_m2 - 1.0).abs() < 1e-3, "{kind}: {here:?} {there:?}");
    }
}

#[test]
fn stricter_shade_leaves_less_and_the_far_row_is_not_counted() {
    let areas: Vec<f64> = [101.0, 80.0, 70.0, 60.0]
        .into_iter()
        .map(|threshold| {
            let mut parameters = OrchardParameters::of(Preset::Paper);
            parameters.trees = Some(1);
            parameters.tree.iterations = Some(10);
            parameters.tree.shady_percent = Some(threshold);
            Orchard::grow(&parameters, 3, &|_, _| {}).unwrap().truth().leaf_area_m2
        })
        .collect();
    assert!(areas.windows(2).all(|pair| pair[1] < pair[0]), "{areas:?}");

    let one = small(7);
    let far = one.trees().map(|tree| tree.translated([5.0, 0.0, 0.0]));
    let trees: Vec<Tree> = one.trees().map(Cow::into_owned).chain(far).collect();
    let both = Orchard::from_trees(trees, one.length_m(), Some(3.0), Some(5.0));
    let target = Target { trees: 0..2, ..Target::row(&one, 0).unwrap() };
    let plan = ScanPlan::new(&target, &coarse(ScanKind::Lateral)).unwrap();
    assert_eq!(plan.areas(&Caster::new(&both)), plan.areas(&Caster::new(&one)));
}

#[test]
fn scans_that_cannot_be_are_refused_with_the_reason() {
    let orchard = wall();
    let target = Target::row(&orchard, 0).unwrap();
    let refused = |settings: ScanSettings| ScanPlan::new(&target, &settings).unwrap_err();
    let base = ScanSettings::default;
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(
            matches!(refused(ScanSettings { dtheta_deg: bad, ..base() }), ScanError::NotPositive { .. }),
            "{bad}"
        );
        assert!(
            matches!(refused(ScanSettings { dy_m: bad, ..base() }), ScanError::NotPositive { .. }),
            "{bad}"
        );
    }
    assert!(matches!(refused(ScanSettings { dtheta_deg: 1e-9, ..base() }), ScanError::TooMany { .. }));
    assert!(matches!(
        refused(ScanSettings { range: Some((10.0, -10.0)), ..base() }),
        ScanError::Range { .. }
    ));
    assert!(matches!(refused(ScanSettings { range: Some((-91.0, 0.0)), ..base() }), ScanError::Range { .. }));
    let low = ScanSettings { kind: ScanKind::Zenith, overhead_m: Some(3.0), ..base() };
    assert!(matches!(refused(low), ScanError::InsideTree { .. }));
    // A flat wall seen from above: nobody gave a range, so it is not the range that is wrong.
    let flat = ScanSettings { kind: ScanKind::Zenith, overhead_m: Some(9.0), ..base() };
    let why = refused(flat.clone()).to_string();
    assert!(why.contains("no width") && why.contains("--range"), "{why}");
    assert!(matches!(refused(ScanSettings { range: Some((1.0, 1.0)), ..flat }), ScanError::Range { .. }));
    let post = Cylinder::new([0.0, 0.5, 0.0], [0.0, 0.5, 2.0], 0.6).unwrap();
    let thick = Orchard::from_organs(Vec::new(), vec![post], 3.0);
    let near = ScanSettings { distance_m: 0.5, ..base() };
    let error = ScanPlan::new(&Target::row(&thick, 0).unwrap(), &near).unwrap_err();
    assert!(matches!(error, ScanError::InsideTree { .. }), "{error}");
    let nobody = Orchard::from_organs(Vec::new(), Vec::new(), 3.0);
    let error = ScanPlan::new(&Target::row(&nobody, 0).unwrap(), &base()).unwrap_err();
    assert!(matches!(error, ScanError::NothingThere { .. }), "{error}");
}
