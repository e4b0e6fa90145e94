//! A virtual CoLa scanner as its user holds it: endpoints, clients, counts.
//!
//! One task serves each client (`connection`); the mirror turns on the rig's timeline (`mirror`). They share the device behind a lock
//! (`shared`) and meet in bounded queues. The byte path to a client is one place, `connection::serve`.

use std::net::SocketAddr;
use std::sync::{Arc, PoisonError, Weak};

use rowscan_ports::task;
use rowscan_protocol::device::Device;
use tokio::sync::Notify;
use tokio::task::JoinSet;

use crate::clock::SimClock;
use crate::connection;
use crate::device_handle::DeviceHandle;
use crate::listener::{self, Bound, ListenError};
use crate::refused_settings::RefusedSetting;
use crate::replay::Part;
use crate::running::Running;
use crate::search;
use crate::shared::{EmulatorConfig, EmulatorCounts, Program, Shared};

/// Tells what a virtual scanner has done.
#[derive(Clone, Debug)]
pub struct Counter(Weak<Shared>);

impl Counter {
    /// Its counts so far; none once it is gone.
    pub fn counts(&self) -> Option<EmulatorCounts> {
        self.0.upgrade().map(|shared| shared.counted())
    }

    /// Whether somebody takes its scans; none once it is gone.
    pub fn is_taken(&self) -> Option<bool> {
        self.0.upgrade().map(|shared| shared.has_taker())
    }

    /// How many clients are connected; none once it is gone.
    pub fn clients(&self) -> Option<usize> {
        self.0.upgrade().map(|shared| shared.roster.size())
    }
}

/// A running virtual scanner. Dropping it ends its tasks and closes its connections.
#[derive(Debug)]
pub struct Emulator {
    pub(crate) shared: Arc<Shared>,
    tasks: JoinSet<()>,
    /// Where it does not run with the rig it belongs to.
    #[expect(dead_code, reason = "its drop ends the timeline")]
    running: Option<Running>,
}

impl Emulator {
    pub(crate) fn of(shared: Arc<Shared>) -> Self {
        Self { shared, tasks: JoinSet::new(), running: None }
    }

    /// The same with the rig that it runs with and that ends with it.
    pub(crate) fn with_rig(self, running: Running) -> Self {
        Self { running: Some(running), ..self }
    }

    /// A recorded scanner, or any recorded stream: its script comes before `device`'s own answers; `verbatim`, nobody is answered. A
    /// [`Player`](crate::Player) gives it what it sends by itself.
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
        Self::of(Shared::new(device, program, clock, Arc::new(Notify::new()), config))
    }

    /// Listens on `address` (port 0 takes a free one) and serves whoever connects.
    pub async fn listen(&mut self, address: &str) -> Result<Bound, ListenError> {
        let (listener, bound) = listener::bind(address).await?;
        self.tasks.spawn(task(listener::accept(Arc::clone(&self.shared), listener)));
        Ok(bound)
    }

    /// Answers SICK's device search at `socket`'s address, as a scanner that is found at `found_at`.
    pub async fn answer_searches(
        &mut self,
        address: &str,
        found_at: SocketAddr,
    ) -> Result<Bound, ListenError> {
        let (socket, bound) = listener::bind_datagrams(address).await?;
        self.tasks.spawn(task(search::answer(Arc::clone(&self.shared), socket, found_at)));
        Ok(bound)
    }

    /// Serves one client on any byte stream, as if it had connected.
    pub fn attach<S>(&mut self, stream: S)
    where
        S: tokio::io::AsyncRead + tokio::io::AsyncWrite + Unpin + Send + 'static,
    {
        self.tasks.spawn(task(connection::serve(
            Arc::clone(&self.shared),
            "a line".to_owned(),
            stream,
            |_| (),
        )));
    }

    /// What it has done so far.
    pub fn counts(&self) -> EmulatorCounts {
        self.shared.counted()
    }

    /// A handle that tells its counts, and does not keep it running.
    pub fn counter(&self) -> Counter {
        Counter(Arc::downgrade(&self.shared))
    }

    /// Reaches the device, for another interface than CoLa.
    pub fn device_handle(&self) -> DeviceHandle {
        DeviceHandle(Arc::downgrade(&self.shared))
    }

    /// What a replay has refused because the recorded scans would have to be others.
    pub fn refused_settings(&self) -> Vec<RefusedSetting> {
        self.shared.refused_settings.lock().unwrap_or_else(PoisonError::into_inner).list()
    }

    /// The clock its mirror turns by.
    pub fn clock(&self) -> &SimClock {
        &self.shared.clock
    }
}
