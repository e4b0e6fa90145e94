//! Gaps in a drive in lockstep: nobody takes scans any more. Until somebody does again, time goes on at the host's pace: who is away for a second
//! loses a second of the row, as on a real tractor.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rowscan_ports::clock::Stopwatch;
use rowscan_protocol::time::SimTime;

/// Who is back so soon, host time, is back at once: time has not moved, and the run repeats to the byte. It is longer than the end of the last child
/// takes to be seen.
const AT_ONCE: Duration = Duration::from_millis(60);

/// Gaps that are kept; of more only the number is known.
const KEPT: usize = 1000;

/// One gap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Gap {
    /// The last instant before it.
    pub from: SimTime,
    /// The first instant after it; none while it lasts.
    pub to: Option<SimTime>,
}

/// The gaps of a run. Clones share them. A run with a gap does not repeat to the byte: how long one is hangs on the host.
#[derive(Clone, Debug, Default)]
pub struct Gaps(Arc<Mutex<Vec<Gap>>>);

impl Gaps {
    /// All of them so far, the first thousand.
    pub fn all(&self) -> Vec<Gap> {
        self.lock().clone()
    }

    fn open(&self, from: SimTime) {
        let mut gaps = self.lock();
        if gaps.len() < KEPT {
            gaps.push(Gap { from, to: None });
        }
    }

    fn close(&self, at: SimTime) {
        if let Some(gap) = self.lock().last_mut() {
            gap.to.get_or_insert(at);
        }
    }

    fn lock(&self) -> MutexGuard<'_, Vec<Gap>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Holds time to the host's pace in a gap.
#[derive(Debug, Default)]
pub(crate) struct GapPacer {
    gaps: Gaps,
    open: Option<Open>,
}

/// A gap that lasts.
#[derive(Clone, Copy, Debug)]
struct Open {
    from: SimTime,
    since: Stopwatch,
    /// Time has gone on in it.
    is_told: bool,
}

impl GapPacer {
    pub(crate) fn new(gaps: Gaps) -> Self {
        Self { gaps, open: None }
    }

    /// It is a gap, or none, at `now`.
    pub(crate) fn set(&mut self, is_gap: bool, now: SimTime) {
        match (is_gap, self.open.is_some()) {
            (true, false) => {
                self.open = Some(Open { from: now, since: Stopwatch::start(), is_told: false });
            }
            (false, true) => {
                let was_told = self.open.take().is_some_and(|open| open.is_told);
                was_told.then(|| self.gaps.close(now));
            }
            _ => {}
        }
    }

    /// Time goes on in the gap, if there is one.
    pub(crate) fn pass(&mut self) {
        let Some(open) = self.open.as_mut().filter(|open| !open.is_told) else { return };
        open.is_told = true;
        tracing::warn!(
            "nobody takes scans: from {:.3} s on time goes on at this machine's pace until somebody does",
            open.from.as_secs_f64()
        );
        self.gaps.open(open.from);
    }

    pub(crate) fn is_open(&self) -> bool {
        self.open.is_some()
    }

    /// The host's time until `at` comes; none outside a gap.
    pub(crate) fn left(&self, at: SimTime) -> Duration {
        let Some(Open { from, since, .. }) = &self.open else { return Duration::ZERO };
        at.elapsed().saturating_sub(from.elapsed()).max(AT_ONCE).saturating_sub(since.elapsed())
    }
}
