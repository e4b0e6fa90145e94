//! Shares of the spot: closed forms of the disc, and true cone rays by brute force.

use std::f64::consts::{PI, TAU};

use rowscan_protocol::optics::{Fact, Optics, Spot};
use rowscan_protocol::rig::{Mount, Roof};
use rowscan_protocol::scan::Pose;
use rowscan_scenes::caster::brute::Oracle;
use rowscan_scenes::optics::{Eye, EyeModel, OpticsSettings};
use rowscan_scenes::seed::Purpose;
use rowscan_scenes::{Caster, Class, Leaf, Orchard};

use super::bench::{Bench, HEIGHT_M, LIMITS, fan, half_plate, optics, plate, settings, split};

/// Share of a unit disc beyond a straight edge at distance `m` from its middle.
fn beyond(m: f64) -> f64 {
    let m = m.clamp(-1.0, 1.0);
    0.5 - (m * (1.0 - m * m).sqrt() + m.asin()) / PI
}

/// rms and worst error of a straight edge's share at the reference range, random in place and direction.
fn edge_errors(quality: u8) -> (f64, f64) {
    let lms111 = split(optics("lms111"));
    let settings = OpticsSettings { quality, ..settings("spot,echoes") };
    let (range_m, mut stream) = (settings.reference_range_m, Purpose::Growth.stream(5, 0, 0));
    let radius_m = lms111.spot.radius_m(range_m);
    let (mut sum, mut worst) = (0.0, 0.0_f64);
    let edges = 300;
    for scan in 0..edges {
        let (m, turn) = (2.0 * stream.unit() - 1.0, TAU * stream.unit());
        let mut bench =
            Bench::new(&lms111, 5, &settings, vec![half_plate(range_m, m * radius_m, turn)], &fan(0.5, 3));
        let share: f64 = bench.axis(scan).iter().map(|echo| echo.share).sum();
        let error = share - beyond(m);
        sum += error * error;
        worst = worst.max(error.abs());
    }
    ((sum / f64::from(edges as u32)).sqrt(), worst)
}

#[test]
fn the_share_of_a_straight_edge_is_as_good_as_the_table_of_quadratures_says() {
    // OPTICS.md 2.1: rms and worst of 3 × 5, 5 × 9, 7 × 9, 9 × 15.
    for (quality, rms, worst) in [(1, 0.048, 0.21), (2, 0.020, 0.11), (3, 0.014, 0.075), (4, 0.009, 0.053)] {
        let found = edge_errors(quality);
        assert!(found.0 <= rms && found.1 <= worst, "quality {quality}: {found:?}, table {rms}, {worst}");
    }
}

#[test]
fn shares_of_two_surfaces_add_up_to_one_within_the_bands_of_parallel_planes() {
    let lms111 = split(optics("lms111"));
    // Fine, so that what is left is what parallel planes do. Along the scan plane rays diverge from one point; across it they are parallel.
    let settings = OpticsSettings { quality: 4, ..settings("spot,echoes") };
    for (near_m, far_m, turn, low, high) in [
        (2.0, 3.0, PI / 2.0, 0.98, 1.02),
        (1.0, 1.6, PI / 2.0, 0.96, 1.04),
        (2.0, 4.0, PI / 2.0, 0.96, 1.04),
        (2.0, 3.0, 0.0, 0.90, 1.10),
        (1.0, 1.6, 0.0, 0.90, 1.10),
        (2.0, 4.0, 0.0, 0.82, 1.18),
        (1.0, 3.0, 0.0, 0.76, 1.24),
    ] {
        let radius_m = lms111.spot.radius_m(near_m);
        for step in -9..=9 {
            let edge_m = f64::from(step) * 0.1 * radius_m;
            let plates = vec![half_plate(near_m, edge_m, turn), plate(far_m)];
            let mut bench = Bench::new(&lms111, 5, &settings, plates, &fan(0.5, 3));
            // The mean over the places of the plane grid.
            let sums = (0..40).map(|scan| bench.axis(scan).iter().map(|echo| echo.share).sum::<f64>());
            let mean = sums.sum::<f64>() / 40.0;
            if turn > 0.0 {
                // Seen from the window, an edge stands at the same angle on both discs. 9 × 15 gives an edge within 0.009 rms.
                let m = edge_m / radius_m;
                let behind = m * far_m / near_m * radius_m / lms111.spot.radius_m(far_m);
                let expected = beyond(m) + 1.0 - beyond(behind);
                assert!(
                    (mean - expected).abs() < 0.015,
                    "{near_m} and {far_m} m, edge {step}: {mean}, {expected}"
                );
            }
            // The bands are given with two digits.
            assert!(
                (low - 0.01..=high + 0.01).contains(&mean),
                "{near_m} and {far_m} m, turn {turn}, edge {step}: {mean}"
            );
        }
    }
}

