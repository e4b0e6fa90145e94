//! The transport protocol (SAE J1939-21, ISO 11783-3) and its extended form, both ends: messages longer than a frame.
//!
//! A lost, doubled or foreign packet ends a connection; it never makes another message of it. Receivers ask for no packet twice, senders repeat what they
//! are asked for. Time-outs are those of AgIsoStack++ (`can_transport_protocol.hpp`): T1 750 ms, T2 and T3 1250 ms, T4 1050 ms.
//!
//! Calling order: [`Transport::handle`] for every frame, [`Transport::poll`] at [`Transport::next`], [`Transport::send`] whenever there is something to say.
//! A message without transport protocol, of up to eight bytes, is no business of this.

mod receiver;
mod sender;
#[cfg(test)]
mod tests;
mod wire;

use rowscan_protocol::time::SimTime;

use crate::frame::{CanFrame, EVERYONE, J1939Id};
use receiver::Receiver;
use sender::Sender;
pub use wire::{AbortReason, Form, LONGEST_PLAIN};
use wire::{Control, Route, Wire, packets_of};

/// The shortest message that needs it.
const SHORTEST: usize = 9;
/// Messages on their way in at once.
const MOST_IN: usize = 8;
/// Messages on their way out at once.
const MOST_OUT: usize = 8;

/// What came of a connection.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Carried {
    /// A message came.
    Received {
        /// Its parameter group.
        pgn: u32,
        /// Address of who sent it.
        source: u8,
        /// To everyone, not to us alone.
        is_broadcast: bool,
        /// What it holds.
        bytes: Vec<u8>,
    },
    /// A message went; to one receiver: it was acknowledged.
    Sent {
        /// Its parameter group.
        pgn: u32,
        /// Address of the receiver.
        destination: u8,
    },
    /// A connection was given up.
    Failed {
        /// The parameter group that it carried.
        pgn: u32,
        /// Address of the other side.
        peer: u8,
        /// It was ours to send.
        is_ours: bool,
        /// Why.
        reason: AbortReason,
    },
}

/// Why a message cannot be sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SendError {
    /// It fits a frame, or is longer than any protocol carries to this receiver.
    #[error("expected a message of 9 to {most} bytes, found {found}")]
    Length {
        /// The most.
        most: usize,
        /// Its length.
        found: usize,
    },
    /// One is on its way to this receiver already, or too many are on their way.
    #[error("another message is on its way; send this one when it has arrived")]
    Busy,
}

/// All connections of one address.
#[derive(Clone, Debug)]
pub struct Transport {
    /// The longest message that is taken.
    longest: usize,
    out: Vec<Sender>,
    into: Vec<Receiver>,
}

impl Transport {
    /// None yet; messages to us of up to `longest` bytes are taken, longer ones refused.
    pub fn new(longest: usize) -> Self {
        Self { longest, out: Vec::new(), into: Vec::new() }
    }

    /// Begins to send a message of the group `pgn` from the address `source`.
    ///
    /// # Errors
    /// A length that no protocol carries, or another message that is still on its way there.
    pub fn send(
        &mut self,
        at: SimTime,
        (source, destination): (u8, u8),
        pgn: u32,
        bytes: Vec<u8>,
        out: &mut Vec<CanFrame>,
    ) -> Result<(), SendError> {
        let most = if destination == EVERYONE { LONGEST_PLAIN } else { 0xFF_FFFF * 7 };
        if !(SHORTEST..=most).contains(&bytes.len()) {
            return Err(SendError::Length { most, found: bytes.len() });
        }
        let form = Form::of(bytes.len());
        let is_taken =
            self.out.iter().any(|sender| sender.route.destination == destination && sender.form == form);
        if is_taken || self.out.len() >= MOST_OUT {
            return Err(SendError::Busy);
        }
        self.out.push(Sender::start(at, Route { source, destination }, pgn, bytes, out));
        Ok(())
    }

    /// Gives up all connections in silence: the address is gone.
    pub fn forget(&mut self) {
        self.out.clear();
        self.into.clear();
    }

    /// A frame was received by the address `ours`; what came of it.
    pub fn handle(
        &mut self,
        at: SimTime,
        ours: u8,
        frame: &CanFrame,
        out: &mut Vec<CanFrame>,
    ) -> Option<Carried> {
        let id = J1939Id::of(frame.id).filter(|_| !frame.remote)?;
        let is_for_us = id.destination == ours || id.destination == EVERYONE;
        if !is_for_us || id.source == ours {
            return None;
        }
        let route = Route { source: id.source, destination: id.destination };
        match Wire::read(id, frame.data())? {
            Wire::Data(form, number, bytes) => {
                let place = self.into.iter().position(|open| open.route == route && open.form == form)?;
                let ended = self.into.get_mut(place)?.data(at, number, bytes, out)?;
                Some(Self::received(self.into.remove(place), ended))
            }
            Wire::Control(form, pgn, control) => match control {
                Control::Request { len, packets, at_once } if !route.is_broadcast() => {
                    self.requested(at, (route, form, pgn), (len, packets, at_once), out)
                }
                Control::Broadcast { len, packets } if route.is_broadcast() => {
                    self.announced(at, (route, form, pgn), (len, packets), out)
                }
                Control::Clear { .. } | Control::Done { .. } => {
                    let place = self.sending(id.source, form)?;
                    let ended = self.out.get_mut(place)?.handle(at, pgn, control, out)?;
                    Some(Self::sent(self.out.remove(place), ended))
                }
                Control::Offset { .. } | Control::Abort(_) => {
                    self.managed(at, (route, form, pgn), control, out)
                }
                Control::Request { .. } | Control::Broadcast { .. } => None,
            },
        }
    }

