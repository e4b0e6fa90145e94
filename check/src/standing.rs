//! A tractor that stands, or goes back, for good before the end of its row: no such run comes to its end.

use std::time::Duration;

use rowscan_faults::{At, Lasts};
use rowscan_protocol::time::SimTime;

use crate::fault::ScenarioFault;
use crate::scenario::{End, Scenario};

/// Beside what faults last, a tractor that comes no farther for so long does not go on, simulated.
const FOR_GOOD: Duration = Duration::from_secs(120);

/// How long the tractor has come no farther.
#[derive(Debug)]
pub(crate) struct Standing {
    /// The place of the end, metres; none where time or scans end the run.
    end_m: Option<f64>,
    /// From here on that is for good.
    longest: Duration,
    /// How far it has come, and when.
    farthest: Option<(f64, SimTime)>,
}

impl Standing {
    pub(crate) fn new(scenario: &Scenario) -> Self {
        let end_m = match scenario.end {
            End::RowM(row_m) => Some(row_m),
            End::Seconds(_) | End::Scans(_) => None,
        };
        let longest = scenario.faults.iter().map(longest).max().unwrap_or_default();
        Self { end_m, longest: FOR_GOOD.saturating_add(longest), farthest: None }
    }

    /// Looks where the tractor is.
    ///
    /// # Errors
    /// It stands for good, with the remedy.
    pub(crate) fn look(&mut self, row_m: f64, now: SimTime) -> Result<(), String> {
        let Some(end_m) = self.end_m else { return Ok(()) };
        let (farthest_m, since) = match self.farthest {
            Some((before_m, since)) if row_m < before_m + 1e-6 => (before_m, since),
            _ => (row_m, now),
        };
        self.farthest = Some((farthest_m, since));
        let stood = Duration::from_secs_f64((now.as_secs_f64() - since.as_secs_f64()).max(0.0));
        if stood < self.longest {
            return Ok(());
        }
        Err(format!(
            "the tractor has come no farther than row {farthest_m:.2} m for {} s, it is at row {row_m:.2} m, and `end` is row {end_m} m: it does not come there; let \
             what stops it end (`for`, `until`), or give `end` in `s`",
            stood.as_secs()
        ))
    }
}

/// The longest time that a fault waits or lasts, by its own words.
fn longest(fault: &ScenarioFault) -> Duration {
    let ScenarioFault::Rig(spec) = fault else { return Duration::ZERO };
    let moment = |at: &At| match at {
        At::Time(time) => *time,
        At::After { plus, .. } => *plus,
        _ => Duration::ZERO,
    };
    let lasts = match spec.lasts {
        Some(Lasts::Time(time)) => time,
        Some(Lasts::Scans(_)) | None => Duration::ZERO,
    };
    lasts.max(moment(&spec.at)).max(spec.until.as_ref().map_or(Duration::ZERO, moment))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn second(second: u64) -> SimTime {
        SimTime(second * 1_000_000_000)
    }

    #[test]
    fn a_tractor_that_stands_for_good_does_not_come_to_the_end() {
        let mut standing = Standing { end_m: Some(12.0), longest: FOR_GOOD, farthest: None };
        assert!((0..100).all(|s| standing.look(0.1 * s as f64, second(s)).is_ok()), "it drives");
        assert!((100..219).all(|s| standing.look(9.9, second(s)).is_ok()), "it stands");
        let why = standing.look(9.9, second(219)).and_then(|()| standing.look(9.9, second(220)));
        assert!(
            why.as_ref().is_err_and(|why| why.contains("row 9.90 m") && why.contains("row 12 m")),
            "{why:?}"
        );
        let mut back = Standing { end_m: Some(12.0), longest: FOR_GOOD, farthest: None };
        let gone = |s: u64| 5.0 - 0.5 * s as f64;
        assert!((0..120).all(|s| back.look(gone(s), second(s)).is_ok()), "it may come again");
        assert!(back.look(gone(120), second(120)).is_err(), "it goes back for good");
        // Time ends the run wherever it stands.
        let mut timed = Standing { end_m: None, longest: FOR_GOOD, farthest: None };
        assert!((0..1000).all(|s| timed.look(5.0, second(s)).is_ok()));
    }
}
