//! The virtual scanner: a mirror that turns in simulated time, a device that turns lines into telegrams, and the clients
//! that listen.
//!
//! One task turns the mirror ([`mirror`]), one task serves each client ([`connection`]); they share the device behind a lock
//! and meet in bounded queues. The byte path to a client is one place, [`connection::serve`].

mod connection;
mod listener;
mod mirror;
mod roster;
mod world;

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rowscan_protocol::device::{Device, DialectPolicy};
use tokio::sync::Notify;
use tokio::task::JoinSet;

pub use listener::{Bound, ListenError};
pub(crate) use mirror::Turns;
pub(crate) use world::Drive;
pub use world::{World, WorldError};

use crate::clock::{Latency, SimClock, TimeScale};
use roster::Roster;

/// Clients served at once, unless told otherwise.
pub const MAX_CLIENTS: usize = 32;

/// How a virtual scanner is run.
#[derive(Clone, Copy, Debug)]
pub struct EmulatorConfig {
    /// How simulated time runs.
    pub time_scale: TimeScale,
    /// Which dialects are answered.
    pub dialects: DialectPolicy,
    /// Clients served at once.
    pub max_clients: usize,
}

impl Default for EmulatorConfig {
    fn default() -> Self {
        Self { time_scale: TimeScale::Paced(1.0), dialects: DialectPolicy::Auto, max_clients: MAX_CLIENTS }
    }
}

/// What all tasks of one virtual scanner share.
#[derive(Debug)]
pub struct Shared {
    device: Mutex<Device>,
    clock: SimClock,
    roster: Roster,
    /// Rung when a client's interest changes, so that a waiting mirror looks again.
    interest: Notify,
    config: EmulatorConfig,
    counts: Counts,
    latency: Latency,
}

#[derive(Debug, Default)]
struct Counts {
    sent: AtomicU64,
    dropped: AtomicU64,
    refused: AtomicU64,
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
    fn device(&self) -> MutexGuard<'_, Device> {
        self.device.lock().unwrap_or_else(PoisonError::into_inner)
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
        let shared = Arc::new(Shared {
            device: Mutex::new(device),
            clock: SimClock::start(config.time_scale),
            roster: Roster::new(config.max_clients),
            interest: Notify::new(),
            config,
            counts: Counts::default(),
            latency: Latency::default(),
        });
        let mut tasks = JoinSet::new();
        tasks.spawn(mirror::turn(Arc::clone(&shared), world));
        Self { shared, tasks }
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

    /// Host time telegrams take to their user, if the user reports back.
    pub fn latency(&self) -> &Latency {
        &self.shared.latency
    }
}