    /// When [`Transport::poll`] has something to do.
    pub fn next(&self) -> Option<SimTime> {
        let (out, into) = (self.out.iter().map(Sender::next), self.into.iter().map(Receiver::next));
        out.chain(into).min()
    }

    /// Sends what is due, gives up what has waited too long; what came of it.
    pub fn poll(&mut self, at: SimTime, out: &mut Vec<CanFrame>) -> Vec<Carried> {
        let mut carried = Vec::new();
        let mut senders = Vec::new();
        for mut sender in std::mem::take(&mut self.out) {
            match sender.poll(at, out) {
                Some(ended) => carried.push(Self::sent(sender, ended)),
                None => senders.push(sender),
            }
        }
        let mut receivers = Vec::new();
        for mut receiver in std::mem::take(&mut self.into) {
            match receiver.poll(at, out) {
                Some(ended) => carried.push(Self::received(receiver, ended)),
                None => receivers.push(receiver),
            }
        }
        (self.out, self.into) = (senders, receivers);
        carried
    }

    fn sending(&self, destination: u8, form: Form) -> Option<usize> {
        self.out.iter().position(|open| open.route.destination == destination && open.form == form)
    }

    fn requested(
        &mut self,
        at: SimTime,
        (route, form, pgn): (Route, Form, u32),
        (len, packets, at_once): (usize, u32, u8),
        out: &mut Vec<CanFrame>,
    ) -> Option<Carried> {
        let back = Route { source: route.destination, destination: route.source };
        let mut refuse = |reason| {
            out.extend(back.control(form, pgn, Control::Abort(reason)));
        };
        let open = self.into.iter().position(|open| open.route == route && open.form == form);
        // The same again replaces what is left of it; another group has to wait.
        let mut failed = None;
        if let Some(place) = open {
            if self.into.get(place).is_some_and(|open| open.pgn != pgn) {
                refuse(AbortReason::BUSY);
                return None;
            }
            let lost = self.into.remove(place);
            failed = Some(Self::received(lost, receiver::Ended::Failed(AbortReason::OTHER)));
        }
        let is_possible = Form::of(len) == form && len >= SHORTEST && packets == packets_of(len);
        if !is_possible || at_once == 0 {
            refuse(AbortReason::OTHER);
        } else if len > self.longest || self.into.len() >= MOST_IN {
            refuse(AbortReason::NO_ROOM);
        } else {
            self.into.push(Receiver::start(at, (route, form, pgn), (len, at_once), out));
        }
        failed
    }

    fn announced(
        &mut self,
        at: SimTime,
        (route, form, pgn): (Route, Form, u32),
        (len, packets): (usize, u32),
        out: &mut Vec<CanFrame>,
    ) -> Option<Carried> {
        let open = self.into.iter().position(|open| open.route == route);
        let lost = open.map(|place| self.into.remove(place));
        let is_possible = (SHORTEST..=LONGEST_PLAIN).contains(&len) && packets == packets_of(len);
        if is_possible && len <= self.longest && self.into.len() < MOST_IN {
            self.into.push(Receiver::start(at, (route, form, pgn), (len, u8::MAX), out));
        }
        lost.map(|lost| Self::received(lost, receiver::Ended::Failed(AbortReason::OTHER)))
    }

    /// An offset is the sender's; an abort may be either side's.
    fn managed(
        &mut self,
        at: SimTime,
        (route, form, pgn): (Route, Form, u32),
        control: Control,
        out: &mut Vec<CanFrame>,
    ) -> Option<Carried> {
        let open = |open: &Receiver| {
            open.route == route
                && open.form == form
                && (open.pgn == pgn || matches!(control, Control::Offset { .. }))
        };
        if let Some(place) = self.into.iter().position(open) {
            let ended = self.into.get_mut(place)?.handle(at, pgn, control, out)?;
            return Some(Self::received(self.into.remove(place), ended));
        }
        let place = self.sending(route.source, form)?;
        if self.out.get(place).is_some_and(|open| open.pgn != pgn) {
            return None;
        }
        let ended = self.out.get_mut(place)?.handle(at, pgn, control, out)?;
        Some(Self::sent(self.out.remove(place), ended))
    }

    fn sent(sender: Sender, ended: sender::Ended) -> Carried {
        let (pgn, destination) = (sender.pgn, sender.route.destination);
        match ended {
            sender::Ended::Sent => Carried::Sent { pgn, destination },
            sender::Ended::Failed(reason) => {
                Carried::Failed { pgn, peer: destination, is_ours: true, reason }
            }
        }
    }

    fn received(receiver: Receiver, ended: receiver::Ended) -> Carried {
        let (pgn, source) = (receiver.pgn, receiver.route.source);
        match ended {
            receiver::Ended::Whole(bytes) => {
                let is_broadcast = receiver.route.is_broadcast();
                Carried::Received { pgn, source, is_broadcast, bytes }
            }
            receiver::Ended::Failed(reason) => Carried::Failed { pgn, peer: source, is_ours: false, reason },
        }
    }
}
