//! Layers of constant elevation: what their beams meet, against closed forms and against the oracle's rays on the true cone.

use rowscan_protocol::rig::Attitude;
use rowscan_protocol::scan::Pose;
use rowscan_scenes::caster::brute::Oracle;
use rowscan_scenes::seed::Purpose;
use rowscan_scenes::{BeamFan, Caster, Class, Cone, Leaf, Orchard, Return, Scratch};

/// The plane, layers of an MRS1000 and of a multiScan, and the steepest of all; degrees.
const ELEVATIONS: [f64; 8] = [0.0, 2.5, -2.5, 5.0, 7.5, 22.5, 42.0, -42.0];

/// How far a beam may be beside its place, by its length.
const BESIDE: f64 = 3e-4;

/// The beams of a cone, and what each met: unit vector and return.
fn seen(orchard: &Orchard, origin: Pose, fan: &BeamFan, elevation_deg: f64) -> Vec<([f64; 3], Return)> {
    let bend_rad = elevation_deg.to_radians();
    let mut met = vec![Return::MISS; fan.len()];
    let scratch = &mut Scratch::default();
    Cone::new(fan, bend_rad).cast(&Caster::new(orchard), (origin, 0.0), 0.0, scratch, &mut met);
    let (rise, level) = bend_rad.sin_cos();
    let axes = fan.axes().copied().unwrap_or(rowscan_protocol::rig::Axes::LEVEL);
    let ray = |(cos, sin): (f64, f64)| axes.turned([level * cos, rise, level * sin]);
    fan.directions().map(ray).zip(met).collect()
}

fn alone(leaf: Vec<Leaf>) -> Orchard {
    Orchard::from_organs(leaf, vec![], f64::INFINITY)
}

#[test]
fn a_wall_is_where_it_is_for_every_layer() {
    let x_m = 2.0;
    let at = |y: f64, z: f64| [x_m, y, z];
    let wall = Leaf::new(vec![at(-90.0, 0.01), at(90.0, 0.01), at(90.0, 60.0), at(-90.0, 60.0)]).unwrap();
    let orchard = alone(vec![wall]);
    let origin = Pose { x_m: -1.0, y_m: 3.0, z_m: 30.0 };
    for elevation_deg in ELEVATIONS {
        let fan = BeamFan::from_degrees(-70.0, 0.25, 561);
        for ([x, y, z], met) in seen(&orchard, origin, &fan, elevation_deg) {
            assert_eq!(met.class, Class::Leaf, "{elevation_deg}");
            // Where the beam says it met the wall.
            let off = (origin.x_m + met.range_m * x - x_m).abs() / met.range_m;
            assert!(off < BESIDE, "{elevation_deg}: {off:e}");
            let along = (3.0f64 / x * y).abs();
            assert!(along < 80.0 && z.abs() < 1.0);
        }
    }
}

#[test]
fn the_ground_is_where_it_is_for_every_layer() {
    let orchard = alone(vec![]);
    let origin = Pose { x_m: -1.9, y_m: 3.0, z_m: 1.6 };
    for elevation_deg in ELEVATIONS {
        let fan = BeamFan::from_degrees(-178.0, 0.5, 353);
        for ([_, _, z], met) in seen(&orchard, origin, &fan, elevation_deg) {
            assert_eq!(met.class, Class::Ground, "{elevation_deg}");
            let off = (origin.z_m + met.range_m * z).abs() / met.range_m;
            assert!(off < BESIDE, "{elevation_deg}: {off:e}");
        }
    }
}

/// A sphere of panels: how far its panels are within it, and the panels.
fn sphere(middle: [f64; 3], radius_m: f64) -> (f64, Vec<Leaf>) {
    let (slices, rings) = (120, 60);
    let at = |slice: i32, ring: i32| {
        let (long, lat) = (
            std::f64::consts::TAU * f64::from(slice) / f64::from(slices),
            std::f64::consts::PI * (f64::from(ring) / f64::from(rings) - 0.5),
        );
        let unit = [lat.cos() * long.cos(), lat.cos() * long.sin(), lat.sin()];
        std::array::from_fn(|i| middle[i] + radius_m * unit[i])
    };
    let panel = |(slice, ring): (i32, i32)| {
        let corners = [at(slice, ring), at(slice + 1, ring), at(slice + 1, ring + 1), at(slice, ring + 1)];
        // At the poles two corners are one.
        let corners: Vec<[f64; 3]> = match ring {
            0 => vec![corners[0], corners[2], corners[3]],
            ring if ring == rings - 1 => vec![corners[0], corners[1], corners[2]],
            _ => corners.to_vec(),
        };
        Leaf::new(corners).unwrap()
    };
    let panels = (0..slices).flat_map(|slice| (0..rings).map(move |ring| (slice, ring))).map(panel);
    let half = std::f64::consts::PI / f64::from(slices);
    (radius_m * (1.0 - half.cos().powi(2)), panels.collect())
}

