//! Sends Compact telegrams as UDP datagrams.

use std::collections::{BTreeMap, VecDeque};
use std::net::{Ipv4Addr, SocketAddrV4};
use std::sync::Arc;
use std::sync::atomic::Ordering;

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

/// Turns that are remembered as sent, for those of their datagrams that faults let go later.
const REMEMBERED_TURNS: usize = 16;

/// Sends them when their instants come.
#[derive(Debug)]
pub(crate) struct DatagramSource {
    shared: Arc<Shared>,
    sockets: BTreeMap<SocketAddrV4, Connected>,
    tap: Tap,
    held: VecDeque<Held>,
    /// The last turns of which a datagram was sent, the newest last.
    turns: VecDeque<u64>,
}

/// A telegram on its way.
#[derive(Debug)]
pub(crate) struct Outgoing {
    pub(crate) stream: Stream,
    pub(crate) to: SocketAddrV4,
    /// The turn that it tells of, if it is one of a scan's.
    pub(crate) turn: Option<u64>,
    pub(crate) bytes: Vec<u8>,
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
    datagram: Outgoing,
}

impl DatagramSource {
    pub(crate) fn new(shared: Arc<Shared>) -> Self {
        let name = shared.config.stream.clone().unwrap_or_else(|| shared.device().model().name.to_owned());
        let tap = shared.config.taps.open(&format!("{name}{DATAGRAMS}"), StreamKind::Compact);
        Self { shared, sockets: BTreeMap::new(), tap, held: VecDeque::new(), turns: VecDeque::new() }
    }

    pub(crate) fn next(&self) -> Option<SimTime> {
        let late = self.held.iter().filter(|held| held.behind == 0).map(|held| held.until);
        self.shared.datagrams.next().into_iter().chain(late).min()
    }

    /// Sends what is due. Nothing waits for its reader: UDP has no back-pressure.
    pub(crate) async fn fire(&mut self, firing: Firing) {
        self.send_until(firing.at, firing.at).await;
        self.release(firing.at).await;
    }

    /// Sends what is due until then, now.
    async fn send_until(&mut self, until: SimTime, now: SimTime) {
        let shared = Arc::clone(&self.shared);
        while let Some(datagram) = shared.datagrams.take(until) {
            let (stream, turn) = (datagram.stream, datagram.turn());
            datagram.ends_turn.into_iter().for_each(|number| shared.datagrams.end_turn(number));
            let Some((to, bytes)) = shared.device().send(datagram) else { continue };
            if !shared.datagrams.admits(to) {
                continue;
            }
            self.pass(now, Outgoing { stream, to, turn, bytes }).await;
        }
    }

    /// Sends the rest of the turns that are under way.
    pub(crate) async fn finish(&mut self, now: SimTime) {
        self.send_until(SimTime(u64::MAX), now).await;
        // What waits for others to overtake it waits for none any more.
        for held in self.held.iter_mut().filter(|held| held.behind > 0) {
            (held.behind, held.until) = (0, now);
        }
        self.release(now).await;
    }

    /// Sends a datagram as faults let it: not at all, twice, or held back.
    pub(crate) async fn pass(&mut self, now: SimTime, datagram: Outgoing) {
        let troubles = self.shared.troubles.as_ref().and_then(|troubles| troubles.datagrams());
        let passage = troubles.map(|datagrams| datagrams.passage(datagram.bytes.len()));
        let Some(Passage { copies, late, behind }) = passage else {
            return self.leave(&datagram, false).await;
        };
        if late.is_zero() && behind == 0 {
            for _ in 0..copies {
                self.leave(&datagram, false).await;
            }
        } else if copies > 0 {
            if self.held.len() >= MAX_HELD {
                self.held.pop_front();
            }
            self.held.push_back(Held { until: now + late, behind, datagram });
            return;
        }
        for held in &mut self.held {
            held.behind = held.behind.saturating_sub(1);
        }
    }

    /// Sends what has been held back for long enough.
    pub(crate) async fn release(&mut self, now: SimTime) {
        while let Some(place) = self.held.iter().position(|held| held.behind == 0 && held.until <= now) {
            let Some(Held { datagram, .. }) = self.held.remove(place) else { return };
            self.leave(&datagram, true).await;
        }
    }

    async fn leave(&mut self, datagram: &Outgoing, was_held: bool) {
        let Outgoing { stream, to, turn, ref bytes } = *datagram;
        let turn = turn.filter(|turn| self.is_new(*turn, was_held));
        let was_heard = self.sockets.get(&to).is_some_and(|socket| socket.is_heard);
        // What is heard is told and counted before its reader can act on it, the end of the run above all; what goes where nobody has listened so far,
        // only if somebody does.
        if was_heard {
            self.tell(bytes, turn);
        }
        let sent = self.send(to, bytes).await;
        match (was_heard, matches!(sent, Ok(true))) {
            (false, true) => self.tell(bytes, turn),
            (true, false) => self.take_back(turn),
            _ => {}
        }
        let datagrams = &self.shared.datagrams;
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

    /// True of a turn of which nothing was sent. Turns begin anew with smaller numbers, but not in what was held back.
    fn is_new(&self, turn: u64, was_held: bool) -> bool {
        if was_held { !self.turns.contains(&turn) } else { self.turns.back() != Some(&turn) }
    }

    /// A datagram is sent; of a turn as well, if it is the first one of it.
    fn tell(&mut self, bytes: &[u8], new_turn: Option<u64>) {
        self.tap.record(Side::Device, bytes);
        self.shared.datagrams.count_sent();
        if let Some(turn) = new_turn {
            self.shared.counts.sent.fetch_add(1, Ordering::Relaxed);
            if self.turns.len() >= REMEMBERED_TURNS {
                self.turns.pop_front();
            }
            self.turns.push_back(turn);
        }
    }

    /// What was told as sent was not.
    fn take_back(&mut self, new_turn: Option<u64>) {
        self.shared.datagrams.take_back();
        if new_turn.is_some() {
            self.shared.counts.sent.fetch_sub(1, Ordering::Relaxed);
            self.turns.pop_back();
        }
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
