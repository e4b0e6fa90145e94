//! Sends Compact telegrams as UDP datagrams.

use std::collections::{BTreeMap, VecDeque};
use std::net::{Ipv4Addr, SocketAddrV4};
use std::sync::Arc;

use rowscan_bus::Passage;
use rowscan_protocol::device::Stream;
use rowscan_protocol::time::SimTime;
use rowscan_recording::{DATAGRAMS, Side, StreamKind, Tap};
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
    sockets: BTreeMap<SocketAddrV4, Connected>,
    tap: Tap,
    held: VecDeque<Held>,
}

/// A socket that sends to one place.
#[derive(Debug)]
struct Connected {
    socket: UdpSocket,
    /// Somebody listened there last, as far as that can be known.
    is_heard: bool,
}

/// A datagram that a fault holds back.
#[derive(Debug)]
struct Held {
    until: SimTime,
    /// Datagrams that are to leave before it.
    behind: u32,
    stream: Stream,
    to: SocketAddrV4,
    bytes: Vec<u8>,
}

impl DatagramSource {
    pub(crate) fn new(shared: Arc<Shared>) -> Self {
        let name = shared.config.stream.clone().unwrap_or_else(|| shared.device().model().name.to_owned());
        let tap = shared.config.taps.open(&format!("{name}{DATAGRAMS}"), StreamKind::Compact);
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
            let stream = datagram.stream;
            datagram.ends_turn.into_iter().for_each(|number| shared.datagrams.end_turn(number));
            let Some((to, bytes)) = shared.device().send(datagram) else { continue };
            if !shared.datagrams.admits(to) {
                continue;
            }
            self.pass(firing.at, (stream, to), bytes).await;
        }
        self.release(firing.at).await;
    }

    /// Sends a datagram as faults let it: not at all, twice, or held back.
    pub(crate) async fn pass(&mut self, now: SimTime, (stream, to): (Stream, SocketAddrV4), bytes: Vec<u8>) {
        let troubles = self.shared.troubles.as_ref().and_then(|troubles| troubles.datagrams());
        let passage = troubles.map(|datagrams| datagrams.passage(bytes.len()));
        let Some(Passage { copies, late, behind }) = passage else {
            return self.leave(stream, to, &bytes).await;
        };
        if late.is_zero() && behind == 0 {
            for _ in 0..copies {
                self.leave(stream, to, &bytes).await;
            }
        } else if copies > 0 {
            if self.held.len() >= MAX_HELD {
                self.held.pop_front();
            }
            self.held.push_back(Held { until: now + late, behind, stream, to, bytes });
            return;
        }
        for held in &mut self.held {
            held.behind = held.behind.saturating_sub(1);
        }
    }

    /// Sends what has been held back for long enough.
    pub(crate) async fn release(&mut self, now: SimTime) {
        while let Some(place) = self.held.iter().position(|held| held.behind == 0 && held.until <= now) {
            let Some(Held { stream, to, bytes, .. }) = self.held.remove(place) else { return };
            self.leave(stream, to, &bytes).await;
        }
    }

    async fn leave(&mut self, stream: Stream, to: SocketAddrV4, bytes: &[u8]) {
        let was_heard = self.sockets.get(&to).is_some_and(|socket| socket.is_heard);
        // What is heard is told and counted before its reader can act on it, the end of the run above all; what goes where nobody has listened so far,
        // only if somebody does.
        if was_heard {
            self.tell(bytes);
        }
        let sent = self.send(to, bytes).await;
        if let Ok(true) = sent
            && !was_heard
        {
            self.tell(bytes);
        }
        let datagrams = &self.shared.datagrams;
        if was_heard && !matches!(sent, Ok(true)) {
            datagrams.take_back();
        }
        match sent {
            Ok(is_heard) => {
                if stream == Stream::Scan {
                    datagrams.note_heard(is_heard);
                }
                if !is_heard {
                    datagrams.count_unheard();
                }
            }
            Err(cause) => {
                tracing::debug!(%cause, "a datagram to {to} is lost");
                datagrams.count_failed();
            }
        }
    }

    fn tell(&self, bytes: &[u8]) {
        self.tap.record(Side::Device, bytes);
        self.shared.datagrams.count_sent();
    }

    /// False if nobody listened there, as far as the system has told by now: it does where `to` is on this machine.
    ///
    /// A socket a destination, so that the system can tell the lockstep clock who has read what.
    async fn send(&mut self, to: SocketAddrV4, bytes: &[u8]) -> std::io::Result<bool> {
        if !self.sockets.contains_key(&to) {
            if self.sockets.len() >= MAX_SOCKETS {
                self.sockets.clear();
            }
            let own = if to.ip().is_loopback() { Ipv4Addr::LOCALHOST } else { Ipv4Addr::UNSPECIFIED };
            let socket = UdpSocket::bind(SocketAddrV4::new(own, 0)).await?;
            socket.connect(to).await?;
            self.sockets.insert(to, Connected { socket, is_heard: false });
        }
        let Some(Connected { socket, is_heard }) = self.sockets.get_mut(&to) else { return Ok(true) };
        // What the one before met, if the system tells it only now.
        let _ = socket.take_error()?;
        let refused = |cause: &std::io::Error| cause.kind() == std::io::ErrorKind::ConnectionRefused;
        match socket.send(bytes).await {
            Ok(_) => {}
            Err(cause) if refused(&cause) => {
                socket.send(bytes).await?;
            }
            Err(cause) => return Err(cause),
        }
        *is_heard = match socket.take_error()? {
            Some(cause) if refused(&cause) => false,
            Some(cause) => return Err(cause),
            None => true,
        };
        Ok(*is_heard)
    }
}
