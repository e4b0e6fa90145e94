//! The sending end of one connection.

use std::time::Duration;

use rowscan_protocol::time::SimTime;

use super::wire::{AbortReason, Control, Form, Route, STRIDE, packets_of};
use crate::frame::CanFrame;

/// Without an answer for so long after a request or the last packet, the connection is given up (T3).
const ANSWER: Duration = Duration::from_millis(1250);
/// Told to wait, it waits so long (T4).
const HOLD: Duration = Duration::from_millis(1050);
/// Between two packets to one receiver: about what a frame takes at 250 kbit/s, with its gaps.
const GAP: Duration = Duration::from_millis(1);
/// Between two packets to everyone (50 to 200 ms are allowed).
const BROADCAST_GAP: Duration = Duration::from_millis(50);
/// Packets may be asked for again so often.
const REPEATS: u8 = 3;

/// How a step of a sender ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ended {
    /// Everything has been sent, and to one receiver: acknowledged.
    Sent,
    /// It was given up.
    Failed(AbortReason),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// An answer is awaited until then.
    Waiting(SimTime),
    /// The next packet goes out then; the last of this burst is known, and what packets are numbered after.
    Sending { due: SimTime, last: u32, offset: u32 },
}

/// A message on its way out.
#[derive(Clone, Debug)]
pub(super) struct Sender {
    pub(super) route: Route,
    pub(super) form: Form,
    pub(super) pgn: u32,
    bytes: Vec<u8>,
    /// Number of the packet that comes next, from 1.
    next: u32,
    /// The highest packet sent so far.
    highest: u32,
    repeats: u8,
    state: State,
}

impl Sender {
    /// Asks for leave to send, or announces to everyone.
    pub(super) fn start(
        at: SimTime,
        route: Route,
        pgn: u32,
        bytes: Vec<u8>,
        out: &mut Vec<CanFrame>,
    ) -> Self {
        let (len, form) = (bytes.len(), Form::of(bytes.len()));
        let packets = packets_of(len);
        let (control, state) = if route.is_broadcast() {
            let sending = State::Sending { due: at + BROADCAST_GAP, last: packets, offset: 0 };
            (Control::Broadcast { len, packets }, sending)
        } else {
            (Control::Request { len, packets, at_once: u8::MAX }, State::Waiting(at + ANSWER))
        };
        out.extend(route.control(form, pgn, control));
        Self { route, form, pgn, bytes, next: 1, highest: 0, repeats: 0, state }
    }

    /// When [`Sender::poll`] has something to do.
    pub(super) fn next(&self) -> SimTime {
        match self.state {
            State::Waiting(until) => until,
            State::Sending { due, .. } => due,
        }
    }

    /// Sends what is due, or gives up.
    pub(super) fn poll(&mut self, at: SimTime, out: &mut Vec<CanFrame>) -> Option<Ended> {
        match self.state {
            State::Waiting(until) => (until <= at).then(|| self.abort(AbortReason::TIMEOUT, out)),
            State::Sending { due, last, offset } if due <= at => {
                let start = usize::try_from(self.next - 1).unwrap_or(usize::MAX).saturating_mul(STRIDE);
                let rest = self.bytes.get(start..).unwrap_or_default();
                let number = u8::try_from(self.next.saturating_sub(offset)).unwrap_or(u8::MAX);
                out.extend(self.route.data(self.form, number, rest.get(..STRIDE).unwrap_or(rest)));
                self.highest = self.highest.max(self.next);
                self.next += 1;
                let gap = if self.route.is_broadcast() { BROADCAST_GAP } else { GAP };
                self.state = State::Sending { due: due + gap, last, offset };
                if self.next <= last {
                    return None;
                }
                if self.route.is_broadcast() {
                    return Some(Ended::Sent);
                }
                self.state = State::Waiting(at + ANSWER);
                None
            }
            State::Sending { .. } => None,
        }
    }

    /// The receiver has said something.
    pub(super) fn handle(
        &mut self,
        at: SimTime,
        pgn: u32,
        control: Control,
        out: &mut Vec<CanFrame>,
    ) -> Option<Ended> {
        match control {
            Control::Abort(reason) => Some(Ended::Failed(reason)),
            Control::Clear { .. } if pgn != self.pgn => Some(self.abort(AbortReason::OTHER, out)),
            Control::Clear { packets, next } => self.cleared(at, (packets, next), out),
            Control::Done { len } => {
                let is_whole = len == self.bytes.len()
                    && pgn == self.pgn
                    && self.highest == packets_of(len)
                    && matches!(self.state, State::Waiting(_));
                Some(if is_whole { Ended::Sent } else { self.abort(AbortReason::OTHER, out) })
            }
            Control::Request { .. } | Control::Broadcast { .. } | Control::Offset { .. } => None,
        }
    }

    fn cleared(&mut self, at: SimTime, (packets, next): (u8, u32), out: &mut Vec<CanFrame>) -> Option<Ended> {
        if matches!(self.state, State::Sending { .. }) {
            return Some(self.abort(AbortReason::CLEAR_WHILE_SENDING, out));
        }
        if packets == 0 {
            self.state = State::Waiting(at + HOLD);
            return None;
        }
        let total = packets_of(self.bytes.len());
        let last = next.saturating_add(u32::from(packets) - 1);
        // Packets that were never sent cannot be skipped.
        if next == 0 || next > self.highest + 1 || last > total {
            return Some(self.abort(AbortReason::OTHER, out));
        }
        if next <= self.highest {
            self.repeats += 1;
            if self.repeats > REPEATS {
                return Some(self.abort(AbortReason::TOO_MANY_REPEATS, out));
            }
        } else {
            self.repeats = 0;
        }
        self.next = next;
        let offset = match self.form {
            Form::Plain => 0,
            Form::Extended => {
                let offset = next - 1;
                out.extend(self.route.control(self.form, self.pgn, Control::Offset { packets, offset }));
                offset
            }
        };
        self.state = State::Sending { due: at + GAP, last, offset };
        None
    }

    fn abort(&mut self, reason: AbortReason, out: &mut Vec<CanFrame>) -> Ended {
        out.extend(self.route.control(self.form, self.pgn, Control::Abort(reason)));
        Ended::Failed(reason)
    }
}
