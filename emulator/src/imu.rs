//! What an inertial measurement unit in a scanner reads on this tractor.

use std::f64::consts::PI;
use std::time::Duration;

use glam::{DMat3, DQuat};
use rowscan_protocol::compact::Imu;
use rowscan_protocol::device::Mirror;
use rowscan_protocol::time::SimTime;
use rowscan_vehicle::Tractor;

use crate::view::ScannerView;

/// Gravity at the surface, m/s².
const GRAVITY_M_S2: f64 = 9.81;
/// Motion is differentiated over this time to either side.
const BESIDE: Duration = Duration::from_millis(5);

type Vector = [f64; 3];

/// The reading at `at`, without its time: acceleration with gravity, rates and attitude in the scanner's axes (x straight ahead, y at +90°, z square
/// to the scan plane); the attitude is that in the scene.
pub(crate) fn reading(world: &ScannerView, mirror: Mirror, at: SimTime) -> Imu {
    let before = SimTime(at.0.saturating_sub(BESIDE.as_nanos() as u64));
    let after = at + BESIDE;
    let between_s = Duration::from_nanos(after.0 - before.0).as_secs_f64();
    let [axes_before, axes, axes_after] = [before, at, after].map(|at| turned_axes(world, mirror, at));
    let (was, will) = (velocity(world.tractor(), before), velocity(world.tractor(), after));
    let [x, y, z]: Vector = std::array::from_fn(|k| (will[k] - was[k]) / between_s);
    let felt = [x, y, z + GRAVITY_M_S2 + bounce(world.tractor(), at)];
    let turned = |of: usize, towards: usize| {
        let change: Vector = std::array::from_fn(|k| (axes_after[of][k] - axes_before[of][k]) / between_s);
        dot(change, axes[towards])
    };
    Imu {
        acceleration_m_s2: axes.map(|axis| dot(axis, felt) as f32),
        // How fast y turns towards z is the rate about x, and so on.
        rate_rad_s: [turned(1, 2), turned(2, 0), turned(0, 1)].map(|rate| rate as f32),
        orientation_wxyz: quaternion(axes).map(|part| part as f32),
        ..Imu::default()
    }
}

/// The scanner's axes in the scene. Beams on the headland are cast as in the first alley, and the tractor turns there.
fn turned_axes(world: &ScannerView, mirror: Mirror, at: SimTime) -> [Vector; 3] {
    let place = world.tractor().motion(at).place;
    let cast_rad = if place.alley.is_some_and(|alley| alley.backwards) { PI } else { 0.0 };
    let (sin, cos) = (place.heading_rad - cast_rad).sin_cos();
    world.axes_at(mirror, at).map(|[x, y, z]| [x * cos + y * sin, y * cos - x * sin, z])
}

/// Of the tractor over ground, in the scene.
fn velocity(tractor: &Tractor, at: SimTime) -> Vector {
    let motion = tractor.motion(at);
    let (across, along) = motion.place.heading_rad.sin_cos();
    [motion.speed_m_s * across, motion.speed_m_s * along, 0.0]
}

/// The tractor's acceleration upwards, by the ground that it drives over, m/s².
fn bounce(tractor: &Tractor, at: SimTime) -> f64 {
    // Times of both sides are as far from the middle, and none is before 0.
    let beside = Duration::from_nanos(at.0.min(BESIDE.as_nanos() as u64));
    let half_s = beside.as_secs_f64();
    let up_m = |at: SimTime| tractor.motion(at).up_m;
    let bent_m = up_m(SimTime(at.0 - beside.as_nanos() as u64)) - 2.0 * up_m(at) + up_m(at + beside);
    if half_s > 0.0 { bent_m / (half_s * half_s) } else { 0.0 }
}

