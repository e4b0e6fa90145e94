//! I_T against closed forms: walls, a cylinder, removed ground and far row, lost and repeated lines.

use crate::common::*;
use rowscan_canopy::{AreaForm, Estimate, Parameters, Pipeline, Withheld};
use rowscan_protocol::angle::BeamGrid;
use rowscan_protocol::rig::{Mount, Orientation, Rig, Roof, RowSide};
use rowscan_protocol::scan::{NO_ECHO, Scan};

/// Walls whose beams keep inside what a range may be: θ within ±60°.
fn banded_wall(x0_m: f64) -> impl Fn(f64, f64) -> f64 {
    move |_, theta| if theta.abs() < 60.2f64.to_radians() { x0_m / theta.cos() } else { NO_ECHO }
}

#[test]
fn a_wall_has_the_midpoint_closed_form() {
    for (grid, hertz) in [(lms111(), 50), (lms511(), 25)] {
        for (speed, roof) in [(1.0, None), (0.7, Some(Roof::Forward))] {
            let mount = Mount { roof, ..Mount::default() };
            let rig = Rig { speed_m_s: speed, scanners: vec![mount.clone()], ..open_rig() };
            let lines = 101;
            let scans = drive(&rig, grid, hertz, lines, banded_wall(1.9));
            let found = estimate(&rig, &scans).impacted_total_area_m2.unwrap();

            // W · x0 · 2N sin(Δ/2): l cos θ = x0 for every beam.
            let beams = (0..grid.len())
                .filter(|b| theta(&mount, grid, *b).0.abs() < 60.2f64.to_radians())
                .count() as f64;
            let width_m = f64::from(lines) * speed / f64::from(hertz);
            let step = grid.step_deg().to_radians();
            let expected = width_m * 1.9 * 2.0 * beams * (step / 2.0).sin();
            assert!(relative(found, expected) < 1e-12, "{found} {expected}");
        }
    }
}

#[test]
fn a_wall_has_the_forward_closed_form() {
    let rig = open_rig();
    let grid = lms111();
    let scans = drive(&rig, grid, 50, 50, banded_wall(1.9));
    let parameters = Parameters { area_form: AreaForm::Forward, ..Parameters::default() };
    let found = estimate_with(&rig, parameters, &scans).impacted_total_area_m2.unwrap();
    // W · x0 · [N sin Δ − (1 − cos Δ) Σ tan θ]
    let thetas: Vec<f64> = (0..grid.len())
        .map(|b| theta(&rig.scanners[0], grid, b).0)
        .filter(|t| t.abs() < 60.2f64.to_radians())
        .collect();
    let step = 0.5f64.to_radians();
    let tangents: f64 = thetas.iter().map(|t| t.tan()).sum();
    let expected = 1.0 * 1.9 * (thetas.len() as f64 * step.sin() - (1.0 - step.cos()) * tangents);
    assert!(relative(found, expected) < 1e-12, "{found} {expected}");
}

#[test]
fn an_up_mount_sees_the_same_wall_on_either_side() {
    let areas = [RowSide::Right, RowSide::Left].map(|row| {
        let mount = Mount { orientation: Orientation::Up, row, ..Mount::default() };
        let rig = Rig { scanners: vec![mount], ..open_rig() };
        let scans = drive(&rig, lms111(), 50, 50, banded_wall(1.9));
        estimate(&rig, &scans).impacted_total_area_m2.unwrap()
    });
    assert!(relative(areas[0], areas[1]) < 1e-12);
    // −45° is the last beam it has below; side-mounted it would see 240 beams and one.
    let beams = 45.0 * 2.0 + 60.0 * 2.0 + 1.0;
    assert!(relative(areas[0], 1.9 * 2.0 * beams * (0.25f64.to_radians()).sin()) < 1e-12);
}

