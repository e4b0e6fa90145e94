//! The cable: ports joined so that each hears what the others say.

use std::sync::atomic::{AtomicU64, Ordering};

use rowscan_protocol::time::SimTime;
use tokio::sync::mpsc;
use tokio::task::JoinSet;

use super::datagrams::Datagrams;
use super::error_frame::ErrorFrame;
use super::link::candump::LogCut;
use super::link::{self, Link};
use super::port_event::{Origin, Outgoing, OutgoingFrame, PortEvent};
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
    /// Which of them send datagrams, and which serve clients that are to hear one another.
    datagram_ports: Vec<bool>,
    shared_ports: Vec<bool>,
    datagrams: Datagrams,
    open_from_the_start: bool,
    untaken: Vec<Untaken>,
    logs: Vec<LogCut>,
    in_flight: InFlight,
    dropped: AtomicU64,
    _tasks: JoinSet<()>,
}

/// What is heard, with who said it.
pub type Inbox = mpsc::Receiver<(Origin, PortEvent)>;

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
        let (mut datagram_ports, mut shared_ports, mut logs) = (Vec::new(), Vec::new(), Vec::new());
        for (number, address) in addresses.iter().enumerate() {
            let link = Link::open(address).await?;
            tell(&link);
            datagram_ports.push(matches!(link, Link::Udp(_)));
            shared_ports.push(matches!(link, Link::Socketcand(_)));
            open_from_the_start |= link.is_open_from_the_start();
            untaken.extend(link.untaken()?);
            if let Link::Candump(log) = &link {
                logs.push(log.cut());
            }
            let (outbox, queue) = mpsc::channel(QUEUE);
            ports.push(outbox);
            tasks.spawn(task(link.run(queue, link::PortListener::new(number, heard.clone()))));
        }
        let bus = Self {
            ports,
            datagram_ports,
            shared_ports,
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

    /// Puts a frame on the bus: everybody hears it but who said it. Patient, it waits for ports that are behind; else those lose it.
    pub async fn send(&self, (at, frame): Stamped, from: Option<Origin>, delivery: Delivery) {
        for (number, port) in self.ports.iter().enumerate() {
            let said_by = from.filter(|from| from.port == number).map(|from| from.client);
            let has_others = self.shared_ports.get(number).is_some_and(|is| *is);
            if said_by.is_some() && !has_others {
                continue;
            }
            let is_datagram = self.datagram_ports.get(number).is_some_and(|is| *is);
            let copies = if is_datagram { self.datagrams.copies() } else { 1 };
            for _ in 0..copies {
                let (what, pending) = (Outgoing::Frame(frame), self.in_flight.enter());
                let outgoing = OutgoingFrame { at, what, said_by, pending };
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
            let outgoing = OutgoingFrame { at, what: Outgoing::Error(error), said_by: None, pending };
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CanId;
    use tokio::io::{AsyncReadExt, AsyncWriteExt};
    use tokio::net::TcpStream;

    /// Reads until the text holds this.
    async fn heard(client: &mut TcpStream, text: &mut String, wanted: &str) {
        let mut bytes = [0; 256];
        while !text.contains(wanted) {
            let count = client.read(&mut bytes).await.unwrap();
            assert!(count > 0, "the server is gone; {text}");
            text.push_str(std::str::from_utf8(&bytes[..count]).unwrap());
        }
    }

    #[tokio::test]
    async fn everybody_hears_a_frame_but_who_said_it() {
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("bus.log");
        let ports = [BusAddress::Socketcand("127.0.0.1:0".to_owned()), BusAddress::Candump(log.clone())];
        let mut address = String::new();
        let mut tell = |link: &Link| {
            if link.kind() == "socketcand" {
                address = link.found().to_string();
            }
        };
        let (bus, mut inbox) = Bus::open(&ports, &mut tell).await.unwrap();
        let mut clients = Vec::new();
        for _ in 0..2 {
            let (mut client, mut text) = (TcpStream::connect(&address).await.unwrap(), String::new());
            client.write_all(b"< open can0 >< rawmode >").await.unwrap();
            heard(&mut client, &mut text, "< ok >< ok >").await;
            assert!(matches!(inbox.recv().await, Some((_, PortEvent::Opened))));
            clients.push((client, text));
        }
        let [(first, told_first), (second, told_second)] = clients.as_mut_slice() else { panic!("two") };
        first.write_all(b"< send 123 1 AA >").await.unwrap();
        let Some((origin, PortEvent::Frame(frame))) = inbox.recv().await else { panic!("a frame") };
        bus.send((SimTime::ZERO, frame), Some(origin), Delivery::Patient).await;
        heard(second, told_second, "< frame 123 0.000000 AA >").await;
        // What a node of this program says, both hear.
        let ours = CanFrame::new(CanId::Standard(0x321), &[0xBB]).unwrap();
        bus.send((SimTime::ZERO, ours), None, Delivery::Patient).await;
        for (client, told) in [(first, &mut *told_first), (second, &mut *told_second)] {
            heard(client, told, "< frame 321 0.000000 BB >").await;
        }
        assert!(!told_first.contains("frame 123"), "its own frame came back: {told_first}");
        bus.written().await;
        assert_eq!(std::fs::read_to_string(log).unwrap().lines().count(), 2);
    }

    /// Time stands: whatever waits for it is never heard.
    #[tokio::test(start_paused = true)]
    async fn what_comes_with_the_opening_is_heard_at_once() {
        let mut address = String::new();
        let mut tell = |link: &Link| address = link.found().to_string();
        let ports = [BusAddress::Socketcand("127.0.0.1:0".to_owned())];
        let (_bus, mut inbox) = Bus::open(&ports, &mut tell).await.unwrap();
        let mut client = std::net::TcpStream::connect(&address).unwrap();
        std::io::Write::write_all(&mut client, b"< open can0 >< rawmode >< send 123 1 AA >").unwrap();
        let began = tokio::time::Instant::now();
        let mut heard = Vec::new();
        // Who never rests does not let a stopped clock jump.
        while heard.len() < 2 && tokio::time::Instant::now() == began {
            heard.extend(inbox.try_recv().map(|(_, event)| event));
            tokio::task::yield_now().await;
        }
        assert!(matches!(heard.as_slice(), [PortEvent::Opened, PortEvent::Frame(_)]), "{heard:?}");
        assert_eq!(tokio::time::Instant::now(), began);
    }
}
