//! The time of recordings that are watched: it may stand still, go to a place, and go back.

use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};
use std::thread;
use std::time::Duration;

use rowscan_control::{Bench, Log, Refused, Seeking, Time, TimeState, Wait};
use rowscan_emulator::clock::{SimClock, TimeScale};
use rowscan_emulator::replay::Playhead;
use rowscan_faults::FaultControl;
use rowscan_ports::clock;
use rowscan_recording::Recording;

/// Between two looks at a tape that stands, or has not come to the next scan: a press of a button is followed so soon.
const LOOK_EVERY: Duration = Duration::from_millis(20);

/// One place in recorded time, counted from the first packet of each recording. Clones share it.
#[derive(Clone)]
pub(in super::super) struct Tape(Arc<Shared>);

struct Shared {
    clock: Arc<SimClock>,
    playhead: Playhead,
    /// When the last recording ends, once the files have been read to their ends.
    ends: OnceLock<Duration>,
}

/// What one reader of a recording has seen of the tape.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct TapeReader {
    /// How often the tape had been moved.
    jumps: u32,
    /// The last place that was reached.
    reached: Duration,
}

impl Tape {
    /// Of the recordings in these files. It runs from now on.
    pub(in super::super) fn of(files: Vec<PathBuf>) -> Self {
        let clock = Arc::new(SimClock::start(TimeScale::Paced(1.0)));
        let shared = Arc::new(Shared { clock, playhead: Playhead::new(0), ends: OnceLock::new() });
        let found = Arc::downgrade(&shared);
        // Long files take a while; who watches need not wait for that.
        thread::spawn(move || {
            let ends = files.iter().filter_map(|file| length(file)).max();
            if let Some((shared, ends)) = found.upgrade().zip(ends) {
                let _ = shared.ends.set(ends);
            }
        });
        Self(shared)
    }

    /// It in the hands of whoever looks at the page: nothing goes wrong with a recording.
    pub(super) fn bench(&self) -> Bench {
        let (faults, _) = FaultControl::new(0, Arc::clone(&self.0.clock) as _, None);
        Bench::new(faults, Arc::new(self.clone()), Log::default(), Vec::new())
    }

    /// Waits until it has come to `at`; false if it was sent back to before what `reader` has read. Cancel safe.
    pub(super) async fn reach(&self, at: Duration, reader: &mut TapeReader) -> bool {
        self.0.playhead.begin(self.0.clock.now());
        while self.place() < at {
            if self.is_sent_back(reader) {
                return false;
            }
            clock::rest(self.left(at).min(LOOK_EVERY)).await;
        }
        reader.reached = at;
        !self.is_sent_back(reader)
    }

    /// Waits until it is sent back to before what `reader` has read. Cancel safe.
    pub(super) async fn sent_back(&self, reader: &mut TapeReader) {
        while !self.is_sent_back(reader) {
            clock::rest(LOOK_EVERY).await;
        }
    }

    /// The host's time until it comes to `at`, if it runs on as it does.
    fn left(&self, at: Duration) -> Duration {
        let left = at.saturating_sub(self.place());
        match self.0.clock.scale() {
            TimeScale::Paced(scale) if !self.is_paused() => left.div_f64(scale.max(f64::MIN_POSITIVE)),
            _ => LOOK_EVERY,
        }
    }

    fn is_paused(&self) -> bool {
        self.0.playhead.place(self.0.clock.now()).1
    }

    fn is_sent_back(&self, reader: &mut TapeReader) -> bool {
        let (jumps, _) = self.0.playhead.jumps();
        let jumped = std::mem::replace(&mut reader.jumps, jumps) != jumps;
        jumped && self.place() < reader.reached
    }

    fn place(&self) -> Duration {
        Duration::from_nanos(self.0.playhead.place(self.0.clock.now()).0)
    }
}

impl Time for Tape {
    fn state(&self) -> TimeState {
        let ends = self.0.ends.get().copied();
        let place = self.place().min(ends.unwrap_or(Duration::MAX));
        TimeState {
            mode: "paced",
            now_s: place.as_secs_f64(),
            paused: self.is_paused(),
            scale: match self.0.clock.scale() {
                TimeScale::Paced(scale) => Some(scale),
                TimeScale::Max => None,
            },
            recorded_s: Some(place.as_secs_f64()),
            recorded_span_s: ends.map(|ends| [0.0, ends.as_secs_f64()]),
            ..TimeState::default()
        }
    }

    fn pause(&self, paused: bool) {
        self.0.playhead.pause(paused, self.0.clock.now());
    }

    fn set_scale(&self, scale: f64) -> Result<(), Refused> {
        self.0.clock.set_scale(scale).map_err(|error| Refused(error.to_string()))
    }

    fn step(&self, _count: u64) -> Result<u64, Refused> {
        Err(Refused("a recording has no steps: POST /clock pauses it and seeks".to_owned()))
    }

    fn stepped(&self, _last: u64) -> Wait {
        Box::pin(std::future::pending())
    }

    fn seek(&self, place: &str) -> Seeking {
        let wrong = || {
            Refused(format!(
                "expected a place such as `12.5s`, found `{place}`; `rowscan replay FILE --web` knows places by scan and metre"
            ))
        };
        let seconds = place.strip_suffix('s').and_then(|seconds| seconds.parse::<f64>().ok());
        let place = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok()).ok_or_else(wrong);
        let ends = self.0.ends.get().copied().ok_or_else(|| {
            Refused(
                "the recording is not read to its end yet: ask again, or it has no times to go by".to_owned(),
            )
        });
        let found = place.and_then(|place| match ends? {
            ends if place <= ends => Ok(place),
            ends => Err(Refused(format!(
                "there is no second {}: the recording ends after {:.3} s",
                place.as_secs_f64(),
                ends.as_secs_f64()
            ))),
        });
        Box::pin(std::future::ready(
            found.map(|place| self.0.playhead.seek(nanoseconds(place).into(), self.0.clock.now())),
        ))
    }
}

/// From a recording's first packet to its last; none where its packets have no times.
fn length(file: &Path) -> Option<Duration> {
    // What is no file, as a pipe, is read only once.
    let mut recording = file.is_file().then(|| Recording::open(file).ok()).flatten()?;
    let mut ends_ns = None;
    // One that breaks off ends there.
    while let Ok(Some(packet)) = recording.next_packet() {
        ends_ns = ends_ns.max(packet.at_ns);
    }
    let length_ns = ends_ns?.saturating_sub(recording.began_ns()?);
    (length_ns > 0).then(|| Duration::from_nanos(length_ns))
}

fn nanoseconds(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).unwrap_or(u64::MAX)
}