#[test]
fn a_vertical_cylinder_has_the_area_of_its_integral() {
    // Radius 0.3 m, axis at D = 1.9 m and y = 1 m, from 0.5 m to 2.5 m high; sensor at 1.6 m.
    let (radius_m, axis_m, z1, z2) = (0.3f64, 1.9, 0.5 - 1.6, 2.5 - 1.6);
    let face = move |y_m: f64| {
        let across = radius_m * radius_m - (y_m - 1.0).powi(2);
        (across > 0.0).then(|| axis_m - across.sqrt())
    };
    let cylinder = move |y_m: f64, theta: f64| match face(y_m) {
        Some(x_m) if (z1..z2).contains(&(x_m * theta.tan())) && theta.abs() < 1.5 => x_m / theta.cos(),
        _ => NO_ECHO,
    };
    let rig = Rig { speed_m_s: 0.2, ..open_rig() };
    let scans = drive(&rig, lms511(), 25, 250, cylinder);
    let found = estimate(&rig, &scans).impacted_total_area_m2.unwrap();

    // ∫ x(y) [θ2(y) − θ1(y)] dy by midpoints, y = 1 + r sin t so that the integrand is smooth at the edges.
    let n = 20_000;
    let expected: f64 = (0..n)
        .map(|i| {
            let t = std::f64::consts::PI * ((f64::from(i) + 0.5) / f64::from(n) - 0.5);
            let x_m = axis_m - radius_m * t.cos();
            let angle = (z2 / x_m).atan() - (z1 / x_m).atan();
            x_m * angle * radius_m * t.cos() * std::f64::consts::PI / f64::from(n)
        })
        .sum();
    // Each of 75 lines rounds its angle to whole beams, ± half of 1/6° in 58° at either end (independent, so 0.2 % / √75),
    // and the silhouette's edge to ± half of 8 mm in 600 mm: 0.7 % at worst, at both edges.
    assert!(relative(found, expected) < 0.01, "{found} {expected}");
}

#[test]
fn lost_lines_neither_lose_nor_add_area() {
    let rig = orchard_rig();
    let scans = drive(&rig, lms111(), 50, 301, banded_wall(1.9));
    let whole = estimate(&rig, &scans);
    for k in 2..7 {
        // The first and the last line are kept: what is lost beyond them nobody can know.
        let kept = scans.iter().enumerate().filter(|(i, _)| i % k != 1 || *i == 300).map(|(_, scan)| scan);
        let found = estimate(&rig, kept);
        let lost = (0..300).filter(|i| i % k == 1).count() as u64;
        assert_eq!((found.scans_lost, found.scans), (Some(lost), 301 - lost));
        for (found, whole) in [
            (found.impacted_total_area_m2, whole.impacted_total_area_m2),
            (found.scanned_m, whole.scanned_m),
            (found.advance_m, whole.advance_m),
        ] {
            assert!(relative(found.unwrap(), whole.unwrap()) < 1e-12, "every {k}th line lost");
        }
        assert!((found.scan_frequency_hz.unwrap() - 50.0).abs() < 1e-9);
        assert!(!found.warnings.iter().any(|w| w.code() == "gaps_not_filled"));
    }
}

#[test]
fn turns_without_a_telegram_say_that_the_machine_is_too_slow() {
    let rig = orchard_rig();
    let scans = drive(&rig, lms111(), 50, 301, banded_wall(1.9));
    let after = |every: usize| {
        let kept = scans.iter().enumerate().filter(move |(turn, _)| every == 0 || turn % every != 1);
        // A virtual scanner numbers the telegrams that it sends, and every turn.
        let renumbered: Vec<Scan> = kept
            .enumerate()
            .map(|(telegram, (turn, scan))| Scan {
                telegram_counter: telegram as u16,
                scan_counter: turn as u16,
                ..scan.clone()
            })
            .collect();
        estimate(&rig, renumbered.iter())
    };
    let said = |found: &Estimate| {
        found.warnings.iter().find(|w| w.code() == "turns_left_out").map(ToString::to_string)
    };
    let (all, most, few) = (after(0), after(4), after(200));
    assert_eq!((all.turns_left_out, said(&all)), (0, None));
    assert_eq!((few.turns_left_out, said(&few)), (2, None), "so few are filled from their neighbours");
    assert_eq!((most.turns_left_out, most.scans_lost), (75, Some(0)));
    let said = said(&most).expect("told");
    assert!(said.contains("75 of 301 turns") && said.contains("--time-scale 0.5"), "{said}");
}