fn dot(a: Vector, b: Vector) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The rotation that takes the scanner's axes to where they point in the scene: w, x, y, z with w not negative.
fn quaternion(axes: [Vector; 3]) -> [f64; 4] {
    let [x, y, z, w] = DQuat::from_mat3(&DMat3::from_cols_array_2d(&axes)).to_array();
    let sign = if w < 0.0 { -1.0 } else { 1.0 };
    [w, x, y, z].map(|part| sign * part)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::expect_used, reason = "a test fails by panicking")]

    use rowscan_vehicle::trajectory::Drive;

    use super::*;
    use crate::stage::Stage;

    /// The axes that a quaternion turns x, y and z to.
    fn axes([w, x, y, z]: [f64; 4]) -> [Vector; 3] {
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)],
            [2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)],
            [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    }

    /// On the headland it turns as the tractor does, and what it feels is square to its way; the wind in the trees is nothing to it.
    #[test]
    fn it_turns_with_the_tractor_and_never_jumps() {
        use rowscan_scenes::files::load_scene;

        let mut scene = load_scene("spindle", |_| {}).expect("built in");
        (scene.orchard.trees, scene.orchard.tree.iterations) = (Some(2), Some(3));
        scene.drive = Drive { alleys: Some(3), ..Drive::default() };
        scene.wind.speed_m_s = 5.0;
        let stage = Stage::grow(scene, &|_, _| {}).expect("it grows");
        let model = rowscan_protocol::model::by_name("picoscan150").expect("there");
        let (device, world) = stage.scanner(0, model).expect("it fits");
        world.tractor().begin(SimTime::ZERO);
        let at = |ms: u64| {
            let at = SimTime(ms * 1_000_000);
            (world.tractor().motion(at), reading(&world, device.mirror(), at))
        };
        let length = |vector: [f32; 3]| vector.map(|part| f64::from(part).powi(2)).iter().sum::<f64>().sqrt();
        let mut turned = 0;
        for ms in (20..25_000).step_by(10) {
            let ((before, was), (here, is)) = (at(ms - 10), at(ms));
            let along: f64 =
                was.orientation_wxyz.iter().zip(is.orientation_wxyz).map(|(a, b)| f64::from(a * b)).sum();
            assert!(along.abs() > 0.9999, "{ms} ms: {:?} to {:?}", was.orientation_wxyz, is.orientation_wxyz);
            // But where a turn begins or ends.
            if at(ms + 10).0.place.curvature_1_m != before.place.curvature_1_m {
                continue;
            }
            let rate_rad_s = here.speed_m_s * here.place.curvature_1_m.abs();
            assert!((length(is.rate_rad_s) - rate_rad_s).abs() < 1e-3, "{ms} ms: {:?}", is.rate_rad_s);
            let felt_m_s2 = (here.speed_m_s * rate_rad_s).hypot(GRAVITY_M_S2);
            assert!((length(is.acceleration_m_s2) - felt_m_s2).abs() < 1e-2, "{ms} ms: {is:?}");
            turned += u32::from(rate_rad_s > 0.0);
        }
        assert!(turned > 500, "two half circles: {turned}");
    }

    /// On rough ground it feels how the tractor goes up and down, as the places of a receiver do; on level ground gravity alone.
    #[test]
    fn it_feels_the_bounce_of_rough_ground() {
        use rowscan_scenes::files::scene_from_text;

        for (road, rough) in [("", false), ("[drive.road]\nclass = \"E\"\n", true)] {
            let text = format!(
                "version = 2\n[orchard]\ntrees = 2\n[orchard.tree]\niterations = 3\n{road}[rig]\nspeed_m_s = 2.0\n"
            );
            let scene = scene_from_text(&text, |_| {}).expect("a scene");
            let stage = Stage::grow(scene, &|_, _| {}).expect("it grows");
            let model = rowscan_protocol::model::by_name("picoscan150").expect("there");
            let (device, world) = stage.scanner(0, model).expect("it fits");
            world.tractor().begin(SimTime::ZERO);
            let up_m = |ms: u64| world.tractor().motion(SimTime(ms * 1_000_000)).up_m;
            let (mut felt, mut expected, mut apart) = (0.0, 0.0, 0.0);
            for ms in (100..8_000).step_by(20) {
                let imu = reading(&world, device.mirror(), SimTime(ms * 1_000_000));
                let axes = axes(imu.orientation_wxyz.map(f64::from));
                let up: f64 =
                    axes.iter().zip(imu.acceleration_m_s2).map(|(axis, a)| axis[2] * f64::from(a)).sum();
                // Over 20 ms to either side: 4 cm of the way, and waves are a metre long and longer.
                let bent = (up_m(ms - 20) - 2.0 * up_m(ms) + up_m(ms + 20)) / 0.02_f64.powi(2);
                felt += (up - GRAVITY_M_S2).powi(2);
                expected += bent.powi(2);
                apart += (up - GRAVITY_M_S2 - bent).powi(2);
            }
            assert_eq!(expected > 0.01, rough, "{expected}");
            assert!(
                apart < 0.01 * expected + 1e-6 && felt < 1.1 * expected + 1e-6,
                "{felt} {expected} {apart}"
            );
        }
    }

    #[test]
    fn quaternions_turn_back_to_their_axes() {
        for parts in [
            [1.0, 0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 1.0, 0.0],
            [0.0, 0.0, 0.0, 1.0],
            [0.5, 0.5, -0.5, 0.5],
            [0.1, -0.7, 0.1, 0.7],
        ] {
            let length =
                dot([parts[1], parts[2], parts[3]], [parts[1], parts[2], parts[3]]) + parts[0] * parts[0];
            let unit = parts.map(|part: f64| part / length.sqrt());
            let found = quaternion(axes(unit));
            for (found, wanted) in found.iter().zip(unit) {
                assert!((found - wanted).abs() < 1e-12, "{found} for {wanted} of {unit:?}");
            }
        }
    }
}
