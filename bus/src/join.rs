//! The cable: ports joined so that each hears what the others say.

use std::sync::atomic::{AtomicU64, Ordering};

use rowscan_protocol::time::SimTime;
use tokio::sync::mpsc;
use tokio::task::JoinSet;

use super::datagrams::Datagrams;
use super::error_frame::ErrorFrame;
use super::link::candump::LogCut;
use super::link::{self, Link};
use super::port_event::{Outgoing, OutgoingFrame, PortEvent};
use super::{BusAddress, BusError, CanFrame};
use rowscan_ports::in_flight::InFlight;
use rowscan_ports::task;
use rowscan_ports::{Delivered, Delivery, Untaken};

/// Frames a port may be behind.
const QUEUE: usize = 4096;

/// Frames that may be pending where nothing is lost: fewer than any queue behind a port holds.
const MOST_PENDING: u64 = 256;

/// A frame with the simulated instant it was sent at.
pub type Stamped = (SimTime, CanFrame);

/// A bus with all its ports. Dropping it closes them.
#[derive(Debug)]
pub struct Bus {
    ports: Vec<mpsc::Sender<OutgoingFrame>>,
    /// Which of them send datagrams.
    datagram_ports: Vec<bool>,
    datagrams: Datagrams,
    open_from_the_start: bool,
    untaken: Vec<Untaken>,
    logs: Vec<LogCut>,
    in_flight: InFlight,
    dropped: AtomicU64,
    _tasks: JoinSet<()>,
}

/// What is heard, with the number of the port.
pub type Inbox = mpsc::Receiver<(usize, PortEvent)>;

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
        let (mut open_from_the_start, mut untaken) = (false, Vec::new());
        let (mut datagram_ports, mut logs) = (Vec::new(), Vec::new());
        for (number, address) in addresses.iter().enumerate() {
            let link = Link::open(address).await?;
            tell(&link);
            datagram_ports.push(matches!(link, Link::Udp(_)));
            open_from_the_start |= link.is_open_from_the_start();
            untaken.extend(link.untaken()?);
            if let Link::Candump(log) = &link {
                logs.push(log.cut());
            }
            let (outbox, queue) = mpsc::channel(QUEUE);
            ports.push(outbox);
            tasks.spawn(task(link.run(queue, link::PortListener { number, heard: heard.clone() })));
        }
        let bus = Self {
            ports,
            datagram_ports,
            datagrams: Datagrams::default(),
            open_from_the_start,
            untaken,
            logs,
            in_flight: InFlight::default(),
            dropped: AtomicU64::new(0),
            _tasks: tasks,
        };
        Ok((bus, inbox))
    }

    /// Whether each of its logs is whole; still so once the bus is gone.
    pub fn logs(&self) -> Vec<LogCut> {
        self.logs.clone()
    }

    /// Puts a frame on every port but the one it came from. Patient, it waits for ports that are behind; else those lose it.
    pub async fn send(&self, (at, frame): Stamped, from: Option<usize>, delivery: Delivery) {
        for (number, port) in self.ports.iter().enumerate() {
            if Some(number) == from {
                continue;
            }
            let is_datagram = self.datagram_ports.get(number).is_some_and(|is| *is);
            let copies = if is_datagram { self.datagrams.copies() } else { 1 };
            for _ in 0..copies {
                let outgoing =
                    OutgoingFrame { at, what: Outgoing::Frame(frame), pending: self.in_flight.enter() };
                // A port that is gone needs nothing.
                if delivery.put(port, outgoing).await == Delivered::Lost {
                    self.dropped.fetch_add(1, Ordering::Relaxed);
                }
            }
        }
        if delivery.is_patient() {
            self.in_flight.below(MOST_PENDING).await;
        }
    }

    /// Has the ports tell what their controllers would, where they can.
    pub async fn tell(&self, at: SimTime, error: ErrorFrame, delivery: Delivery) {
        for port in &self.ports {
            let pending = self.in_flight.enter();
            let outgoing = OutgoingFrame { at, what: Outgoing::Error(error), pending };
            if delivery.put(port, outgoing).await == Delivered::Lost {
                self.dropped.fetch_add(1, Ordering::Relaxed);
            }
        }
    }

    /// What becomes of what it sends as datagrams; none if no port does.
    pub fn datagrams(&self) -> Option<Datagrams> {
        self.datagram_ports.contains(&true).then(|| self.datagrams.clone())
    }

    /// What has been sent and is not written yet.
    pub fn in_flight(&self) -> &InFlight {
        &self.in_flight
    }

    /// Waits until the ports have written everything sent so far. Cancel safe.
    pub async fn written(&self) {
        self.in_flight.flushed().await;
    }

    /// Waits until whoever listens has everything sent so far. Cancel safe.
    pub async fn taken(&self) {
        self.written().await;
        for untaken in &self.untaken {
            untaken.taken().await;
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