#[test]
fn a_long_gap_is_left_out_and_said() {
    let rig = Rig { max_excluded: 0.4, ..orchard_rig() };
    let scans = drive(&rig, lms111(), 50, 301, banded_wall(1.9));
    let kept = || scans.iter().enumerate().filter(|(i, _)| !(100..200).contains(i)).map(|(_, scan)| scan);
    // A third of the row is more than a rig allows unless it says so.
    let withheld = estimate(&orchard_rig(), kept());
    assert_eq!((withheld.scanned_m, withheld.impacted_total_area_m2), (None, None));
    let why = withheld.warnings.iter().find(|warning| warning.code() == "too_much_excluded").unwrap();
    assert!(why.to_string().contains("33.7 % of the row has no valid scan"), "{why}");
    let found = estimate(&rig, kept());
    // 101 steps of 20 mm between neighbours, of which 5 are filled.
    assert!((found.scanned_m.unwrap() - (6.02 - 96.0 * 0.02)).abs() < 1e-9);
    assert!((found.advance_m.unwrap() - 6.0).abs() < 1e-9);
    let gap = found.warnings.iter().find(|w| w.code() == "gaps_not_filled").unwrap();
    assert!(gap.to_string().contains("1 gap in") && gap.to_string().contains("1.92 m"), "{gap}");
    // Lines 100..200 are y = 2..4: trees 1 and 2 are not whole, tree 0 and 3 are.
    assert_eq!(found.trees.iter().map(|t| t.complete).collect::<Vec<_>>(), [true, false, false, true, false]);
}

#[test]
fn a_wall_has_an_impacted_area_and_no_leaves() {
    // At the row's axis, where a face of the voxels is: beams end as they enter, and free path is next to nothing.
    let distance_m = Mount::default().distance_m;
    let scans = drive(&orchard_rig(), lms111(), 50, 301, banded_wall(distance_m + 1e-4));
    let found = estimate(&orchard_rig(), &scans);
    let why = found.warnings.iter().find(|warning| warning.code() == "no_foliage").expect("no foliage");
    assert!(why.to_string().contains("100 % of the hits stand denser than any foliage"), "{why}");
    assert_eq!(
        (
            found.leaf.areas.best_m2().ok(),
            found.leaf.areas.contact_raw_m2().ok(),
            found.leaf.areas.lai().ok()
        ),
        (None, None, None)
    );
    assert!(
        found.impacted_total_area_m2 > Some(10.0)
            && found.trees.iter().all(|tree| tree.leaf.areas.best_m2().ok().is_none())
    );
    // Beams of which three in four pass are foliage, and none is too dense.
    let sparse = |y_m: f64, theta: f64| {
        let deep_m = 0.15 * scatter(theta, y_m);
        if scatter(y_m, theta) < 0.25 { banded_wall(distance_m + deep_m)(y_m, theta) } else { NO_ECHO }
    };
    let found = estimate(&orchard_rig(), &drive(&orchard_rig(), lms111(), 50, 301, sparse));
    assert!(
        found.leaf.areas.best_m2().ok() > Some(1.0)
            && found.contact.is_some_and(|contact| contact.too_dense == 0.0)
    );
}

/// Wherever in a voxel a wall stands, and whatever noise its ranges have; foliage twice as dense as the densest hedge, which no beam passes either, is none.
#[test]
fn a_wall_is_told_from_foliage_that_no_beam_passes() {
    let seen = |distance_m: f64, depth: &dyn Fn(f64) -> f64| {
        let scene = |y_m: f64, theta: f64| {
            let deep_m = depth(scatter(y_m, theta));
            if theta.abs() < 1.05 { distance_m / theta.cos() + deep_m } else { NO_ECHO }
        };
        estimate(&orchard_rig(), &drive(&orchard_rig(), lms111(), 50, 151, scene))
    };
    for step in 0..14 {
        let distance_m = 1.5 + 0.04 * f64::from(step);
        // 12 mm as a standard deviation, evenly spread.
        for noise_m in [0.0, 0.0416] {
            let wall = seen(distance_m, &|dice| noise_m * (dice - 0.5));
            assert_eq!(wall.leaf.areas.best_m2().err(), Some(Withheld::NoFoliage), "{distance_m}, {noise_m}");
        }
        for density in [10.0, 20.0, 40.0] {
            let foliage = seen(distance_m, &|dice: f64| -(1.0 - dice).ln() / (0.5 * density));
            let too_dense = foliage.contact.map(|contact| contact.too_dense);
            assert!(too_dense < Some(0.05), "{distance_m}, {density} m2 a m3: {too_dense:?}");
        }
    }
}

