//! A replay's time in others' hands.

use std::sync::Arc;

use rowscan_control::{Refused, Seeking, Time, TimeState, Wait};
use rowscan_emulator::clock::{SimClock, TimeScale};
use rowscan_emulator::replay::Playhead;
use tokio::sync::{mpsc, oneshot};

use super::places::Seek;

/// Places asked for that may wait.
const ORDERS: usize = 16;

/// The clock and the playhead of a replay.
pub(super) struct ReplayTime {
    clock: Arc<SimClock>,
    playhead: Arc<Playhead>,
    /// Where each round begins, and how long it is; none if it is played once.
    round: Option<(u64, u64)>,
    /// Where it begins and ends, ns.
    span_ns: [u64; 2],
    seeks: mpsc::Sender<SeekRequest>,
}

/// A place that is asked for, and who waits to be told whether there is one.
pub(super) struct SeekRequest {
    pub(super) place: Seek,
    pub(super) done: oneshot::Sender<Result<(), Refused>>,
}

impl ReplayTime {
    /// With the places that are asked for: finding one takes a look into the recording.
    pub(super) fn new(
        clock: Arc<SimClock>,
        playhead: Arc<Playhead>,
        round: Option<(u64, u64)>,
        span_ns: [u64; 2],
    ) -> (Self, mpsc::Receiver<SeekRequest>) {
        let (seeks, asked) = mpsc::channel(ORDERS);
        (Self { clock, playhead, round, span_ns, seeks }, asked)
    }
}

impl Time for ReplayTime {
    fn state(&self) -> TimeState {
        let now = self.clock.now();
        let (place_ns, paused) = self.playhead.place(now);
        // Rounds follow one another on the playhead; the recording has only one.
        let place_ns = match self.round {
            Some((begins_ns, every_ns)) if place_ns > begins_ns => {
                begins_ns + (place_ns - begins_ns) % every_ns
            }
            _ => place_ns,
        };
        let scale = match self.clock.scale() {
            TimeScale::Paced(scale) => Some(scale),
            TimeScale::Max => None,
        };
        TimeState {
            mode: if scale.is_some() { "paced" } else { "max" },
            now_s: now.as_secs_f64(),
            paused,
            scale,
            recorded_s: Some(place_ns as f64 * 1e-9),
            recorded_span_s: Some(self.span_ns.map(|ns| ns as f64 * 1e-9)),
            ..TimeState::default()
        }
    }

    /// Faults stand still with the recording.
    fn pause(&self, paused: bool) {
        if paused {
            self.playhead.pause(true, self.clock.now());
            self.clock.pause(true);
        } else {
            self.clock.pause(false);
            self.playhead.pause(false, self.clock.now());
        }
    }

    fn set_scale(&self, scale: f64) -> Result<(), Refused> {
        self.clock.set_scale(scale).map_err(|error| Refused(error.to_string()))
    }

    fn step(&self, _count: u64) -> Result<u64, Refused> {
        Err(Refused("a recording has no steps: POST /clock pauses it and seeks".to_owned()))
    }

    fn stepped(&self, _last: u64) -> Wait {
        Box::pin(std::future::pending())
    }

    fn seek(&self, place: &str) -> Seeking {
        let (place, seeks) = (place.parse(), self.seeks.clone());
        Box::pin(async move {
            let (done, answer) = oneshot::channel();
            let asked = SeekRequest { place: place.map_err(Refused)?, done };
            seeks.try_send(asked).map_err(|_| Refused("too many places are asked for at once".to_owned()))?;
            answer.await.unwrap_or_else(|_| Err(Refused("the replay has ended".to_owned())))
        })
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[tokio::test(start_paused = true)]
    async fn the_whole_of_time_stands_while_a_replay_is_paused() {
        let clock = Arc::new(SimClock::start(TimeScale::Paced(2.0)));
        let playhead = Arc::new(Playhead::new(1000));
        playhead.begin(clock.now());
        let (time, _seeks) = ReplayTime::new(Arc::clone(&clock), playhead, None, [1000, u64::MAX]);
        let after = async |seconds: u64| {
            let before = time.state();
            tokio::time::advance(Duration::from_secs(seconds)).await;
            let now = time.state();
            let recorded_s = |state: &TimeState| state.recorded_s.expect("a recording");
            [now.now_s - before.now_s, recorded_s(&now) - recorded_s(&before)]
        };
        let is = |passed: [f64; 2], expected: f64| passed.iter().all(|s| (s - expected).abs() < 1e-3);
        assert!(is(after(3).await, 6.0));
        time.pause(true);
        assert!(time.state().paused && is(after(3).await, 0.0));
        time.pause(false);
        assert!(!time.state().paused && is(after(3).await, 6.0));
    }
}
