//! How much of a way was driven at which speed.

/// Speeds that are told apart are so many times each other.
const STEP: f64 = 1.1;
/// The slowest that is told, m/s; slower ones count as this.
const SLOWEST_M_S: f64 = 1e-4;
/// Up to 130 m/s.
const STEPS: usize = 148;
/// Of counts that follow each other a speed is that of so much time, seconds: an encoder that sticks for a tenth of a second each fifth one has half the speed.
const SPEED_S: f64 = 0.5;
/// Without a count for so long, the tractor may stand, seconds: a speed is told of what lies before.
const PAUSE_S: f64 = 0.35;

/// The way at each speed.
#[derive(Clone, Debug)]
pub(crate) struct Speeds {
    way_m: [f64; STEPS],
    /// The time and way of counts that no speed is told of yet, seconds and metres.
    open: (f64, f64),
}

impl Default for Speeds {
    fn default() -> Self {
        Self { way_m: [0.0; STEPS], open: (0.0, 0.0) }
    }
}

impl Speeds {
    /// A count: so much way since the one before, which was so long ago.
    pub(crate) fn count(&mut self, way_m: f64, seconds: f64) {
        if seconds > PAUSE_S {
            self.close();
            self.add(way_m, seconds);
            return;
        }
        self.open = (self.open.0 + seconds, self.open.1 + way_m);
        if self.open.0 >= SPEED_S {
            self.close();
        }
    }

    /// Tells the speed of the counts so far.
    fn close(&mut self) {
        let (seconds, way_m) = std::mem::take(&mut self.open);
        self.add(way_m, seconds);
    }

    /// A way that took so long; nothing is known of one that took no time.
    fn add(&mut self, way_m: f64, seconds: f64) {
        let speed_m_s = way_m / seconds;
        if speed_m_s.is_finite() {
            let step = (speed_m_s / SLOWEST_M_S).ln() / STEP.ln();
            let step = (step.max(0.0) as usize).min(STEPS - 1);
            self.way_m[step] += way_m;
        }
    }

    /// The speed at which half the way was driven, to 5 %: as much of it was driven faster as slower. None without a way.
    pub(crate) fn median_m_s(&self) -> Option<f64> {
        let half_m = self.way_m.iter().sum::<f64>() / 2.0;
        let mut way_m = 0.0;
        let step = self.way_m.iter().position(|at_speed_m| {
            way_m += at_speed_m;
            way_m > half_m
        })?;
        Some(SLOWEST_M_S * STEP.powf(step as f64 + 0.5))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_of_the_way_is_slower_and_half_is_faster() {
        let mut speeds = Speeds::default();
        assert_eq!(speeds.median_m_s(), None);
        speeds.add(0.0, 1.0);
        speeds.add(1.0, 0.0);
        assert_eq!(speeds.median_m_s(), None, "no way, and one in no time");
        for (way_m, speed_m_s) in [(1.0, 0.01), (3.0, 1.0), (1.0, 8.0)] {
            speeds.add(way_m, way_m / speed_m_s);
        }
        let median_m_s = speeds.median_m_s().unwrap();
        assert!((median_m_s - 1.0).abs() < 0.06, "{median_m_s}");
        speeds.add(100.0, 1e-3);
        assert!(speeds.median_m_s() > Some(100.0));
    }
}