/// A scanner of 90° beside the row sees it, one that looks up does not, and knows of no gap in it.
#[test]
fn a_row_that_no_beam_leads_to_is_out_of_sight() {
    for (orientation, expected) in [(Orientation::Side, None), (Orientation::Up, Some(Withheld::OutOfSight))]
    {
        let mount = Mount { orientation, ..Mount::default() };
        let rig = Rig { scanners: vec![mount], ..orchard_rig() };
        let grid = BeamGrid::spanning(450_000, 1_350_000, 5000);
        let found = estimate(&rig, &drive(&rig, grid, 50, 151, |_, _| NO_ECHO));
        assert_eq!(found.leaf.areas.best_m2().err(), expected, "{orientation:?}");
    }
}

/// A scanner of half a turn that looks up sees a crown from its own height on: too high, and the lowest part of it is in no beam's way.
#[test]
fn a_crown_that_no_beam_leads_to_from_below_is_out_of_sight() {
    for (height_m, expected) in
        [(0.4, None), (0.7, None), (1.3, Some(Withheld::OutOfSight)), (1.8, Some(Withheld::OutOfSight))]
    {
        let mount = Mount { orientation: Orientation::Up, height_m, ..Mount::default() };
        let rig = Rig { scanners: vec![mount], ..orchard_rig() };
        let grid = BeamGrid::spanning(0, 1_800_000, 5000);
        let crown = |y_m: f64, theta: f64| {
            let x_m = 1.5 + 0.5 * scatter(y_m, theta);
            let z_m = height_m + x_m * theta.tan();
            if (0.5..3.0).contains(&z_m) && scatter(theta, y_m) < 0.4 { x_m / theta.cos() } else { NO_ECHO }
        };
        let found = estimate(&rig, &drive(&rig, grid, 50, 151, crown));
        assert_eq!(found.leaf.areas.best_m2().err(), expected, "{height_m}: {:?}", found.warnings);
    }
}

/// Three in four beams pass it.
#[test]
fn a_net_is_no_foliage() {
    let seen = |deep_m: f64| {
        let net = |y_m: f64, theta: f64| {
            let is_hit = scatter(y_m, theta) < 0.25 && theta.abs() < 1.05;
            if is_hit { (1.8 + deep_m * scatter(theta, y_m)) / theta.cos() } else { NO_ECHO }
        };
        estimate(&orchard_rig(), &drive(&orchard_rig(), lms111(), 50, 151, net))
    };
    for noise_m in [0.0, 0.0416] {
        assert_eq!(seen(noise_m).leaf.areas.best_m2().err(), Some(Withheld::NoFoliage), "{noise_m}");
    }
    assert!(seen(0.2).leaf.areas.best_m2().ok() > Some(1.0), "a row of leaves 20 cm deep");
}

#[test]
fn repeated_scans_add_nothing_bit_for_bit() {
    let rig = orchard_rig();
    let scans = drive(&rig, lms111(), 50, 120, banded_wall(1.9));
    let once = estimate(&rig, &scans);
    let again = estimate(&rig, scans.iter().flat_map(|scan| [scan; 3]));
    assert_eq!((again.scans, again.scans_repeated), (360, 240));
    let uncounted = rowscan_canopy::Estimate { scans: 120, scans_repeated: 0, ..again };
    assert_eq!(uncounted, once);
}

#[test]
fn a_tractor_at_standstill_knows_nothing_of_the_row() {
    let rig = Rig { speed_m_s: 0.0, ..orchard_rig() };
    let scans = drive(&rig, lms111(), 50, 50, banded_wall(1.9));
    let found = estimate(&rig, &scans);
    assert_eq!((found.impacted_total_area_m2, found.advance_m), (None, Some(0.0)));
    assert_eq!((found.scans, found.leaf.areas.best_m2().ok(), found.leaf.areas.lai().ok()), (50, None, None));
    assert!(found.warnings.iter().any(|warning| warning.code() == "stood"), "{:?}", found.warnings);
}

#[test]
fn area_scales_with_the_assumed_speed() {
    let rig = open_rig();
    let scans = drive(&rig, lms111(), 50, 80, banded_wall(1.9));
    let area =
        |speed_m_s| estimate(&Rig { speed_m_s, ..rig.clone() }, &scans).impacted_total_area_m2.unwrap();
    assert!(relative(area(1.5), 1.5 * area(1.0)) < 1e-12);
}

