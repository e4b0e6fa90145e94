//! The virtual scanner: a mirror that turns in simulated time, a device that turns lines into telegrams, and the clients
//! that listen.
//!
//! One task turns the mirror (`mirror`), one task serves each client (`connection`); they share the device behind a lock
//! and meet in bounded queues. The byte path to a client is one place, `connection::serve`.

mod connection;
mod lateness;
mod listener;
mod mirror;
mod roster;
mod serial;
mod state_file;
mod tape;
mod tractor;
mod voices;
mod world;

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rowscan_protocol::device::{Device, DialectPolicy, LineError, Reply, Session};
use rowscan_protocol::time::SimTime;
use rowscan_recording::{StreamKind, Taps};
use tokio::sync::{Notify, watch};
use tokio::task::JoinSet;

pub use listener::{Bound, ListenError};
pub(crate) use mirror::Turns;
pub use serial::{SerialConfig, SerialCounts, SerialEmulator};
pub use state_file::{StateFile, StateFileError};
pub use tractor::Tractor;
pub use voices::Voices;
pub use world::{World, WorldError};

use crate::clock::{Latency, SimClock, TimeScale, Timer};
use crate::replay::{self, Playhead, Prompter, Script, Tape};
use lateness::Lateness;
use roster::Roster;

/// Clients served at once, unless told otherwise.
pub const MAX_CLIENTS: usize = 32;

/// How a virtual scanner is run.
#[derive(Clone, Debug)]
pub struct EmulatorConfig {
    /// How simulated time runs.
    pub time_scale: TimeScale,
    /// What wakes the mirror.
    pub timer: Timer,
    /// Which dialects are answered.
    pub dialects: DialectPolicy,
    /// Clients served at once.
    pub max_clients: usize,
    /// Where mEEwriteall keeps the settings.
    pub state: Option<StateFile>,
    /// Digital lines that change on the way, in any order.
    pub line_changes: Vec<LineChange>,
    /// Where copies of all bytes go, a stream a client; nowhere unless something records.
    pub taps: Taps,
}

/// A digital line that is switched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LineChange {
    /// When.
    pub at: SimTime,
    /// An output; else an input.
    pub output: bool,
    /// Which, from 1.
    pub number: u8,
    /// On; else off.
    pub on: bool,
}

impl LineChange {
    /// Switches it on `device`.
    pub fn apply(&self, device: &mut Device) -> Result<(), LineError> {
        match self.output {
            true => device.set_output(self.at, self.number, self.on),
            false => device.set_input(self.at, self.number, self.on),
        }
    }
}

impl Default for EmulatorConfig {
    fn default() -> Self {
        Self {
            time_scale: TimeScale::Paced(1.0),
            timer: Timer::Runtime,
            dialects: DialectPolicy::Auto,
            max_clients: MAX_CLIENTS,
            state: None,
            line_changes: Vec::new(),
            taps: Taps::default(),
        }
    }
}

/// What all tasks of one virtual scanner share.
#[derive(Debug)]
pub struct Shared {
    device: Mutex<Device>,
    clock: Arc<SimClock>,
    program: Program,
    roster: Roster,
    /// Rung when a client's interest changes, so that a waiting mirror looks again.
    interest: Notify,
    /// A client of a replayed device has polled for scans: it takes them without a subscription.
    polled: AtomicBool,
    /// How often the device's lines have changed and it has restarted: connections look when this changes.
    news: watch::Sender<(u32, u32)>,
    config: EmulatorConfig,
    counts: Counts,
    latency: Latency,
    /// The tape has been played to its end, and every client has all of it.
    ended: watch::Sender<bool>,
}

/// Who answers.
#[derive(Debug)]
pub(crate) enum Program {
    /// The device.
    Device,
    /// A recorded device of that name, and the device where nothing was recorded.
    Script(String, Arc<Script>),
    /// Nobody: a stream of that name goes out as it was recorded.
    Verbatim(String, StreamKind),
}

#[derive(Debug, Default)]
struct Counts {
    sent: AtomicU64,
    dropped: AtomicU64,
    refused: AtomicU64,
    lateness: Lateness,
}

/// What a virtual scanner has done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EmulatorCounts {
    /// Scan telegrams handed to clients, one a client.
    pub scans_sent: u64,
    /// Scan telegrams a client was too slow to take.
    pub scans_dropped: u64,
    /// Connections turned away because the house was full.
    pub connections_refused: u64,
}

impl Shared {
    fn new(device: Device, program: Program, clock: Arc<SimClock>, config: EmulatorConfig) -> Arc<Self> {
        Arc::new(Self {
            device: Mutex::new(device),
            clock,
            program,
            roster: Roster::new(config.max_clients),
            interest: Notify::new(),
            polled: AtomicBool::new(false),
            news: watch::Sender::default(),
            config,
            counts: Counts::default(),
            latency: Latency::default(),
            ended: watch::Sender::new(false),
        })
    }

