//! Sends Compact telegrams as UDP datagrams.

use std::collections::{BTreeMap, VecDeque};
use std::net::{Ipv4Addr, SocketAddrV4};
use std::sync::Arc;

use rowscan_bus::Passage;
use rowscan_protocol::time::SimTime;
use rowscan_recording::{Side, StreamKind, Tap};
use tokio::net::UdpSocket;

use crate::firing::Firing;
use crate::shared::Shared;

/// Destinations that sockets are kept for.
const MAX_SOCKETS: usize = 8;

/// Datagrams that faults hold back at most; the oldest are lost.
const MAX_HELD: usize = 1024;

/// Sends them when their instants come.
#[derive(Debug)]
pub(crate) struct DatagramSource {
    shared: Arc<Shared>,
    sockets: BTreeMap<SocketAddrV4, UdpSocket>,
    tap: Tap,
    held: VecDeque<Held>,
}

/// A datagram that a fault holds back.
#[derive(Debug)]
struct Held {
    until: SimTime,
    /// Datagrams that are to leave before it.
    behind: u32,
    to: SocketAddrV4,
    bytes: Vec<u8>,
}

impl DatagramSource {
    pub(crate) fn new(shared: Arc<Shared>) -> Self {
        let name = shared.config.stream.clone().unwrap_or_else(|| shared.device().model().name.to_owned());
        let tap = shared.config.taps.open(&format!("{name}-udp"), StreamKind::Compact);
        Self { shared, sockets: BTreeMap::new(), tap, held: VecDeque::new() }
    }

    pub(crate) fn next(&self) -> Option<SimTime> {
        let late = self.held.iter().filter(|held| held.behind == 0).map(|held| held.until);
        self.shared.datagrams.next().into_iter().chain(late).min()
    }

    /// Sends what is due. Nothing waits for its reader: UDP has no back-pressure.
    pub(crate) async fn fire(&mut self, firing: Firing) {
        let shared = Arc::clone(&self.shared);
        while let Some(datagram) = shared.datagrams.take(firing.at) {
            let Some((to, bytes)) = shared.device().send(datagram) else { continue };
            if !shared.datagrams.may_go_to(*to.ip()) {
                shared.datagrams.count_withheld();
                continue;
            }
            self.pass(firing.at, to, bytes).await;
        }
        self.release(firing.at).await;
    }

    /// Sends a datagram as faults let it: not at all, twice, or held back.
    async fn pass(&mut self, now: SimTime, to: SocketAddrV4, bytes: Vec<u8>) {
        let troubles = self.shared.troubles.as_ref().and_then(|troubles| troubles.datagrams());
        let passage = troubles.map(|datagrams| datagrams.passage(bytes.len()));
        let Some(Passage { copies, late, behind }) = passage else { return self.leave(to, &bytes).await };
        if late.is_zero() && behind == 0 {
            for _ in 0..copies {
                self.leave(to, &bytes).await;
            }
        } else if copies > 0 {
            if self.held.len() >= MAX_HELD {
                self.held.pop_front();
            }
            self.held.push_back(Held { until: now + late, behind, to, bytes });
            return;
        }
        for held in &mut self.held {
            held.behind = held.behind.saturating_sub(1);
        }
    }

    /// Sends what has been held back for long enough.
    async fn release(&mut self, now: SimTime) {
        while let Some(place) = self.held.iter().position(|held| held.behind == 0 && held.until <= now) {
            let Some(Held { to, bytes, .. }) = self.held.remove(place) else { return };
            self.leave(to, &bytes).await;
        }
    }

    async fn leave(&mut self, to: SocketAddrV4, bytes: &[u8]) {
        self.tap.record(Side::Device, bytes);
        match self.send(to, bytes).await {
            Ok(()) => self.shared.datagrams.count_sent(),
            Err(cause) => {
                tracing::debug!(%cause, "a datagram to {to} is lost");
                self.shared.datagrams.count_failed();
            }
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
