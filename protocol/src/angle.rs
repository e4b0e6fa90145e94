//! Angles as the device counts them: ten-thousandths of a degree, 0° to the device's right, 90° straight ahead,
//! counter-clockwise seen from above.

/// Ten-thousandths of a degree per degree.
const PER_DEGREE: f64 = 10_000.0;

/// The beams of one mirror turn: beam `i` points at `start + i * step`.
///
/// The wire rounds the step to 1/10000°. SICK's third- and sixth-degree steps (1667, 3333, 6667, 833) stand for exact
/// twelfths of a degree; [`BeamGrid::step_deg`] gives those back, so that beam 1140 of an LMS511 lies at 185°, not 0.04° past it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct BeamGrid {
    /// Device angle of the first beam, 1/10000°.
    pub start: i32,
    /// Angle between beams as the wire rounds it, 1/10000°.
    pub step: u16,
    /// Number of beams.
    pub count: u16,
}

impl BeamGrid {
    /// The grid that covers `start..=stop` (1/10000°) in steps of `step` (1/10000°, wire rounding).
    ///
    /// The point count is floor((stop - start) / exact step) + 1, as the manual has it. A zero step or an inverted
    /// range gives an empty grid.
    pub fn spanning(start: i32, stop: i32, step: u16) -> Self {
        if step == 0 || stop < start {
            return Self { start, step, count: 0 };
        }
        let span_deg = (f64::from(stop) - f64::from(start)) / PER_DEGREE;
        // The span is a whole number of steps in every legal setting; the half-thousandth keeps rounding from losing one.
        let steps = (span_deg / exact_step_deg(step) + 5e-4) as u32;
        Self { start, step, count: steps.min(u32::from(u16::MAX) - 1) as u16 + 1 }
    }

    /// Exact angle between beams, degrees.
    pub fn step_deg(&self) -> f64 {
        exact_step_deg(self.step)
    }

    /// Device angle of beam `i`, degrees.
    pub fn angle_deg(&self, i: usize) -> f64 {
        f64::from(self.start) / PER_DEGREE + i as f64 * self.step_deg()
    }

    /// Number of beams.
    pub fn len(&self) -> usize {
        usize::from(self.count)
    }

    /// True if there is no beam.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }
}

/// The exact step (degrees) that the wire's rounded step stands for: a twelfth of a degree where one rounds to it.
pub fn exact_step_deg(step: u16) -> f64 {
    let twelfths = (u32::from(step) * 12 + 5_000) / 10_000;
    let rounded = (twelfths * 10_000 + 6) / 12;
    if twelfths > 0 && rounded == u32::from(step) {
        f64::from(twelfths) / 12.0
    } else {
        f64::from(step) / PER_DEGREE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounded_steps_stand_for_exact_twelfths() {
        for (wire, exact) in [
            (833, 1.0 / 12.0),
            (1667, 1.0 / 6.0),
            (2500, 0.25),
            (3333, 1.0 / 3.0),
            (5000, 0.5),
            (6667, 2.0 / 3.0),
            (10_000, 1.0),
            (1250, 0.125),
            (3750, 0.375),
        ] {
            assert_eq!(exact_step_deg(wire), exact, "wire step {wire}");
        }
    }

    #[test]
    fn point_counts_are_those_of_the_recorded_devices() {
        assert_eq!(BeamGrid::spanning(-450_000, 2_250_000, 5000).count, 541);
        assert_eq!(BeamGrid::spanning(-450_000, 2_250_000, 2500).count, 1081);
        assert_eq!(BeamGrid::spanning(-50_000, 1_850_000, 1667).count, 1141);
        assert_eq!(BeamGrid::spanning(-50_000, 1_850_000, 6667).count, 286);
        assert_eq!(BeamGrid::spanning(-450_000, 2_250_000, 3333).count, 811);
        assert_eq!(BeamGrid::spanning(0, -1, 5000).count, 0);
        assert_eq!(BeamGrid::spanning(0, 10, 0).count, 0);
    }

    #[test]
    fn the_last_beam_lies_on_the_stop_angle() {
        let grid = BeamGrid::spanning(-50_000, 1_850_000, 1667);
        assert!((grid.angle_deg(1140) - 185.0).abs() < 1e-9);
    }
}
