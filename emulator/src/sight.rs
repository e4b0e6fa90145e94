//! Where the beams of a scan line went out.

use rowscan_protocol::angle::BeamGrid;
use rowscan_protocol::rig::Axes;
use rowscan_protocol::scan::Pose;

/// Where the beams of a line went out, in the scene's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sight {
    /// The scanner, at beam 0.
    pub origin: Pose,
    /// The scan plane: θ counts from `to_row` towards `up`.
    pub axes: Axes,
    /// θ of beam 0, radians.
    pub first_rad: f64,
    /// From beam to beam, radians.
    pub step_rad: f64,
    /// How much farther along +Y each beam starts, metres.
    pub advance_m: f64,
}

impl Sight {
    /// The same of every beam of `part` of the beams, which are those of `whole`.
    #[must_use]
    pub(crate) fn of_part(self, whole: BeamGrid, part: BeamGrid) -> Self {
        let (first, stride) = place_in(whole, part);
        let Pose { x_m, y_m, z_m } = self.origin;
        Self {
            origin: Pose { x_m, y_m: y_m + first * self.advance_m, z_m },
            first_rad: self.first_rad + first * self.step_rad,
            step_rad: stride * self.step_rad,
            advance_m: stride * self.advance_m,
            ..self
        }
    }
}

/// Which beam of `whole` the first of `part` is, and how many of `whole` are from one to the next.
pub(crate) fn place_in(whole: BeamGrid, part: BeamGrid) -> (f64, f64) {
    let step_deg = whole.step_deg();
    if step_deg == 0.0 {
        return (0.0, 1.0);
    }
    ((part.angle_deg(0) - whole.angle_deg(0)) / step_deg, part.step_deg() / step_deg)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_of_the_beams_goes_out_where_they_do() {
        let whole = BeamGrid::spanning(-450_000, 2_250_000, 5000);
        let part = BeamGrid::spanning(0, 900_000, 10_000);
        let sight = Sight {
            origin: Pose { x_m: -1.9, y_m: 3.0, z_m: 1.6 },
            axes: Axes::LEVEL,
            first_rad: -1.0,
            step_rad: 0.01,
            advance_m: 1e-4,
        };
        let seen = sight.of_part(whole, part);
        // 45° are 90 beams of half a degree.
        assert!((seen.first_rad - (-1.0 + 90.0 * 0.01)).abs() < 1e-12, "{seen:?}");
        assert!((seen.step_rad - 0.02).abs() < 1e-12 && (seen.advance_m - 2e-4).abs() < 1e-15, "{seen:?}");
        assert!((seen.origin.y_m - 3.009).abs() < 1e-12, "{seen:?}");
    }
}
