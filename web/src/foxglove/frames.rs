//! Where the frames of reference of tractor and scanners are in the scene's: x across the rows, y along them, z up, metres.

use crate::TractorGauge;
use glam::{DMat3, DQuat, DVec3};
use rowscan_emulator::Sight;
use rowscan_protocol::angle::BeamGrid;

/// The scene's frame.
pub(crate) const SCENE: &str = "scene";
/// The tractor's: x ahead, y to the left, z up.
pub(crate) const TRACTOR: &str = "tractor";

/// Where a frame is in the scene's, and how it is turned there: x, y, z and w of a unit quaternion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Placed {
    pub(crate) translation_m: [f64; 3],
    pub(crate) rotation: [f64; 4],
}

/// A scanner's frame, x along device angle 0° and y along 90°, by where the beams of `grid` went out.
pub(crate) fn of_scanner(sight: &Sight, grid: BeamGrid) -> Placed {
    // Device angles count with θ or against it.
    let sense = if sight.step_rad * grid.step_deg() < 0.0 { -1.0 } else { 1.0 };
    let zero_rad = sight.first_rad - sense * grid.angle_deg(0).to_radians();
    let (to_row, up) = (DVec3::from(sight.axes.to_row), DVec3::from(sight.axes.up));
    let along = |theta_rad: f64| to_row * theta_rad.cos() + up * theta_rad.sin();
    let (x, y) = (along(zero_rad), along(zero_rad + sense * std::f64::consts::FRAC_PI_2));
    let turned = DQuat::from_mat3(&DMat3::from_cols(x, y, x.cross(y)));
    let origin = sight.origin;
    Placed { translation_m: [origin.x_m, origin.y_m, origin.z_m], rotation: turned.normalize().to_array() }
}

/// The tractor's frame.
pub(crate) fn of_tractor(gauge: &TractorGauge) -> Placed {
    // Headings count clockwise from +Y; a quaternion about z counts the other way, from +X.
    let yaw = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2 - gauge.heading_rad);
    // Nose up turns x towards z, which is backwards about y; right side down turns y towards z.
    let turned = yaw * DQuat::from_rotation_y(-gauge.pitch_rad) * DQuat::from_rotation_x(gauge.roll_rad);
    Placed { translation_m: [gauge.x_m, gauge.y_m, gauge.up_m], rotation: turned.to_array() }
}

#[cfg(test)]
mod tests {
    use rowscan_protocol::rig::Axes;
    use rowscan_protocol::scan::Pose;

    use super::*;

    fn turned(placed: Placed, by: [f64; 3]) -> DVec3 {
        DQuat::from_array(placed.rotation) * DVec3::from(by)
    }

    #[test]
    fn a_beam_of_the_scan_goes_where_the_scanner_sent_it() {
        let grid = BeamGrid::spanning(-450_000, 2_250_000, 5000);
        for step_rad in [grid.step_deg().to_radians(), -grid.step_deg().to_radians()] {
            let (origin, axes) = (Pose { x_m: -1.9, y_m: 3.0, z_m: 1.6 }, Axes::LEVEL);
            let sight = Sight { origin, axes, first_rad: 0.7, step_rad, advance_m: 0.0 };
            let placed = of_scanner(&sight, grid);
            assert_eq!(placed.translation_m, [-1.9, 3.0, 1.6]);
            for beam in [0, 90, 300] {
                let (sin, cos) = grid.angle_deg(beam).to_radians().sin_cos();
                let theta_rad = sight.first_rad + beam as f64 * step_rad;
                let sent = DVec3::new(theta_rad.cos(), 0.0, theta_rad.sin());
                let drawn = turned(placed, [cos, sin, 0.0]);
                assert!(drawn.distance(sent) < 1e-12, "{beam} of {step_rad}: {drawn} {sent}");
            }
        }
    }

    #[test]
    fn a_tractor_looks_along_its_heading_nose_up_and_right_side_down() {
        let east = TractorGauge { heading_rad: std::f64::consts::FRAC_PI_2, ..TractorGauge::default() };
        assert!(turned(of_tractor(&east), [1.0, 0.0, 0.0]).distance(DVec3::X) < 1e-12);
        let up = TractorGauge { pitch_rad: 0.1, ..TractorGauge::default() };
        let nose = turned(of_tractor(&up), [1.0, 0.0, 0.0]);
        assert!(nose.distance(DVec3::new(0.0, 0.1_f64.cos(), 0.1_f64.sin())) < 1e-12, "{nose}");
        let rolled = TractorGauge { roll_rad: 0.1, ..TractorGauge::default() };
        let left = turned(of_tractor(&rolled), [0.0, 1.0, 0.0]);
        assert!(left.distance(DVec3::new(-0.1_f64.cos(), 0.0, 0.1_f64.sin())) < 1e-12, "{left}");
    }
}