#[test]
fn a_sphere_is_where_it_is_for_every_layer() {
    for elevation_deg in ELEVATIONS {
        // In the way of the layer: 2 m away along its middle beam, and a little beside it.
        let (rise, level) = elevation_deg.to_radians().sin_cos();
        let middle = [2.0 * level, 3.0 + 2.0 * rise, 9.1];
        let (within_m, panels) = sphere(middle, 0.5);
        let origin = Pose { x_m: 0.0, y_m: 3.0, z_m: 9.0 };
        let fan = BeamFan::from_degrees(-40.0, 0.125, 641);
        let mut met_by = 0;
        for (ray, met) in seen(&alone(panels), origin, &fan, elevation_deg) {
            let to: [f64; 3] = std::array::from_fn(|i| middle[i] - [origin.x_m, origin.y_m, origin.z_m][i]);
            let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let (nearest, square) = (dot(to, ray), dot(to, to));
            let under = 0.5f64.powi(2) - (square - nearest * nearest);
            // Near its rim a sphere is seen edge-on.
            if under.max(0.0).sqrt() < 0.1 {
                assert!(under > -0.01 || met.class != Class::Leaf, "{elevation_deg}: {under}");
                continue;
            }
            met_by += 1;
            assert_eq!(met.class, Class::Leaf, "{elevation_deg}");
            let point: [f64; 3] = std::array::from_fn(|i| met.range_m * ray[i] - to[i]);
            let off_m = dot(point, point).sqrt() - 0.5;
            assert!(
                off_m.abs() < within_m + BESIDE * met.range_m,
                "{elevation_deg}: {off_m:e}, panels {within_m:e}"
            );
        }
        assert!(met_by > 150, "{elevation_deg}: {met_by}");
    }
}

/// Squares of 4 cm in any direction, all round the scanner.
fn cloud() -> Vec<Leaf> {
    let mut stream = Purpose::Growth.stream(11, 5, 5);
    let mut between = |low: f64, high: f64| low + (high - low) * stream.unit();
    let leaf = |_| {
        let middle = [between(-2.0, 2.0), between(-2.5, 2.5), between(0.2, 4.0)];
        let (turn, tip) = (between(0.0, 6.2), between(0.2, 1.4));
        let (u, v) =
            ([turn.cos(), turn.sin(), 0.0], [-turn.sin() * tip.cos(), turn.cos() * tip.cos(), tip.sin()]);
        let at = |a: f64, b: f64| std::array::from_fn(|i| middle[i] + 0.04 * (a * u[i] + b * v[i]));
        Leaf::new(vec![at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)]).unwrap()
    };
    (0..5000).map(leaf).collect()
}

#[test]
fn leaves_are_those_that_rays_of_the_true_cone_meet() {
    let orchard = Orchard::from_organs(cloud(), vec![], 5.0);
    let oracle = Oracle::new(&orchard);
    let origin = Pose { x_m: 0.0, y_m: 1.0, z_m: 2.0 };
    for (elevation_deg, yaw_rad) in
        ELEVATIONS.into_iter().map(|e| (e, 0.0)).chain([(2.5, 0.2), (-22.5, -0.3)])
    {
        let axes = Attitude { yaw_rad, ..Attitude::LEVEL }.axes();
        let fan = BeamFan::from_degrees(-60.0, 0.3, 800).leaning(axes);
        let (mut same, mut hits) = (0, 0);
        for (ray, met) in seen(&orchard, origin, &fan, elevation_deg) {
            let expected = oracle.ray([origin.x_m, origin.y_m, origin.z_m], ray);
            hits += usize::from(expected.class == Class::Leaf);
            if (met.class, met.tree, met.organ) == (expected.class, expected.tree, expected.organ) {
                same += 1;
                // Endless where both meet nothing. By how much a surface seen at a slant is nearer.
                let slant = f64::from(expected.cos_incidence).abs().max(0.02);
                let off_m = (met.range_m - expected.range_m).abs();
                assert!(
                    !met.is_hit() || off_m < 1.5 * BESIDE * expected.range_m / slant,
                    "{elevation_deg}: {met:?}, expected {expected:?}"
                );
            }
        }
        assert!(hits > 40, "{elevation_deg}: {hits} leaves");
        // A beam that passes an edge within 0.3 mm a metre may be on its other side.
        assert!(same >= 785, "{elevation_deg}: {same} of 800");
    }
}

/// The wrong twin: a plane that leans by the elevation, as the layer would be if it were no cone.
#[test]
fn a_plane_that_leans_is_no_layer() {
    let orchard = alone(vec![]);
    let origin = Pose { x_m: -1.9, y_m: 3.0, z_m: 1.6 };
    let fan = BeamFan::from_degrees(-170.0, 0.5, 321);
    let leans = fan.clone().leaning(Attitude { yaw_rad: 5f64.to_radians(), ..Attitude::LEVEL }.axes());
    let flat = seen(&orchard, origin, &leans, 0.0);
    let cone = seen(&orchard, origin, &fan, 5.0);
    let off = |([_, _, z], _): &([f64; 3], Return), (_, met): &([f64; 3], Return)| {
        (origin.z_m + met.range_m * z).abs() / met.range_m
    };
    let worst = cone.iter().zip(&flat).map(|(cone, flat)| off(cone, flat)).fold(0.0, f64::max);
    assert!(worst > 10.0 * BESIDE, "{worst:e}");
}
