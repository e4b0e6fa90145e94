//! When an estimate of a source ends before the source does.

use std::time::Duration;

use crate::stream::Pipeline;

/// A source whose telegrams hold no valid scan for so long is given up.
pub const UNREADABLE: Duration = Duration::from_secs(10);

/// What an estimate waits for, asked after whatever arrives, and from time to time while nothing does.
#[derive(Clone, Copy, Debug, Default)]
pub struct Enough {
    scans: Option<u64>,
    length_m: Option<f64>,
    /// When telegrams were first seen of which none is a valid scan.
    unreadable_since: Option<Duration>,
}

/// Why there is no need to go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reached {
    /// All has been seen that was asked for.
    Enough,
    /// Telegrams came for [`UNREADABLE`], and none held a valid scan.
    NothingValid,
}

impl Enough {
    /// So many scans, so many metres of row, whichever comes first; with neither, all that the source has.
    pub fn new(scans: Option<u64>, length_m: Option<f64>) -> Self {
        Self { scans, length_m, unreadable_since: None }
    }

    /// Whether the pipeline has enough. `telegrams_bad` are those that never reached it; `now` is on the caller's clock, and stands still for a recording.
    pub fn reached(&mut self, pipeline: &Pipeline, telegrams_bad: u64, now: Duration) -> Option<Reached> {
        let progress = pipeline.progress();
        if self.scans.is_some_and(|scans| progress.scans >= scans)
            || self.length_m.is_some_and(|length_m| pipeline.covered_m() >= Some(length_m))
        {
            return Some(Reached::Enough);
        }
        let is_unreadable = pipeline.valid_scans() == 0 && (progress.scans > 0 || telegrams_bad > 0);
        if !is_unreadable {
            return None;
        }
        let since = *self.unreadable_since.get_or_insert(now);
        (now.saturating_sub(since) >= UNREADABLE).then_some(Reached::NothingValid)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn telegrams_without_a_valid_scan_are_given_up_and_silence_is_not() {
        let pipeline = Pipeline::new(None, 0, None).unwrap();
        let mut enough = Enough::default();
        let mut at = |seconds, bad| enough.reached(&pipeline, bad, Duration::from_secs(seconds));
        assert_eq!(at(0, 0), None);
        // Nothing has come: the scanner may be switched on yet.
        assert_eq!(at(60, 0), None);
        assert_eq!(at(61, 1), None);
        assert_eq!(at(70, 40), None);
        assert_eq!(at(71, 41), Some(Reached::NothingValid));
    }
}
