//! Steps of a given length.

use std::time::Duration;

use rowscan_protocol::time::SimTime;

/// Steps that end at multiples of a length after the start of the drive.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stride {
    length: Duration,
    /// When the present one ends, once the drive has started.
    end: Option<SimTime>,
}

impl Stride {
    pub(crate) fn new(length: Duration) -> Self {
        Self { length: length.max(Duration::from_nanos(1)), end: None }
    }

    /// The end of the present step of a drive that began then.
    pub(crate) fn end(&mut self, began: SimTime) -> SimTime {
        *self.end.get_or_insert(began + self.length)
    }

    /// True if a step ends at `at`; the next one begins then.
    pub(crate) fn ends(&mut self, at: SimTime) -> bool {
        let Some(end) = self.end.filter(|end| *end <= at) else { return false };
        self.end = Some(end + self.length);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_end_at_multiples_after_the_start() {
        let mut stride = Stride::new(Duration::from_millis(5));
        assert!(!stride.ends(SimTime(20_000_000)), "nothing has started");
        assert_eq!(stride.end(SimTime(20_000_000)), SimTime(25_000_000));
        assert!(!stride.ends(SimTime(24_999_999)));
        assert!(stride.ends(SimTime(25_000_000)));
        assert_eq!(stride.end(SimTime(20_000_000)), SimTime(30_000_000));
    }
}
