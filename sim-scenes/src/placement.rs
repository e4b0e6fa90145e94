//! How a tree that was made at the origin stands in the scene.

use crate::angle::cos_sin_deg;

/// Turned about Z, then moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    base_m: [f64; 3],
    turn_deg: f64,
    cos: f64,
    sin: f64,
}

impl Placement {
    /// Where it was made.
    pub const HERE: Self = Self { base_m: [0.0; 3], turn_deg: 0.0, cos: 1.0, sin: 0.0 };

    /// Moved by `base_m` (metres, scene frame), not turned.
    pub fn at(base_m: [f64; 3]) -> Self {
        Self { base_m, ..Self::HERE }
    }

    /// Turned by `turn_deg` about Z through the origin, counter-clockwise from above, before it is moved. Multiples of 90° are exact.
    #[must_use]
    pub fn turned(self, turn_deg: f64) -> Self {
        let (cos, sin) = cos_sin_deg(turn_deg);
        Self { turn_deg, cos, sin, ..self }
    }

    /// Where the origin goes, metres.
    pub fn base_m(&self) -> [f64; 3] {
        self.base_m
    }

    /// The turn, degrees.
    pub fn turn_deg(&self) -> f64 {
        self.turn_deg
    }

    /// True if nothing moves.
    pub fn is_here(&self) -> bool {
        *self == Self::HERE
    }

    /// A point in the scene.
    pub fn point(&self, point: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = self.direction(point);
        let [base_x, base_y, base_z] = self.base_m;
        [x + base_x, y + base_y, z + base_z]
    }

    /// A direction in the scene.
    pub fn direction(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        // What is not turned keeps its bits, the sign of a zero included.
        if self.sin == 0.0 && self.cos == 1.0 {
            return [x, y, z];
        }
        [self.cos * x - self.sin * y, self.sin * x + self.cos * y, z]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quarter_turn_is_exact_and_comes_before_the_move() {
        let quarter = Placement::at([10.0, 20.0, 0.5]).turned(90.0);
        assert_eq!(quarter.point([1.0, 2.0, 3.0]), [8.0, 21.0, 3.5]);
        assert_eq!(quarter.direction([1.0, 0.0, 0.25]), [0.0, 1.0, 0.25]);
        assert!(Placement::HERE.is_here() && !quarter.is_here());
    }
}