#[test]
fn ground_and_the_next_row_are_removed_and_counted() {
    let rig = orchard_rig();
    let mount = rig.scanners[0].clone();
    // Bare ground z = 0, and a fence on the next row's axis, 3 m high.
    let scene = |_: f64, theta: f64| {
        let fence_m = (mount.distance_m + 4.0) / theta.cos();
        let fence_z = mount.height_m + fence_m * theta.sin();
        if theta < 0.0 && fence_z < 0.0 {
            mount.height_m / -theta.sin()
        } else if fence_z < 3.0 && theta.abs() < 1.5 {
            fence_m
        } else {
            NO_ECHO
        }
    };
    let scans = drive(&rig, lms111(), 50, 100, scene);
    let found = estimate(&rig, &scans);
    assert_eq!(found.impacted_total_area_m2, Some(0.0));
    assert_eq!(found.leaf.areas.best_m2().ok(), Some(0.0));
    let returns = found.returns.unwrap();
    assert_eq!(returns.canopy, 0);
    // Ground: tan θ < −1.6/5.9 (15.2°), 149 beams of −89.5..−15.5°; the lowest 0.1 m of the fence too (14.3°: −15, −14.5).
    assert_eq!((returns.ground, returns.far), (100 * 151, 100 * (28 + 1 + 26)));

    // Without a row spacing the fence is canopy, and the estimate says so.
    let blind = estimate(&Rig { row_spacing_m: None, ..rig }, &scans);
    assert!(blind.impacted_total_area_m2.unwrap() > 1.0);
    assert!(blind.warnings.iter().any(|w| w.code() == "no_far_row_gate"));
}

#[test]
fn a_gap_between_trees_holds_next_to_nothing() {
    let rig = orchard_rig();
    // Hedges in trees 0 and 2, nothing in tree 1.
    let scene = |y_m: f64, theta: f64| {
        let x_m = 1.75 + 0.1 * scatter(y_m, theta);
        let z_m = 1.6 + x_m * theta.tan();
        if !(1.5..3.0).contains(&(y_m + 1e-9)) && (0.5..2.5).contains(&z_m) && theta.abs() < 1.5 {
            x_m / theta.cos()
        } else {
            NO_ECHO
        }
    };
    let scans = drive(&rig, lms111(), 50, 225, scene);
    let found = estimate(&rig, &scans);
    assert_eq!(found.trees.len(), 3);
    let gap = &found.trees[1];
    assert_eq!(
        (gap.impacted_total_area_m2, gap.leaf.areas.best_m2().ok(), gap.height_m),
        (0.0, Some(0.0), None)
    );
    assert_eq!(gap.volume_m3, 0.0);
    for tree in [&found.trees[0], &found.trees[2]] {
        assert!(tree.complete);
        assert!((tree.height_m.unwrap() - 2.5).abs() < 0.03, "{:?}", tree.height_m);
        // 0.15 m before the row plane, doubled, 2 m high, 1.5 m long.
        assert!((tree.volume_m3 - 0.3 * 2.0 * 1.5).abs() < 0.06, "{}", tree.volume_m3);
    }
    assert_eq!(found.trees.iter().map(|t| t.y_m).collect::<Vec<_>>(), [0.75, 2.25, 3.75]);
    let of_trees: f64 = found.trees.iter().map(|t| t.impacted_total_area_m2).sum();
    let of_slices: f64 = found.slices.iter().map(|s| s.impacted_total_area_m2).sum();
    let whole = found.impacted_total_area_m2.unwrap();
    assert!(relative(of_trees, whole) < 1e-12 && relative(of_slices, whole) < 1e-12);
}

#[test]
fn an_estimate_on_the_way_is_the_one_of_a_stream_that_ends_there() {
    let rig = orchard_rig();
    let scans = drive(&rig, lms111(), 50, 200, banded_wall(1.7));
    let mut pipeline = Pipeline::new(Some(&rig), 0, None).unwrap();
    scans[..90].iter().for_each(|scan| pipeline.push(scan));
    assert_eq!(pipeline.estimate(), estimate(&rig, &scans[..90]));
    assert_eq!(pipeline.estimate(), pipeline.estimate());
    scans[90..].iter().for_each(|scan| pipeline.push(scan));
    assert_eq!(pipeline.estimate(), estimate(&rig, &scans));
    assert_eq!(pipeline.progress().scans, 200);
    assert!((pipeline.progress().advance_m.unwrap() - 3.98).abs() < 1e-9);
}

