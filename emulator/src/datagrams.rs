//! Compact telegrams on their way to UDP: what waits for its instant, where it may go, and what became of it.
//!
//! Anyone who reaches a scanner can tell it where to send. So a destination that a client has written is obeyed on loopback only, and elsewhere where the
//! operator allows it; else nothing is sent, and log and counts say so.

use std::collections::{BTreeMap, VecDeque};
use std::net::{IpAddr, Ipv4Addr, SocketAddrV4};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use rowscan_protocol::device::{Datagram, Device, Silent, Stream};
use rowscan_protocol::time::SimTime;
use rowscan_recording::{Side, StreamKind, Tap};
use tokio::net::UdpSocket;

use crate::firing::Firing;
use crate::shared::Shared;

/// Destinations that sockets are kept for.
const MAX_SOCKETS: usize = 8;
/// Destinations and settings that the log tells of, each once.
const MAX_TOLD: usize = 64;

/// The Compact telegrams of one scanner.
#[derive(Debug, Default)]
pub(crate) struct Datagrams {
    /// In the order of their instants.
    waiting: Mutex<VecDeque<Datagram>>,
    /// Addresses that are no loopback and may be sent to.
    allowed: Vec<IpAddr>,
    told: Mutex<Vec<(Stream, Result<SocketAddrV4, ()>)>>,
    sent: AtomicU64,
    withheld: AtomicU64,
    failed: AtomicU64,
}

/// What became of a scanner's datagrams.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DatagramCounts {
    /// Sent.
    pub sent: u64,
    /// Not sent, because nobody has allowed their destination.
    pub withheld: u64,
    /// Refused by the system.
    pub failed: u64,
    /// Where scans would go now, if that is not allowed.
    pub foreign: Option<SocketAddrV4>,
}

impl Datagrams {
    pub(crate) fn new(allowed: Vec<IpAddr>) -> Self {
        Self { allowed, ..Self::default() }
    }

    fn may_go_to(&self, address: Ipv4Addr) -> bool {
        address.is_loopback() || self.allowed.contains(&address.into())
    }

    /// Where a stream goes; none where it is off or may not go there.
    pub(crate) fn destination(&self, device: &Device, stream: Stream) -> Option<SocketAddrV4> {
        device.destination(stream).ok().filter(|to| self.may_go_to(*to.ip()))
    }

    /// Whether scans go somewhere.
    pub(crate) fn is_streaming(&self, device: &Device) -> bool {
        self.destination(device, Stream::Scan).is_some()
    }

    pub(crate) fn wait(&self, datagrams: Vec<Datagram>) {
        let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        waiting.extend(datagrams);
        waiting.make_contiguous().sort_by_key(|datagram| (datagram.at, datagram.stream));
    }

    fn next(&self) -> Option<SimTime> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner).front().map(|datagram| datagram.at)
    }

    fn take(&self, at: SimTime) -> Option<Datagram> {
        let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        waiting.front().is_some_and(|datagram| datagram.at <= at).then(|| waiting.pop_front())?
    }

    pub(crate) fn counts(&self, device: &Device) -> Option<DatagramCounts> {
        device.model().compact?;
        let scans = device.destination(Stream::Scan).ok();
        Some(DatagramCounts {
            sent: self.sent.load(Ordering::Relaxed),
            withheld: self.withheld.load(Ordering::Relaxed),
            failed: self.failed.load(Ordering::Relaxed),
            foreign: scans.filter(|to| !self.may_go_to(*to.ip())),
        })
    }

    /// Tells once what is switched on and goes nowhere.
    pub(crate) fn tell(&self, device: &Device) {
        for stream in Stream::ALL {
            let silent = match device.destination(stream) {
                Ok(to) if self.may_go_to(*to.ip()) => continue,
                Ok(to) => Ok(to),
                Err(Silent::Off) => continue,
                Err(Silent::Otherwise) => Err(()),
            };
            let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
            if told.contains(&(stream, silent)) || told.len() >= MAX_TOLD {
                continue;
            }
            told.push((stream, silent));
            let (what, [_, place]) = (stream.name(), stream.variables());
            match silent {
                Ok(to) => tracing::warn!(
                    "{what} telegrams are to go to {to}, which is not this machine: nothing is sent there; --allow-destination {} allows it",
                    to.ip()
                ),
                Err(()) => tracing::warn!(
                    "{what} telegrams are on, and nothing is sent: {place} or ScanDataFormat asks for what goes out otherwise or is not emulated"
                ),
            }
        }
    }
}

/// Sends them when their instants come.
#[derive(Debug)]
pub(crate) struct DatagramSource {
    shared: Arc<Shared>,
    sockets: BTreeMap<SocketAddrV4, UdpSocket>,
    tap: Tap,
}

impl DatagramSource {
    pub(crate) fn new(shared: Arc<Shared>) -> Self {
        let name = shared.config.stream.clone().unwrap_or_else(|| shared.device().model().name.to_owned());
        let tap = shared.config.taps.open(&format!("{name}-udp"), StreamKind::Compact);
        Self { shared, sockets: BTreeMap::new(), tap }
    }

    pub(crate) fn next(&self) -> Option<SimTime> {
        self.shared.datagrams.next()
    }

    /// Sends what is due. Nothing waits for its reader: UDP has no back-pressure.
    pub(crate) async fn fire(&mut self, firing: Firing) {
        let shared = Arc::clone(&self.shared);
        while let Some(datagram) = shared.datagrams.take(firing.at) {
            let Some((to, bytes)) = shared.device().send(datagram) else { continue };
            if !shared.datagrams.may_go_to(*to.ip()) {
                shared.datagrams.withheld.fetch_add(1, Ordering::Relaxed);
                continue;
            }
            self.tap.record(Side::Device, &bytes);
            match self.send(to, &bytes).await {
                Ok(()) => shared.datagrams.sent.fetch_add(1, Ordering::Relaxed),
                Err(cause) => {
                    tracing::debug!(%cause, "a datagram to {to} is lost");
                    shared.datagrams.failed.fetch_add(1, Ordering::Relaxed)
                }
            };
        }
    }

    /// A socket a destination, so that the system can tell the lockstep clock who has read what.
    async fn send(&mut self, to: SocketAddrV4, bytes: &[u8]) -> std::io::Result<()> {
        if !self.sockets.contains_key(&to) {
            if self.sockets.len() >= MAX_SOCKETS {
                self.sockets.clear();
            }
            let own = if to.ip().is_loopback() { Ipv4Addr::LOCALHOST } else { Ipv4Addr::UNSPECIFIED };
            let socket = UdpSocket::bind(SocketAddrV4::new(own, 0)).await?;
            socket.connect(to).await?;
            self.sockets.insert(to, socket);
        }
        let Some(socket) = self.sockets.get(&to) else { return Ok(()) };
        match socket.send(bytes).await {
            // What the one before met: nobody listened. This one goes out.
            Err(cause) if cause.kind() == std::io::ErrorKind::ConnectionRefused => {
                socket.send(bytes).await.or_else(|cause| match cause.kind() {
                    std::io::ErrorKind::ConnectionRefused => Ok(0),
                    _ => Err(cause),
                })?;
            }
            sent => {
                sent?;
            }
        }
        Ok(())
    }
}
