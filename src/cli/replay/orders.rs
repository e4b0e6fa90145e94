//! A replay's time in others' hands.

use std::sync::Arc;

use rowscan_control::{Refused, Time, TimeState, Wait};
use rowscan_emulator::clock::{SimClock, TimeScale};
use rowscan_emulator::replay::Playhead;
use tokio::sync::mpsc;

use super::places::Seek;

/// Places asked for that may wait.
const ORDERS: usize = 16;

/// The clock and the playhead of a replay.
pub(super) struct ReplayTime {
    clock: Arc<SimClock>,
    playhead: Arc<Playhead>,
    seeks: mpsc::Sender<Seek>,
}

impl ReplayTime {
    /// With the places that are asked for: finding one takes a look into the recording.
    pub(super) fn new(clock: Arc<SimClock>, playhead: Arc<Playhead>) -> (Self, mpsc::Receiver<Seek>) {
        let (seeks, asked) = mpsc::channel(ORDERS);
        (Self { clock, playhead, seeks }, asked)
    }
}

impl Time for ReplayTime {
    fn state(&self) -> TimeState {
        let now = self.clock.now();
        let (place_ns, paused) = self.playhead.place(now);
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
            ..TimeState::default()
        }
    }

    fn pause(&self, paused: bool) {
        self.playhead.pause(paused, self.clock.now());
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

    fn seek(&self, place: &str) -> Result<(), Refused> {
        let place = place.parse().map_err(Refused)?;
        self.seeks.try_send(place).map_err(|_| Refused("too many places are asked for at once".to_owned()))
    }
}
