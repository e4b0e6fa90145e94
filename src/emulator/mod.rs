//! The virtual scanner: a mirror that turns in simulated time, a device that turns lines into telegrams, and the clients
//! that listen.
//!
//! One task turns the mirror (`mirror`), one task serves each client (`connection`); they share the device behind a lock
//! and meet in bounded queues. The byte path to a client is one place, `connection::serve`.

mod connection;
mod lateness;
mod listener;
mod mirror;
mod outlet;
mod player;
mod roster;
mod serial;
mod serial_tape;
mod state_file;
mod tractor;
mod voices;
mod world;

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rowscan_protocol::device::{Device, DialectPolicy, DigitalLineError, Reply, Session};
use rowscan_protocol::time::SimTime;
use rowscan_recording::{StreamKind, Taps};
use tokio::sync::{Notify, watch};
use tokio::task::JoinSet;

pub use listener::{Bound, ListenError};
pub(crate) use mirror::Turns;
pub use outlet::Outlet;
pub use player::Player;
pub use serial::{SerialConfig, SerialCounts, SerialEmulator};
pub use state_file::{StateFile, StateFileError};
pub use tractor::Tractor;
pub use voices::Voices;
pub use world::{World, WorldError};

use crate::backlog::Backlog;
use crate::clock::{Latency, SimClock, TimeScale, Timer};
use crate::replay::{self, Part, Prompter, Script};
use roster::Roster;

/// Clients served at once, unless told otherwise.
pub const MAX_CLIENTS: usize = 32;

/// How a virtual scanner is run.
#[derive(Clone, Debug)]
pub struct EmulatorConfig {
    /// How simulated time runs.
    pub time_scale: TimeScale,
    /// What wakes the mirror; scanners of one process share it.
    pub timer: Timer,
    /// Which dialects are answered.
    pub dialects: DialectPolicy,
    /// Clients served at once.
    pub max_clients: usize,
    /// Where mEEwriteall keeps the settings.
    pub state: Option<StateFile>,
    /// Digital lines that change on the way, in any order.
    pub line_changes: Vec<LineChange>,
    /// Who measures the host time that scan telegrams take to their user, if anyone.
    pub latency: Option<Arc<Latency>>,
    /// Where copies of all bytes go, a stream a client; nowhere unless something records.
    pub taps: Taps,
    /// What those streams are called; as the model is, where absent.
    pub stream: Option<String>,
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
    pub fn apply(&self, device: &mut Device) -> Result<(), DigitalLineError> {
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
            timer: Timer::default(),
            dialects: DialectPolicy::Auto,
            max_clients: MAX_CLIENTS,
            state: None,
            line_changes: Vec::new(),
            latency: None,
            taps: Taps::default(),
            stream: None,
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
    /// Telegrams on their way to clients.
    backlog: Backlog,
    config: EmulatorConfig,
    counts: Counts,
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
    missed: AtomicU64,
    refused: AtomicU64,
}

/// What a virtual scanner has done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EmulatorCounts {
    /// Scan telegrams handed to clients, one a client.
    pub scans_sent: u64,
    /// Scan telegrams a client was too slow to take.
    pub scans_dropped: u64,
    /// Scans left out because the host was too slow for the mirror.
    pub scans_missed: u64,
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
            backlog: Backlog::default(),
            config,
            counts: Counts::default(),
        })
    }

    /// A recorded stream goes out as it was, and nobody is answered.
    fn is_verbatim(&self) -> bool {
        matches!(self.program, Program::Verbatim(..))
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
        let clock = Arc::new(SimClock::start(config.time_scale));
        Self::start_on(clock, device, world, voices, config)
    }

    /// The same by a clock that other scanners of the tractor turn by too. Each of them keeps its own time where the clock waits for its
    /// clients, so let them share a paced one.
    pub fn start_on(
        clock: Arc<SimClock>,
        device: Device,
        world: World,
        voices: Voices,
        config: EmulatorConfig,
    ) -> Self {
        let (speaking, listening) = voices.start(clock.scale(), &config.taps);
        let shared = Shared::new(device, Program::Device, clock, config);
        let mut tasks = JoinSet::new();
        if let Some((can, inbox)) = listening {
            tasks.spawn(voices::listen(Arc::clone(&shared.clock), can, inbox));
        }
        tasks.spawn(mirror::turn(Arc::clone(&shared), world, speaking));
        Self { shared, tasks }
    }

    /// A recorded scanner, or any recorded stream: its script comes before `device`'s own answers; `verbatim`, nobody is answered. A
    /// [`Player`] gives it what it sends by itself.
    pub fn replay(
        device: Device,
        part: &Part,
        verbatim: bool,
        clock: Arc<SimClock>,
        config: EmulatorConfig,
    ) -> Self {
        let name = part.name.clone();
        let program = match part.is_verbatim(verbatim) {
            true => Program::Verbatim(name, part.kind),
            false => Program::Script(name, Arc::clone(&part.script)),
        };
        Self { shared: Shared::new(device, program, clock, config), tasks: JoinSet::new() }
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
            scans_missed: counts.missed.load(Ordering::Relaxed),
            connections_refused: counts.refused.load(Ordering::Relaxed),
        }
    }

    /// The clock its mirror turns by.
    pub fn clock(&self) -> &SimClock {
        &self.shared.clock
    }
}