#[test]
fn one_surface_gets_all_of_the_power_at_any_distance() {
    for model in ["lms111", "lms511", "tim561", "tim551", "lms291"] {
        for range_m in [1.0, 2.5, 7.0] {
            let optics = split(optics(model));
            let mut bench =
                Bench::new(&optics, 1, &settings("spot"), vec![plate(range_m)], &fan(1.0 / 3.0, 5));
            let share = bench.axis(3)[0].share;
            // The plate is a little farther at the spot's rim.
            assert!((share - 1.0).abs() < 1e-4, "{model} at {range_m} m: {share}");
        }
    }
}

/// A cloud of leaves about 2 m away.
fn cloud() -> Vec<Leaf> {
    let mut stream = Purpose::Growth.stream(9, 0, 0);
    let leaf = |_| {
        let mut around = |middle: f64, half: f64| middle + half * (2.0 * stream.unit() - 1.0);
        let [x, y, z] = [around(2.0, 0.25), around(0.0, 0.3), around(HEIGHT_M, 0.4)];
        let (turn, tilt) = (around(0.0, PI), around(0.0, 1.2));
        let at = |u: f64, v: f64| {
            let (across, along) = (0.035 * u, 0.025 * v * tilt.cos());
            let deep = 0.025 * v * tilt.sin();
            [
                x + deep,
                y + across * turn.cos() - along * turn.sin(),
                z + across * turn.sin() + along * turn.cos(),
            ]
        };
        Leaf::new(vec![at(-1.0, 0.0), at(0.0, -1.0), at(1.0, 0.0), at(0.0, 1.0)]).unwrap()
    };
    (0..90).map(leaf).collect()
}

#[test]
fn leaves_get_the_share_that_true_cone_rays_give_them() {
    shares_are_those_of_cones(&settings("spot,echoes"), 0.0, 0.0);
}

#[test]
fn so_they_do_in_a_layer_of_constant_elevation() {
    shares_are_those_of_cones(&settings("spot,echoes"), 0.0, 5.0);
}

#[test]
fn so_they_do_where_the_scan_plane_is_bent() {
    let bent = OpticsSettings { bent_plane: true, ..settings("spot,echoes") };
    shares_are_those_of_cones(&bent, 3.0, 0.0);
}

#[test]
fn only_a_tim_is_bent_each_unit_by_an_angle_of_its_own_and_only_where_asked_for() {
    let bend = |model: &str, unit, bent_plane| {
        let settings = OpticsSettings { unit: Some(unit), bent_plane, ..settings("spot,echoes") };
        Bench::new(&optics(model), 1, &settings, vec![], &fan(0.33, 3)).eye.bend_rad().to_degrees()
    };
    let units: Vec<f64> = (0..400).map(|unit| bend("tim781s", unit, true)).collect();
    assert!(units.iter().all(|bend| bend.abs() <= 3.0));
    assert!(units.iter().any(|bend| *bend > 2.8) && units.iter().any(|bend| *bend < -2.8));
    assert_eq!([bend("tim781s", 1, false), bend("lms511", 1, true)], [0.0, 0.0]);
    // A unit of this seed is the same one tomorrow.
    assert_eq!(bend("tim781s", 7, true), units[7]);
    // Its cone opens to its roof or to its floor, whichever way that looks.
    let bent = OpticsSettings { unit: Some(7), bent_plane: true, ..settings("spot,echoes") };
    let mounted = |roof: Option<Roof>| {
        let mount = Mount { roof, ..Mount::default() };
        let eye = Bench::new(&optics("tim781s"), 1, &bent, vec![], &fan(0.33, 3)).eye;
        eye.under_roof(mount.roof_sense()).bend_rad().to_degrees()
    };
    assert_eq!(mounted(None), units[7]);
    assert_eq!([mounted(Some(Roof::Backward)), mounted(Some(Roof::Forward))], [units[7], -units[7]]);
}

