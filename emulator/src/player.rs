//! What feeds the clients of a replayed recording: one tape in the place of all mirrors and voices, so that streams that were recorded
//! together keep their order and their times.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use rowscan_protocol::time::SimTime;
use tokio::sync::watch;
use tokio::task::JoinSet;

use super::lateness::Lateness;
use super::outlet::{OnItsWay, Outlet};
use crate::clock::{Pacer, SimClock, Timer};
use crate::replay::{Playback, PlaybackEvent, Playhead};
use rowscan_ports::clock as host;
use rowscan_ports::task;

/// How long a tape on a paced clock stays for clients that have not read its end, host time.
const FLUSH_TIMEOUT: Duration = Duration::from_secs(2);
/// How long a tape on a clock that waits for its clients stays for faults that let nothing go, host time.
const HELD_TIMEOUT: Duration = Duration::from_secs(10);
/// How long a tape stays for what faults hold back, however slowly they let it go, host time.
const HELD_AT_MOST: Duration = Duration::from_secs(60);

/// A recording being played. Dropping it stops the tape and closes its lines and buses; its scanners live on without scans.
#[derive(Debug)]
pub struct Player {
    tracks: Arc<Vec<Track>>,
    ended: watch::Receiver<bool>,
    tasks: JoinSet<()>,
}

/// What became of one stream.
#[derive(Debug, Default)]
struct Track {
    played: AtomicU64,
    lateness: Lateness,
}

impl Player {
    /// Plays `tape` at `clock`'s pace from where `playhead` stands, its streams to `outlets` in the same order. It begins once every scanner
    /// among them has somebody who wants what it sends.
    pub fn start(
        tape: Playback,
        outlets: Vec<Outlet>,
        playhead: Arc<Playhead>,
        clock: Arc<SimClock>,
        timer: &Timer,
    ) -> Self {
        let tracks: Arc<Vec<Track>> = Arc::new(outlets.iter().map(|_| Track::default()).collect());
        let (end, ended) = watch::channel(false);
        let mut tasks = JoinSet::new();
        for outlet in &outlets {
            outlet.listen(&clock, &mut tasks);
        }
        let pacer = Pacer::new(&clock, timer);
        let reel = PlaybackLoop { tape, outlets, playhead, clock, pacer, tracks: Arc::clone(&tracks) };
        tasks.spawn(task(async move {
            reel.play().await;
            end.send_replace(true);
        }));
        Self { tracks, ended, tasks }
    }

    /// Resolves when the tape has been played to its end and every client has all of it. Cancel safe.
    pub async fn ended(&self) {
        let mut ended = self.ended.clone();
        // An end that is dropped is one, too.
        let _ = ended.wait_for(|ended| *ended).await;
    }

    /// Stops the tape, and returns once it does nothing any more.
    pub async fn stop(mut self) {
        self.tasks.shutdown().await;
    }

    /// How much of stream number `track` has been played: telegrams, sentences, frames.
    pub fn played(&self, track: usize) -> u64 {
        self.tracks.get(track).map_or(0, |track| track.played.load(Ordering::Relaxed))
    }

    /// Host time by which `fraction` of what was played of stream number `track` was late at most.
    pub fn lateness(&self, track: usize, fraction: f64) -> Option<Duration> {
        self.tracks.get(track)?.lateness.quantile(fraction)
    }
}

/// The tape and all it goes by.
struct PlaybackLoop {
    tape: Playback,
    outlets: Vec<Outlet>,
    playhead: Arc<Playhead>,
    clock: Arc<SimClock>,
    pacer: Pacer,
    tracks: Arc<Vec<Track>>,
}

impl PlaybackLoop {
    /// Plays to the end, and waits until the clients have all of it.
    async fn play(mut self) {
        for outlet in &self.outlets {
            outlet.taker(&self.clock).await;
        }
        let mut watch = self.playhead.watch();
        self.playhead.begin(self.clock.now());
        let mut jumps = self.playhead.jumps().0;
        loop {
            let mut event = match self.tape.next() {
                Ok(Some(event)) => event,
                Ok(None) => break,
                Err(cause) => {
                    tracing::warn!(%cause, "the recording cannot be read on");
                    break;
                }
            };
            let due = loop {
                let (moved, to) = self.playhead.jumps();
                if moved != jumps {
                    jumps = moved;
                    if let Err(cause) = self.tape.seek(to) {
                        tracing::warn!(%cause, "the recording cannot be read again");
                    }
                    break None;
                }
                match self.playhead.due(event.at_ns) {
                    None => watch.changed().await,
                    Some(due) => tokio::select! {
                        () = self.pacer.reach(&self.clock, due) => break Some(due),
                        () = watch.changed() => {}
                    },
                }
            };
            if let Some(due) = due {
                self.tape.stamp(&mut event, due);
                self.put(&event, due).await;
            }
        }
        for outlet in &self.outlets {
            outlet.leave().await;
        }
        drain(&self.outlets, &self.clock).await;
    }

    async fn put(&mut self, event: &PlaybackEvent, due: SimTime) {
        // A clock that waits for its clients waits for one that has stopped the scanner, or comes back, too.
        if self.clock.delivery().is_patient()
            && let Some(outlet) = self.outlets.get(event.track)
        {
            outlet.taker(&self.clock).await;
        }
        let late = self.clock.lateness(due);
        let Some(outlet) = self.outlets.get_mut(event.track) else { return };
        if outlet.put(event, due).await
            && let Some(track) = self.tracks.get(event.track)
        {
            track.lateness.note(late);
            track.played.fetch_add(1, Ordering::Relaxed);
        }
        if outlet.sets_the_pace() {
            self.playhead.hold_up(self.clock.now().0.saturating_sub(due.0));
        }
    }
}

/// Waits until the clients have all of it. What they do not take on a paced clock, and what faults do not let go on any, is given up and counted.
async fn drain(outlets: &[Outlet], clock: &SimClock) {
    let drained = async {
        for outlet in outlets {
            outlet.drain(clock).await;
        }
    };
    let is_patient = clock.delivery().is_patient();
    let look = if is_patient { HELD_TIMEOUT } else { FLUSH_TIMEOUT };
    let mut drained = std::pin::pin!(drained);
    let (since, mut before) = (host::Stopwatch::start(), on_its_way(outlets));
    while host::within(look, drained.as_mut()).await.is_none() {
        let now = on_its_way(outlets);
        let goes_on = now.held > 0 && now != before && since.elapsed() < HELD_AT_MOST;
        // On a patient clock clients are waited for however slow they are; on a paced one nobody is who does not read.
        let waits = is_patient && (now.held == 0 || now.queued > 0);
        if !goes_on && !waits {
            return outlets.iter().for_each(Outlet::give_up);
        }
        before = now;
    }
}

fn on_its_way(outlets: &[Outlet]) -> OnItsWay {
    outlets.iter().map(Outlet::on_its_way).fold(OnItsWay::default(), OnItsWay::and)
}
