//! The cable: ports joined so that each hears what the others say.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use rowscan_protocol::time::SimTime;
use tokio::sync::{Notify, mpsc};
use tokio::task::JoinSet;

use super::link::{self, Link};
use super::{BusAddress, BusError, BusLoss, CanFrame};

/// Frames a port may be behind.
const QUEUE: usize = 4096;

/// A frame with the simulated instant it was sent at.
pub type Stamped = (SimTime, CanFrame);

/// What a port tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Heard {
    /// Someone is there who was not: an adapter was opened, a client connected, the interface came up.
    Opened,
    /// A frame was received.
    Frame(CanFrame),
    /// The port is off its bus until it is [`Heard::Opened`] again.
    Lost(BusLoss),
}

/// How many frames the ports have written, for who waits until his are out.
#[derive(Debug, Default)]
pub(super) struct Written {
    frames: AtomicU64,
    more: Notify,
}

impl Written {
    pub(super) fn add(&self, frames: u64) {
        self.frames.fetch_add(frames, Ordering::Release);
        self.more.notify_waiters();
    }
}

/// The sending end of one port.
#[derive(Debug)]
pub struct BusPort {
    outbox: mpsc::Sender<Stamped>,
}

/// A bus with all its ports. Dropping it closes them.
#[derive(Debug)]
pub struct Bus {
    ports: Vec<BusPort>,
    open_from_the_start: bool,
    sent: AtomicU64,
    written: Arc<Written>,
    dropped: AtomicU64,
    _tasks: JoinSet<()>,
}

/// What is heard, with the number of the port.
pub type Inbox = mpsc::Receiver<(usize, Heard)>;

impl Bus {
    /// Opens every port; `tell` hears of each where it is.
    ///
    /// # Errors
    /// The first port that cannot be opened, with the remedy.
    pub async fn open(
        addresses: &[BusAddress],
        tell: &mut dyn FnMut(&Link),
    ) -> Result<(Self, Inbox), BusError> {
        let (heard, inbox) = mpsc::channel(QUEUE);
        let (mut ports, mut tasks) = (Vec::new(), JoinSet::new());
        let mut open_from_the_start = false;
        let written = Arc::new(Written::default());
        for (number, address) in addresses.iter().enumerate() {
            let link = Link::open(address).await?;
            tell(&link);
            open_from_the_start |= link.is_open_from_the_start();
            let (outbox, queue) = mpsc::channel(QUEUE);
            ports.push(BusPort { outbox });
            tasks.spawn(
                link.run(queue, link::Ear { number, heard: heard.clone(), written: Arc::clone(&written) }),
            );
        }
        let bus = Self {
            ports,
            open_from_the_start,
            sent: AtomicU64::new(0),
            written,
            dropped: AtomicU64::new(0),
            _tasks: tasks,
        };
        Ok((bus, inbox))
    }

    /// Puts a frame on every port but the one it came from. Patient, it waits for ports that are behind; else those lose it.
    pub async fn send(&self, frame: Stamped, from: Option<usize>, patient: bool) {
        for (number, port) in self.ports.iter().enumerate() {
            if Some(number) == from {
                continue;
            }
            if patient {
                // A port that is gone needs nothing.
                let taken = port.outbox.send(frame).await.is_ok();
                self.sent.fetch_add(taken.into(), Ordering::Relaxed);
            } else {
                match port.outbox.try_send(frame) {
                    Ok(()) => self.sent.fetch_add(1, Ordering::Relaxed),
                    Err(mpsc::error::TrySendError::Full(_)) => self.dropped.fetch_add(1, Ordering::Relaxed),
                    Err(mpsc::error::TrySendError::Closed(_)) => 0,
                };
            }
        }
    }

    /// Waits until the ports have written everything sent so far.
    pub async fn written(&self) {
        let sent = self.sent.load(Ordering::Relaxed);
        loop {
            let more = self.written.more.notified();
            if self.written.frames.load(Ordering::Acquire) >= sent {
                return;
            }
            more.await;
        }
    }

    /// Whether a port is open without anyone opening it.
    pub fn is_open_from_the_start(&self) -> bool {
        self.open_from_the_start
    }

    /// Frames that a port was too slow to take.
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }
}
