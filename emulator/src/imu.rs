//! What an inertial measurement unit in a scanner reads on this tractor.

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
/// to the scan plane); the attitude is that in the scene. Turns of the headland are not in it, for beams there are cast as in an alley.
pub(crate) fn reading(world: &ScannerView, mirror: Mirror, at: SimTime) -> Imu {
    let before = SimTime(at.0.saturating_sub(BESIDE.as_nanos() as u64));
    let after = at + BESIDE;
    let between_s = Duration::from_nanos(after.0 - before.0).as_secs_f64();
    let axes = world.axes_at(mirror, at);
    let (axes_before, axes_after) = (world.axes_at(mirror, before), world.axes_at(mirror, after));
    let (was, will) = (velocity(world.tractor(), before), velocity(world.tractor(), after));
    let [x, y, z]: Vector = std::array::from_fn(|k| (will[k] - was[k]) / between_s);
    let felt = [x, y, z + GRAVITY_M_S2];
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

/// Of the tractor over ground, in the scene.
fn velocity(tractor: &Tractor, at: SimTime) -> Vector {
    let motion = tractor.motion(at);
    let (across, along) = motion.place.heading_rad.sin_cos();
    [motion.speed_m_s * across, motion.speed_m_s * along, 0.0]
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
    use super::*;

    /// The axes that a quaternion turns x, y and z to.
    fn axes([w, x, y, z]: [f64; 4]) -> [Vector; 3] {
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)],
            [2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)],
            [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
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