/// Every share of a spot on a cloud of leaves against rays of a cone; the scanner's plane may be bent by so much, or the layer raised.
fn shares_are_those_of_cones(settings: &OpticsSettings, bend_deg: f64, layer_deg: f64) {
    let lms111 = Optics { bend_deg: Fact::assumed(bend_deg), ..optics("lms111") };
    let fan = fan(0.5, 21);
    let orchard = Orchard::from_organs(cloud(), vec![], f64::INFINITY);
    let (oracle, caster) = (Oracle::new(&orchard), Caster::new(&orchard));
    let model = EyeModel { optics: &lms111, echoes: 2, limits: LIMITS };
    let mut eye = Eye::new(model, settings, 1, 0);
    eye.elevate(layer_deg.to_radians());
    eye.turn_to(&fan, true);
    assert_eq!(eye.bend_rad() != 0.0, bend_deg != 0.0);
    let bend_rad = eye.bend_rad() + layer_deg.to_radians();
    let (mut sum, mut squares, mut truths, mut count) = (0.0, 0.0, 0.0, 0.0);
    for line in 0..12_u32 {
        let y_m = 0.04 * (f64::from(line) - 6.0);
        eye.look(&caster, Pose { x_m: 0.0, y_m, z_m: HEIGHT_M }, 0.0, u64::from(line));
        for beam in 0..fan.len() {
            let found: f64 = eye.beam(beam).iter().map(|echo| echo.share).sum();
            let true_share = cone_share(&oracle, &lms111.spot, [fan.theta_rad(beam), bend_rad], y_m);
            sum += found - true_share;
            squares += (found - true_share).powi(2);
            truths += true_share;
            count += 1.0;
        }
    }
    let (mean, rms, truth) = (sum / count, (squares / count).sqrt(), truths / count);
    assert!((0.1..0.8).contains(&truth), "the cloud is no cloud: {truth}");
    // A leaf's outline is about two edges in a spot, and 5 × 9 gives one within 0.020.
    assert!(mean.abs() < 0.005 && rms < 0.035, "mean {mean}, rms {rms} of {truth}");
}

/// Share of the rays of a true cone that meet a leaf. Its axis is `theta` from +X and leaves the plane by `bend`.
fn cone_share(oracle: &Oracle<'_>, spot: &Spot, [theta, bend]: [f64; 2], y_m: f64) -> f64 {
    let (start_m, growth) = (spot.radius_m(0.0), spot.radius_m(1.0) - spot.radius_m(0.0));
    let (mut met, mut all) = (0.0, 0.0);
    let n = 13;
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        let of = |k: i32| 2.0 * (f64::from(k) + 0.5) / f64::from(n) - 1.0;
        let (u, v) = (of(i), of(j));
        if u * u + v * v > 1.0 {
            continue;
        }
        let ((sin, cos), (rise, level)) = (theta.sin_cos(), bend.sin_cos());
        let aside = [-sin * u - rise * cos * v, level * v, cos * u - rise * sin * v];
        let axis = [level * cos, rise, level * sin];
        let origin: [f64; 3] = std::array::from_fn(|i| [0.0, y_m, HEIGHT_M][i] + aside[i] * start_m);
        let direction: [f64; 3] = std::array::from_fn(|i| axis[i] + aside[i] * growth);
        let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
        all += 1.0;
        met += f64::from(u8::from(oracle.ray(origin, direction.map(|x| x / length)).class == Class::Leaf));
    }
    met / all
}