#[test]
fn a_restart_in_the_row_neither_loses_nor_adds_lines() {
    let rig = orchard_rig();
    let mut scans = drive(&rig, lms111(), 50, 200, banded_wall(1.7));
    let whole = estimate(&rig, &scans);
    for (i, scan) in scans[100..].iter_mut().enumerate() {
        scan.telegram_counter = 1 + i as u16;
        scan.scan_time_us = 90_000 + 20_000 * i as u32;
    }
    let found = estimate(&rig, &scans);
    assert_eq!((found.scans_lost, found.scans_repeated), (None, 0));
    assert!(relative(found.impacted_total_area_m2.unwrap(), whole.impacted_total_area_m2.unwrap()) < 1e-9);
    assert!(found.warnings.iter().any(|w| w.code() == "restarts"));
}

#[test]
fn without_a_rig_counts_and_ranges_are_reported_and_areas_are_not() {
    let rig = open_rig();
    let scans = drive(&rig, lms111(), 50, 30, banded_wall(1.9));
    let mut pipeline = Pipeline::new(None, 0, None).unwrap();
    scans.iter().for_each(|scan| pipeline.push(scan));
    let found = pipeline.finish();
    assert_eq!((found.scans, found.points_per_scan), (30, Some(541)));
    assert_eq!(found.ranges.returns, 30 * (541 - 359 + 241));
    assert_eq!(found.ranges.misses, 30 * (359 - 241));
    assert_eq!(found.ranges.max_m, Some(1.9 / 60f64.to_radians().cos()));
    let json = serde_json::to_value(&found).unwrap();
    for key in ["impacted_total_area_m2", "leaf_area_m2", "lai", "advance_m", "volume_m3"] {
        assert!(json[key].is_null(), "{key}");
    }
    assert_eq!(json["trees"], serde_json::json!([]));
    assert!((json["scan_frequency_hz"].as_f64().unwrap() - 50.0).abs() < 1e-9);
}

#[test]
fn rigs_that_measure_nothing_are_refused_by_key() {
    let bad = Rig { tree_spacing_m: Some(0.0001), ..Rig::default() };
    let message = Pipeline::new(Some(&bad), 0, None).unwrap_err().to_string();
    assert!(message.contains("tree_spacing_m") && message.contains("0.0001"), "{message}");
    let message = Pipeline::new(Some(&Rig::default()), 3, None).unwrap_err().to_string();
    assert!(message.contains("no scanner 3"), "{message}");
    let nan = Rig { ground_clearance_m: f64::NAN, ..Rig::default() };
    assert!(Pipeline::new(Some(&nan), 0, None).is_err());
}

/// Turns of one scan mode: starts a part of a step apart, a beam less in all but the first.
fn interlaced(turns: u32, number: u32) -> BeamGrid {
    let later = (number % turns * 7500 / turns) as i32;
    BeamGrid::spanning(-480_000 + later, 2_280_000, 7500)
}

#[test]
fn interlaced_turns_of_a_wall_have_the_area_of_their_own_beams() {
    for turns in [1, 2, 4] {
        let rig = open_rig();
        let (mount, lines) = (rig.scanners[0].clone(), 401);
        let range = banded_wall(1.9);
        let seen = |grid: BeamGrid| {
            (0..grid.len()).filter(|b| theta(&mount, grid, *b).0.abs() < 60.2f64.to_radians()).count() as f64
        };
        let scans: Vec<_> = (0..lines)
            .map(|i| line(&rig, interlaced(turns, i), 125, i, &mut |y, theta| range(y, theta)))
            .collect();
        let beams: f64 = (0..lines).map(|i| seen(interlaced(turns, i))).sum();
        let step = 0.75f64.to_radians();
        let expected = rig.speed_m_s / 125.0 * 1.9 * 2.0 * beams * (step / 2.0).sin();
        let found = estimate(&rig, &scans);
        assert!(relative(found.impacted_total_area_m2.unwrap(), expected) < 1e-12);
        // The twin: an estimator that takes every turn for the first one.
        let mut blind = scans;
        blind.iter_mut().for_each(|scan| scan.beams.start = -480_000);
        let found = estimate(&rig, &blind).impacted_total_area_m2.unwrap();
        assert_eq!(relative(found, expected) > 1e-5, turns > 1, "{turns} turns: {found}");
    }
}
