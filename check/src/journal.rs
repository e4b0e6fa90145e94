//! What happened in a run, and when.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rowscan_emulator::clock::SimClock;
use rowscan_ports::clock::Stopwatch;
use rowscan_protocol::time::SimTime;
use rowscan_vehicle::Tractor;
use serde::{Deserialize, Serialize};

/// The event that ends every run.
pub(crate) const END: &str = "end";

/// The metres of an event such as `row:1.5`: the tractor passes there.
pub(crate) fn row_place(event: &str) -> Option<f64> {
    event.strip_prefix("row:")?.parse().ok().filter(|row_m: &f64| row_m.is_finite())
}

/// Something that happened.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// Whose and what, such as `sut.exited`.
    pub event: String,
    /// Simulated seconds since the start of time.
    pub t_s: f64,
    /// Where the tractor was, metres along the row.
    pub row_m: f64,
    /// Host seconds since the start of the run.
    pub wall_s: f64,
    /// More about it.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub detail: String,
}

impl Event {
    /// When it happened.
    pub(crate) fn at(&self) -> SimTime {
        SimTime((self.t_s * 1e9).round() as u64)
    }

    /// In words, the host's time left out.
    pub fn words(&self) -> String {
        let detail = if self.detail.is_empty() { String::new() } else { format!(": {}", self.detail) };
        format!("{:.3} s, {:.2} m: {}{detail}", self.t_s, self.row_m, self.event)
    }
}

/// The events of one run, in their order. Clones share it.
#[derive(Clone, Debug)]
pub(crate) struct Journal {
    clock: Arc<SimClock>,
    tractor: Tractor,
    stopwatch: Stopwatch,
    events: Arc<Mutex<Vec<Event>>>,
}

impl Journal {
    pub(crate) fn new(clock: Arc<SimClock>, tractor: Tractor) -> Self {
        Self { clock, tractor, stopwatch: Stopwatch::start(), events: Arc::default() }
    }

    /// Simulated time now.
    pub(crate) fn now(&self) -> SimTime {
        self.clock.now()
    }

    /// Host seconds since the start of the run.
    pub(crate) fn wall_s(&self) -> f64 {
        self.stopwatch.elapsed().as_secs_f64()
    }

    /// Where the tractor is at `at`, metres along the row.
    pub(crate) fn row_m(&self, at: SimTime) -> f64 {
        self.tractor.motion(at).place.y_m
    }

    /// How far the tractor has come over ground by `at`, metres; less in reverse.
    pub(crate) fn way_m(&self, at: SimTime) -> f64 {
        self.tractor.motion(at).way_m
    }

    /// When the tractor was first `row_m` along the row, by `until`; none where it has not come there. To the nanosecond, of a drive that goes one way.
    pub(crate) fn passed(&self, row_m: f64, until: SimTime) -> Option<SimTime> {
        let mut low = self.began()?;
        // It may go on to the end of the row and come back: the first second in which it is there.
        let mut high = low;
        while self.row_m(high) < row_m {
            if high >= until {
                return None;
            }
            low = high;
            high = SimTime((high.0 + 20_000_000).min(until.0));
        }
        while high.0 - low.0 > 1 {
            let middle = SimTime(low.0 + (high.0 - low.0) / 2);
            if self.row_m(middle) < row_m { low = middle } else { high = middle }
        }
        Some(high)
    }

    /// When the drive has started; none while the tractor stands and waits.
    pub(crate) fn began(&self) -> Option<SimTime> {
        self.tractor.began()
    }

    pub(crate) fn note(&self, event: impl Into<String>, detail: impl Into<String>) {
        self.note_at(event, detail, self.now());
    }

    /// Notes what happened at `at`.
    pub(crate) fn note_at(&self, event: impl Into<String>, detail: impl Into<String>, at: SimTime) {
        let event = Event {
            event: event.into(),
            t_s: at.as_secs_f64(),
            row_m: self.row_m(at),
            wall_s: self.wall_s(),
            detail: detail.into(),
        };
        self.lock().push(event);
    }

    /// What was noted later than `at` happened then.
    pub(crate) fn back_to(&self, at: SimTime) {
        let (t_s, row_m) = (at.as_secs_f64(), self.row_m(at));
        for event in self.lock().iter_mut().filter(|event| event.t_s > t_s) {
            (event.t_s, event.row_m) = (t_s, row_m);
        }
    }

    /// How many events there are so far.
    pub(crate) fn len(&self) -> usize {
        self.lock().len()
    }

    /// When the event called `name` was first.
    pub(crate) fn first(&self, name: &str) -> Option<SimTime> {
        self.lock().iter().find(|event| event.event == name).map(Event::at)
    }

    /// All events so far.
    pub(crate) fn events(&self) -> Vec<Event> {
        self.lock().clone()
    }

    fn lock(&self) -> MutexGuard<'_, Vec<Event>> {
        self.events.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
/// True if what has this id ended where it began, each time.
pub(crate) fn over_at_once(events: &[Event], id: &str) -> bool {
    let end = format!("{id}.end");
    let times = |name: &str| {
        let named = events.iter().filter(|event| event.event == name);
        named.map(|event| event.t_s).collect::<Vec<_>>()
    };
    let (began, ended) = (times(id), times(&end));
    !began.is_empty() && began == ended
}