    fn device(&self) -> MutexGuard<'_, Device> {
        self.device.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Lets `session` answer, as it is prompted; the settings, if mEEwriteall was among the requests.
    fn converse(
        &self,
        session: &mut Session,
        prompter: Option<&mut Prompter>,
        bytes: &[u8],
        replies: &mut Vec<Reply>,
    ) -> Option<String> {
        let mut device = self.device();
        let saves = device.saves();
        let now = self.clock.now();
        match prompter {
            Some(prompter) => {
                session.handle_bytes_with(&mut device, now, bytes, replies, &mut |frame, reply| {
                    prompter.amend(frame, reply);
                    if replay::polls(frame) {
                        self.polled.store(true, Ordering::Relaxed);
                    }
                })
            }
            None => session.handle_bytes(&mut device, now, bytes, replies),
        }
        self.spread(&device);
        (device.saves() != saves).then(|| device.saved_settings())
    }

    /// Rings every connection if there is anything new about the device.
    fn spread(&self, device: &Device) {
        let news = (device.changes(), device.reboots());
        self.news.send_if_modified(|known| std::mem::replace(known, news) != news);
    }
}

/// A running virtual scanner. Dropping it ends its tasks and closes its connections.
#[derive(Debug)]
pub struct Emulator {
    shared: Arc<Shared>,
    tasks: JoinSet<()>,
}

impl Emulator {
    /// Starts the mirror of `device` in `world`. No one can connect until [`Emulator::listen`] or [`Emulator::attach`].
    pub fn start(device: Device, world: World, config: EmulatorConfig) -> Self {
        Self::start_with(device, world, Voices::default(), config)
    }

    /// The same with what else speaks on its tractor.
    pub fn start_with(device: Device, world: World, voices: Voices, config: EmulatorConfig) -> Self {
        let (speaking, listening) = voices.start(config.time_scale);
        let clock = Arc::new(SimClock::start(config.time_scale));
        let shared = Shared::new(device, Program::Device, clock, config);
        let mut tasks = JoinSet::new();
        if let Some((can, inbox)) = listening {
            tasks.spawn(voices::listen(Arc::clone(&shared), can, inbox));
        }
        tasks.spawn(mirror::turn(Arc::clone(&shared), world, speaking));
        Self { shared, tasks }
    }

    /// Starts a recorded stream called `name`: its tape in the mirror's place, its script before `device`'s own answers. Streams that share
    /// clock and playhead stay in step; `number` is this tape's number there.
    pub fn replay(
        device: Device,
        name: &str,
        script: Arc<Script>,
        tape: Tape,
        (playhead, number): (Arc<Playhead>, usize),
        clock: Arc<SimClock>,
        config: EmulatorConfig,
    ) -> Self {
        let program = match tape.is_verbatim() {
            true => Program::Verbatim(name.to_owned(), tape.kind()),
            false => Program::Script(name.to_owned(), script),
        };
        let shared = Shared::new(device, program, clock, config);
        let mut tasks = JoinSet::new();
        tasks.spawn(tape::play(Arc::clone(&shared), tape::Reel { tape, playhead, number }));
        Self { shared, tasks }
    }

    /// Resolves when a tape has been played to its end and every client has all of it. Cancel safe.
    pub async fn ended(&self) {
        let mut ended = self.shared.ended.subscribe();
        // The sender lives as long as this emulator.
        let _ = ended.wait_for(|ended| *ended).await;
    }

    /// Host time by which `fraction` of what a tape sent was late at most.
    pub fn lateness(&self, fraction: f64) -> Option<Duration> {
        self.shared.counts.lateness.quantile(fraction)
    }

    /// Listens on `address` (port 0 takes a free one) and serves whoever connects.
    pub async fn listen(&mut self, address: &str) -> Result<Bound, ListenError> {
        let (listener, bound) = listener::bind(address).await?;
        self.tasks.spawn(listener::accept(Arc::clone(&self.shared), listener));
        Ok(bound)
    }

    /// Serves one client on any byte stream, as if it had connected.
    pub fn attach<S>(&mut self, stream: S)
    where
        S: tokio::io::AsyncRead + tokio::io::AsyncWrite + Send + 'static,
    {
        self.tasks.spawn(connection::serve(Arc::clone(&self.shared), stream));
    }

    /// What it has done so far.
    pub fn counts(&self) -> EmulatorCounts {
        let counts = &self.shared.counts;
        EmulatorCounts {
            scans_sent: counts.sent.load(Ordering::Relaxed),
            scans_dropped: counts.dropped.load(Ordering::Relaxed),
            connections_refused: counts.refused.load(Ordering::Relaxed),
        }
    }

    /// The clock its mirror turns by.
    pub fn clock(&self) -> &SimClock {
        &self.shared.clock
    }

    /// Host time telegrams take to their user, if the user reports back.
    pub fn latency(&self) -> &Latency {
        &self.shared.latency
    }
}
