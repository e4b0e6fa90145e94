//! The receiving end of one connection.

use std::time::Duration;

use rowscan_protocol::time::SimTime;

use super::wire::{AbortReason, Control, Form, Route, packets_of};
use crate::frame::CanFrame;

/// Between two packets (T1).
const BETWEEN: Duration = Duration::from_millis(750);
/// From the leave to send to the first packet (T2).
const FIRST: Duration = Duration::from_millis(1250);
/// Packets that are asked for at once.
const AT_ONCE: u8 = 16;

/// How a step of a receiver ends.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Ended {
    /// The message is whole.
    Whole(Vec<u8>),
    /// It was given up.
    Failed(AbortReason),
}

/// A message on its way in.
#[derive(Clone, Debug)]
pub(super) struct Receiver {
    /// From the peer to us, or to everyone.
    pub(super) route: Route,
    pub(super) form: Form,
    pub(super) pgn: u32,
    len: usize,
    bytes: Vec<u8>,
    /// Packets that have come.
    count: u32,
    /// The last packet that was asked for.
    cleared: u32,
    /// The most that the sender lets us ask for at once.
    at_once: u8,
    /// What packets are numbered after; none until it is told.
    offset: Option<u32>,
    until: SimTime,
}

impl Receiver {
    /// A peer announces a message of `len` bytes, checked to be possible. `at_once` is the sender's limit.
    pub(super) fn start(
        at: SimTime,
        (route, form, pgn): (Route, Form, u32),
        (len, at_once): (usize, u8),
        out: &mut Vec<CanFrame>,
    ) -> Self {
        let mut receiver = Self {
            route,
            form,
            pgn,
            len,
            bytes: Vec::new(),
            count: 0,
            cleared: 0,
            at_once: at_once.clamp(1, AT_ONCE),
            offset: (form == Form::Plain).then_some(0),
            until: at + FIRST,
        };
        if route.is_broadcast() {
            receiver.cleared = packets_of(len);
            receiver.until = at + BETWEEN;
        } else {
            receiver.clear(at, out);
        }
        receiver
    }

    /// When [`Receiver::poll`] has something to do.
    pub(super) fn next(&self) -> SimTime {
        self.until
    }

    /// Gives up where nothing has come for too long.
    pub(super) fn poll(&mut self, at: SimTime, out: &mut Vec<CanFrame>) -> Option<Ended> {
        (self.until <= at).then(|| self.abort(AbortReason::TIMEOUT, out))
    }

    /// The sender manages its connection.
    pub(super) fn handle(
        &mut self,
        at: SimTime,
        pgn: u32,
        control: Control,
        out: &mut Vec<CanFrame>,
    ) -> Option<Ended> {
        match control {
            Control::Abort(reason) => Some(Ended::Failed(reason)),
            Control::Offset { packets, offset } => {
                let asked = self.cleared - self.count;
                let fits = pgn == self.pgn
                    && self.offset.is_none()
                    && offset == self.count
                    && (1..=asked).contains(&packets.into());
                if !fits {
                    return Some(self.abort(AbortReason::OTHER, out));
                }
                // The sender may send fewer than it was asked for.
                self.cleared = self.count + u32::from(packets);
                self.offset = Some(offset);
                self.until = at + BETWEEN;
                None
            }
            _ => None,
        }
    }

    /// A packet has come.
    pub(super) fn data(
        &mut self,
        at: SimTime,
        number: u8,
        bytes: &[u8],
        out: &mut Vec<CanFrame>,
    ) -> Option<Ended> {
        let Some(offset) = self.offset else {
            return Some(self.abort(AbortReason::UNEXPECTED_DATA, out));
        };
        let packet = offset + u32::from(number);
        if packet != self.count + 1 || bytes.len() != super::wire::STRIDE {
            let reason = if packet <= self.count { AbortReason::TWICE } else { AbortReason::BAD_SEQUENCE };
            return Some(self.abort(reason, out));
        }
        if packet > self.cleared {
            return Some(self.abort(AbortReason::UNEXPECTED_DATA, out));
        }
        self.bytes.extend(bytes);
        self.count = packet;
        self.until = at + BETWEEN;
        if self.count == packets_of(self.len) {
            let mut whole = std::mem::take(&mut self.bytes);
            whole.truncate(self.len);
            if !self.route.is_broadcast() {
                out.extend(self.back().control(self.form, self.pgn, Control::Done { len: self.len }));
            }
            return Some(Ended::Whole(whole));
        }
        if self.count == self.cleared {
            self.clear(at, out);
        }
        None
    }

    /// Asks for what comes next.
    fn clear(&mut self, at: SimTime, out: &mut Vec<CanFrame>) {
        let rest = packets_of(self.len) - self.count;
        let packets = u8::try_from(rest).unwrap_or(u8::MAX).min(self.at_once);
        self.cleared = self.count + u32::from(packets);
        self.until = at + FIRST;
        if self.form == Form::Extended {
            self.offset = None;
        }
        let next = self.count + 1;
        out.extend(self.back().control(self.form, self.pgn, Control::Clear { packets, next }));
    }

    fn back(&self) -> Route {
        Route { source: self.route.destination, destination: self.route.source }
    }

    /// What is sent to everyone is given up in silence.
    pub(super) fn abort(&mut self, reason: AbortReason, out: &mut Vec<CanFrame>) -> Ended {
        if !self.route.is_broadcast() {
            out.extend(self.back().control(self.form, self.pgn, Control::Abort(reason)));
        }
        Ended::Failed(reason)
    }
}
