//! How the scanner moves along the row.

use rowscan_protocol::rig::Rig;

/// Straight ahead at constant speed: y(t) = start + speed · t.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StraightLine {
    /// Y of the scanner at t = 0, metres.
    pub start_m: f64,
    /// Ground speed, m/s.
    pub speed_m_s: f64,
}

impl StraightLine {
    /// The drive that a rig describes.
    pub fn of_rig(rig: &Rig) -> Self {
        Self { start_m: rig.start_m, speed_m_s: rig.speed_m_s }
    }

    /// Y (metres) after `t_s` seconds of driving.
    pub fn y_m(&self, t_s: f64) -> f64 {
        self.start_m + self.speed_m_s * t_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fifty_hertz_at_a_metre_a_second_is_twenty_millimetres_a_line() {
        let line = StraightLine::of_rig(&Rig { start_m: -0.5, speed_m_s: 1.0, ..Rig::default() });
        assert!((line.y_m(51.0 / 50.0) - line.y_m(1.0) - 0.020).abs() < 1e-12);
        assert_eq!(line.y_m(0.0), -0.5);
    }
}
