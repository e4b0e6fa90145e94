//! Simulated and device time.

use core::ops::Add;
use core::time::Duration;

/// An instant of simulated time: nanoseconds since the simulation began. Never read from a clock; always handed in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SimTime(pub u64);

impl SimTime {
    /// The beginning.
    pub const ZERO: Self = Self(0);

    /// Seconds since the beginning.
    pub fn as_secs_f64(self) -> f64 {
        self.0 as f64 * 1e-9
    }

    /// Time since the beginning.
    pub fn elapsed(self) -> Duration {
        Duration::from_nanos(self.0)
    }
}

impl Add<Duration> for SimTime {
    type Output = Self;

    fn add(self, rhs: Duration) -> Self {
        Self(self.0.saturating_add(u64::try_from(rhs.as_nanos()).unwrap_or(u64::MAX)))
    }
}

/// Unwraps the device's 32-bit microsecond counter (it wraps after 71.6 minutes) into seconds since the first reading.
///
/// ```
/// use rowscan_protocol::time::DeviceClock;
/// let mut clock = DeviceClock::default();
/// assert_eq!(clock.seconds(u32::MAX - 9_999), 0.0);
/// assert_eq!(clock.seconds(10_000), 0.02);
/// ```
#[derive(Clone, Copy, Debug, Default)]
pub struct DeviceClock {
    last: Option<u32>,
    elapsed_us: u64,
}

impl DeviceClock {
    /// Seconds between the first reading and this one. A reading up to half a wrap behind the last one counts as
    /// an older reading (it repeats or reorders) and does not advance the clock.
    pub fn seconds(&mut self, reading_us: u32) -> f64 {
        let Some(last) = self.last else {
            self.last = Some(reading_us);
            return 0.0;
        };
        let step = reading_us.wrapping_sub(last) as i32;
        if step < 0 {
            return self.elapsed_us.saturating_sub(u64::from(step.unsigned_abs())) as f64 * 1e-6;
        }
        self.last = Some(reading_us);
        self.elapsed_us += u64::from(step.unsigned_abs());
        self.elapsed_us as f64 * 1e-6
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_older_reading_does_not_advance_the_clock() {
        let mut clock = DeviceClock::default();
        clock.seconds(1_000_000);
        assert_eq!(clock.seconds(2_000_000), 1.0);
        assert_eq!(clock.seconds(1_500_000), 0.5);
        assert_eq!(clock.seconds(3_000_000), 2.0);
    }
}
