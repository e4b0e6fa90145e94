//! Where a recording stands that is played: one place in recorded time, which runs with simulated time.

use rowscan_protocol::time::SimTime;
use tokio::sync::watch;

use super::moment::Moment;

/// The place a tape plays from. Recorded time stands still until it is begun, and while it is paused.
#[derive(Debug)]
pub struct Playhead {
    state: watch::Sender<State>,
}

#[derive(Clone, Copy, Debug)]
struct State {
    begun: bool,
    /// Runs from this recorded instant at that simulated one.
    running: Option<(SimTime, u64)>,
    /// Where it stands while it does not run.
    stands_at_ns: u64,
    paused: bool,
    /// Where it was moved to last.
    moved_to: Moment,
    /// How often it has been moved: the tape looks for its new place when this changes.
    jumps: u32,
}

impl Playhead {
    /// At the recorded instant `start_ns`.
    pub fn new(start_ns: u64) -> Self {
        let state = State {
            begun: false,
            running: None,
            stands_at_ns: start_ns,
            paused: false,
            moved_to: start_ns.into(),
            jumps: 0,
        };
        Self { state: watch::Sender::new(state) }
    }

    /// Everyone is there: time begins to run.
    pub fn begin(&self, now: SimTime) {
        self.state.send_modify(|state| {
            state.begun = true;
            state.run(now);
        });
    }

    /// Stops recorded time, or lets it run on.
    pub fn pause(&self, paused: bool, now: SimTime) {
        self.state.send_modify(|state| {
            state.stands_at_ns = state.place(now);
            state.running = None;
            state.paused = paused;
            state.run(now);
        });
    }

    /// Goes to this place of the recording.
    pub fn seek(&self, to: Moment, now: SimTime) {
        self.state.send_modify(|state| {
            (state.stands_at_ns, state.moved_to) = (to.at_ns, to);
            state.running = None;
            state.jumps = state.jumps.wrapping_add(1);
            state.run(now);
        });
    }

    /// What is still to come comes so much later, ns of simulated time: whoever takes it sets the pace.
    pub(crate) fn hold_up(&self, by_ns: u64) {
        self.state.send_if_modified(|state| {
            if let Some((since, _)) = &mut state.running {
                since.0 = since.0.saturating_add(by_ns);
            }
            // The tape, which holds it up, need not look.
            false
        });
    }

    /// The recorded instant that it stands at or plays, and whether somebody has paused it.
    pub fn place(&self, now: SimTime) -> (u64, bool) {
        let state = self.state.borrow();
        (state.place(now), state.paused)
    }

    /// When the recorded instant `at_ns` is due; none while time stands still.
    pub(crate) fn due(&self, at_ns: u64) -> Option<SimTime> {
        let (since, from_ns) = self.state.borrow().running?;
        // What lies before the place it began at is due at once.
        Some(SimTime(since.0.saturating_add(at_ns.saturating_sub(from_ns))))
    }

    /// Where it was moved to last, and how often it has been.
    pub fn jumps(&self) -> (u32, Moment) {
        let state = self.state.borrow();
        (state.jumps, state.moved_to)
    }

    /// Tells when anything about it changes.
    pub(crate) fn watch(&self) -> Watch {
        Watch(self.state.subscribe())
    }
}

/// The tape's eye on the playhead.
#[derive(Debug)]
pub(crate) struct Watch(watch::Receiver<State>);

impl Watch {
    /// Resolves when the playhead has been told something since the last time. Cancel safe.
    pub(crate) async fn changed(&mut self) {
        if self.0.changed().await.is_err() {
            std::future::pending::<()>().await;
        }
    }
}

impl State {
    fn run(&mut self, now: SimTime) {
        if self.begun && !self.paused && self.running.is_none() {
            self.running = Some((now, self.stands_at_ns));
        }
    }

    fn place(&self, now: SimTime) -> u64 {
        match self.running {
            Some((since, from_ns)) => from_ns + now.0.saturating_sub(since.0),
            None => self.stands_at_ns,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_runs_once_it_is_begun_and_not_paused() {
        let head = Playhead::new(1000);
        assert_eq!(head.due(1500), None);
        head.pause(true, SimTime(5));
        head.begin(SimTime(10));
        assert_eq!(head.due(1500), None);
        head.pause(false, SimTime(20));
        assert_eq!(head.due(1500), Some(SimTime(520)));
    }

    #[test]
    fn a_pause_shifts_what_is_still_to_come() {
        let head = Playhead::new(0);
        head.begin(SimTime(0));
        head.pause(true, SimTime(100));
        assert_eq!(head.due(150), None);
        head.pause(false, SimTime(1100));
        assert_eq!(head.due(150), Some(SimTime(1150)));
        head.seek(50.into(), SimTime(1200));
        assert_eq!(head.due(150), Some(SimTime(1300)));
        assert_eq!(head.jumps(), (1, 50.into()));
    }
}
