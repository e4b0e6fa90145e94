//! How a scanner, or the vehicle under it, is turned.
//!
//! The rig's frame: X towards the row, Y in the direction of travel, Z up. Roll turns about Y first, then pitch about X, then yaw about Z.

/// How something is turned from its place square to the row; radians.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Attitude {
    /// Positive: what looks at the row turns ahead, in the direction of travel.
    pub yaw_rad: f64,
    /// Positive: the top leans back, as of a vehicle with its nose up.
    pub pitch_rad: f64,
    /// Positive: the top leans to the row, so what looks at the row turns down.
    pub roll_rad: f64,
}

/// The axes of what is turned, as unit vectors of the frame that it is turned in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axes {
    /// What looked at the row.
    pub to_row: [f64; 3],
    /// What looked ahead: square to the scan plane.
    pub ahead: [f64; 3],
    /// What looked up.
    pub up: [f64; 3],
}

impl Axes {
    /// Not turned.
    pub const LEVEL: Self = Self { to_row: [1.0, 0.0, 0.0], ahead: [0.0, 1.0, 0.0], up: [0.0, 0.0, 1.0] };

    /// A vector of what is turned, in the frame that it is turned in.
    pub fn turned(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let at = |i: usize| x * self.to_row[i] + y * self.ahead[i] + z * self.up[i];
        [at(0), at(1), at(2)]
    }

    /// A vector of the frame outside, as what is turned sees it.
    pub fn seen(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        [self.to_row, self.ahead, self.up].map(|axis| x * axis[0] + y * axis[1] + z * axis[2])
    }

    /// The same in a scene where the row lies towards `to_row` · X and the tractor's right is towards `right` · X, each 1 or −1: the rig's X looks to the
    /// row and its Y ahead, and a fan of beams counts its angle from the scene's +X.
    #[must_use]
    pub fn in_scene(&self, to_row: f64, right: f64) -> Self {
        let Self { to_row: [ux, uy, uz], ahead: [nx, ny, nz], up: [wx, wy, wz] } = *self;
        Self {
            to_row: [ux, to_row * right * uy, to_row * uz],
            ahead: [to_row * right * nx, ny, right * nz],
            up: [to_row * wx, right * wy, wz],
        }
    }

    /// The axes of what is turned so on something that is turned itself: a scanner on a vehicle.
    #[must_use]
    pub fn on(&self, carrier: &Self) -> Self {
        Self {
            to_row: carrier.turned(self.to_row),
            ahead: carrier.turned(self.ahead),
            up: carrier.turned(self.up),
        }
    }

    /// A beam of the scan plane by the cosine and sine of its angle from the row, up positive: a unit vector.
    pub fn beam(&self, cos: f64, sin: f64) -> [f64; 3] {
        self.turned([cos, 0.0, sin])
    }
}

impl Attitude {
    /// Not turned.
    pub const LEVEL: Self = Self { yaw_rad: 0.0, pitch_rad: 0.0, roll_rad: 0.0 };

    /// True if the scan plane is not square to the row.
    pub fn leans(&self) -> bool {
        self.yaw_rad != 0.0 || self.pitch_rad != 0.0
    }

    /// Its axes.
    pub fn axes(&self) -> Axes {
        let (sin_yaw, cos_yaw) = (libm::sin(self.yaw_rad), libm::cos(self.yaw_rad));
        let (sin_pitch, cos_pitch) = (libm::sin(self.pitch_rad), libm::cos(self.pitch_rad));
        let (sin_roll, cos_roll) = (libm::sin(self.roll_rad), libm::cos(self.roll_rad));
        let [ahead, row, up] = [
            [-sin_yaw * cos_pitch, cos_yaw * cos_pitch, sin_pitch],
            [cos_yaw, sin_yaw, 0.0],
            [sin_yaw * sin_pitch, -cos_yaw * sin_pitch, cos_pitch],
        ];
        let mixed = |a: f64, b: f64| [0, 1, 2].map(|i| a * row[i] + b * up[i]);
        Axes { to_row: mixed(cos_roll, -sin_roll), ahead, up: mixed(sin_roll, cos_roll) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(found: [f64; 3], expected: [f64; 3]) {
        let worst = found.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-12, "{found:?}, expected {expected:?}");
    }

    #[test]
    fn each_angle_turns_as_the_documents_draw_it() {
        let (sin, cos) = (libm::sin(0.2), libm::cos(0.2));
        let yaw = Attitude { yaw_rad: 0.2, ..Attitude::LEVEL }.axes();
        close(yaw.beam(1.0, 0.0), [cos, sin, 0.0]);
        close(yaw.beam(0.0, 1.0), [0.0, 0.0, 1.0]);
        let pitch = Attitude { pitch_rad: 0.2, ..Attitude::LEVEL }.axes();
        close(pitch.beam(1.0, 0.0), [1.0, 0.0, 0.0]);
        close(pitch.beam(0.0, 1.0), [0.0, -sin, cos]);
        let roll = Attitude { roll_rad: 0.2, ..Attitude::LEVEL }.axes();
        close(roll.beam(1.0, 0.0), [cos, 0.0, -sin]);
        close(roll.beam(0.0, 1.0), [sin, 0.0, cos]);
    }

    #[test]
    fn axes_are_square_and_seen_undoes_turned() {
        let axes = Attitude { yaw_rad: 0.3, pitch_rad: -0.4, roll_rad: 0.9 }.axes();
        let vehicle = Attitude { yaw_rad: 0.0, pitch_rad: 0.05, roll_rad: -0.1 }.axes();
        let both = axes.on(&vehicle);
        for axes in [axes, vehicle, both] {
            for v in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.3, -2.0, 0.7]] {
                close(axes.seen(axes.turned(v)), v);
            }
        }
        close(both.turned([0.1, 0.2, 0.3]), vehicle.turned(axes.turned([0.1, 0.2, 0.3])));
        assert_eq!(Attitude::LEVEL.axes(), Axes::LEVEL);
    }
}
