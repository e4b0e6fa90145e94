//! Where all tapes of a recording stand: one place in recorded time, which runs with simulated time.

use rowscan_protocol::time::SimTime;
use tokio::sync::watch;

/// The place all tapes play from. Recorded time stands still until every tape has a taker, and while it is paused.
#[derive(Debug)]
pub struct Playhead {
    state: watch::Sender<State>,
}

#[derive(Clone, Copy, Debug)]
struct State {
    /// Tapes nobody has asked for yet, a bit each.
    waiting: u64,
    /// Runs from this recorded instant at that simulated one.
    running: Option<(SimTime, u64)>,
    /// Where it stands while it does not run.
    stands_at_ns: u64,
    paused: bool,
    /// How often it has been moved: tapes look for their new place when this changes.
    jumps: u32,
}

impl Playhead {
    /// At the recorded instant `start_ns`, for so many tapes (64 at most).
    pub fn new(tapes: usize, start_ns: u64) -> Self {
        let waiting = u64::MAX.checked_shr(64 - tapes.clamp(1, 64) as u32).unwrap_or(u64::MAX);
        let state = State { waiting, running: None, stands_at_ns: start_ns, paused: false, jumps: 0 };
        Self { state: watch::Sender::new(state) }
    }

    /// Tape number `tape` has a taker; with the last one, time begins to run.
    pub fn taken(&self, tape: usize, now: SimTime) {
        self.state.send_if_modified(|state| {
            let before = state.waiting;
            state.waiting &= !(1_u64.checked_shl(tape as u32).unwrap_or_default());
            state.run(now);
            before != state.waiting
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

    /// Goes to the recorded instant `to_ns`.
    pub fn seek(&self, to_ns: u64, now: SimTime) {
        self.state.send_modify(|state| {
            state.stands_at_ns = to_ns;
            state.running = None;
            state.jumps = state.jumps.wrapping_add(1);
            state.run(now);
        });
    }

    /// When the recorded instant `at_ns` is due; none while time stands still.
    pub(crate) fn due(&self, at_ns: u64) -> Option<SimTime> {
        let (since, from_ns) = self.state.borrow().running?;
        // What lies before the place it began at is due at once.
        Some(SimTime(since.0.saturating_add(at_ns.saturating_sub(from_ns))))
    }

    /// Where it was moved to last, and how often it has been.
    pub(crate) fn jumps(&self) -> (u32, u64) {
        let state = self.state.borrow();
        (state.jumps, state.running.map_or(state.stands_at_ns, |(_, from_ns)| from_ns))
    }

    /// Tells when anything about it changes.
    pub(crate) fn watch(&self) -> Watch {
        Watch(self.state.subscribe())
    }
}

/// One tape's eye on the playhead.
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
        if self.waiting == 0 && !self.paused && self.running.is_none() {
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
    fn it_runs_once_every_tape_has_a_taker() {
        let head = Playhead::new(2, 1000);
        head.taken(0, SimTime(5));
        assert_eq!(head.due(1500), None);
        head.taken(1, SimTime(10));
        assert_eq!(head.due(1500), Some(SimTime(510)));
        // Taken again: nothing new.
        head.taken(0, SimTime(99));
        assert_eq!(head.due(1500), Some(SimTime(510)));
    }

    #[test]
    fn a_pause_shifts_what_is_still_to_come() {
        let head = Playhead::new(1, 0);
        head.taken(0, SimTime(0));
        head.pause(true, SimTime(100));
        assert_eq!(head.due(150), None);
        head.pause(false, SimTime(1100));
        assert_eq!(head.due(150), Some(SimTime(1150)));
        head.seek(50, SimTime(1200));
        assert_eq!(head.due(150), Some(SimTime(1300)));
        assert_eq!(head.jumps(), (1, 50));
    }
}
