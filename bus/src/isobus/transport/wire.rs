//! The frames of the transport protocols: connection management and data.

use crate::frame::{CanFrame, EVERYONE, J1939Id};

/// The longest message of the plain protocol, bytes.
pub const LONGEST_PLAIN: usize = 1785;
/// Bytes of a message in one data frame.
pub(super) const STRIDE: usize = 7;
/// Transport frames have the lowest priority (AgIsoStack++, `can_transport_protocol.cpp`).
const PRIORITY: u8 = 7;

/// Which of the two protocols a connection uses; they are independent of each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Form {
    /// 9 to 1785 bytes.
    Plain,
    /// More; only to one receiver.
    Extended,
}

impl Form {
    /// The form that carries so many bytes.
    pub(super) fn of(len: usize) -> Self {
        if len > LONGEST_PLAIN { Self::Extended } else { Self::Plain }
    }

    fn management(self) -> u32 {
        match self {
            Self::Plain => 0xEC00,
            Self::Extended => 0xC800,
        }
    }

    fn data(self) -> u32 {
        match self {
            Self::Plain => 0xEB00,
            Self::Extended => 0xC700,
        }
    }
}

/// Why a connection was given up: the byte on the wire (AgIsoStack++, `can_transport_protocol.hpp` and `can_extended_transport_protocol.hpp`,
/// `ConnectionAbortReason`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AbortReason(pub u8);

impl AbortReason {
    /// There is a connection to this peer already.
    pub const BUSY: Self = Self(1);
    /// There is no room for it.
    pub const NO_ROOM: Self = Self(2);
    /// The peer was silent for too long.
    pub const TIMEOUT: Self = Self(3);
    /// More was asked for while data was still on its way.
    pub const CLEAR_WHILE_SENDING: Self = Self(4);
    /// The same data was asked for too often.
    pub const TOO_MANY_REPEATS: Self = Self(5);
    /// Data came that was not asked for.
    pub const UNEXPECTED_DATA: Self = Self(6);
    /// A packet is missing.
    pub const BAD_SEQUENCE: Self = Self(7);
    /// A packet came twice.
    pub const TWICE: Self = Self(8);
    /// The numbers of a control frame do not fit the message.
    pub const OTHER: Self = Self(250);
}

impl std::fmt::Display for AbortReason {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let words = match *self {
            Self::BUSY => "there is a connection already",
            Self::NO_ROOM => "no room for the message",
            Self::TIMEOUT => "the other side was silent for too long",
            Self::CLEAR_WHILE_SENDING => "more data was asked for while data was being sent",
            Self::TOO_MANY_REPEATS => "the same data was asked for too often",
            Self::UNEXPECTED_DATA => "data came that was not asked for",
            Self::BAD_SEQUENCE => "a packet is missing",
            Self::TWICE => "a packet came twice",
            _ => "another reason",
        };
        write!(out, "{words} (reason {})", self.0)
    }
}

/// What a frame of connection management says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Control {
    /// Request to send: bytes, packets (plain only), the most packets that may be asked for at once.
    Request { len: usize, packets: u32, at_once: u8 },
    /// The same to everyone: there is no answer.
    Broadcast { len: usize, packets: u32 },
    /// Clear to send so many packets, from this one on, counted from 1. None: wait.
    Clear { packets: u8, next: u32 },
    /// Extended: the packets that follow are numbered after this one.
    Offset { packets: u8, offset: u32 },
    /// Everything has come.
    Done { len: usize },
    /// Either side gives up.
    Abort(AbortReason),
}

/// A frame of a transport protocol.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wire<'a> {
    /// Management of the connection that carries this parameter group.
    Control(Form, u32, Control),
    /// A packet: its number, and seven bytes.
    Data(Form, u8, &'a [u8]),
}

/// Packets that so many bytes take.
pub(super) fn packets_of(len: usize) -> u32 {
    u32::try_from(len.div_ceil(STRIDE)).unwrap_or(u32::MAX)
}

impl<'a> Wire<'a> {
    /// Reads a frame; `None` if it is of no transport protocol, or too short for one.
    pub(super) fn read(id: J1939Id, data: &'a [u8]) -> Option<Self> {
        let form = [Form::Plain, Form::Extended]
            .into_iter()
            .find(|form| id.pgn == form.management() || id.pgn == form.data())?;
        if id.pgn == form.data() {
            let (number, bytes) = data.split_first()?;
            return Some(Self::Data(form, *number, bytes));
        }
        let &[code, b1, b2, b3, b4, p0, p1, p2] = data else { return None };
        let pgn = u32::from_le_bytes([p0, p1, p2, 0]);
        let (short, wide) = (u16::from_le_bytes([b1, b2]), u32::from_le_bytes([b1, b2, b3, b4]));
        let from_second = u32::from_le_bytes([b2, b3, b4, 0]);
        let control = match (form, code) {
            (Form::Plain, 16) => Control::Request { len: short.into(), packets: b3.into(), at_once: b4 },
            (Form::Plain, 17) => Control::Clear { packets: b1, next: b2.into() },
            (Form::Plain, 19) => Control::Done { len: short.into() },
            (Form::Plain, 32) => Control::Broadcast { len: short.into(), packets: b3.into() },
            (Form::Extended, 20) => {
                let len = usize::try_from(wide).unwrap_or(usize::MAX);
                Control::Request { len, packets: packets_of(len), at_once: u8::MAX }
            }
            (Form::Extended, 21) => Control::Clear { packets: b1, next: from_second },
            (Form::Extended, 22) => Control::Offset { packets: b1, offset: from_second },
            (Form::Extended, 23) => Control::Done { len: usize::try_from(wide).unwrap_or(usize::MAX) },
            (_, 255) => Control::Abort(AbortReason(b1)),
            _ => return None,
        };
        Some(Self::Control(form, pgn, control))
    }
}

/// From whom to whom a frame goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Route {
    pub(super) source: u8,
    pub(super) destination: u8,
}

impl Route {
    fn frame(self, pgn: u32, data: &[u8]) -> Option<CanFrame> {
        let Self { source, destination } = self;
        CanFrame::new(J1939Id { priority: PRIORITY, pgn, source, destination }.id(), data)
    }

    /// A frame of connection management.
    pub(super) fn control(self, form: Form, pgn: u32, control: Control) -> Option<CanFrame> {
        let [p0, p1, p2, _] = pgn.to_le_bytes();
        let short = |len: usize| u16::try_from(len).unwrap_or(u16::MAX).to_le_bytes();
        let wide = |len: usize| u32::try_from(len).unwrap_or(u32::MAX).to_le_bytes();
        let from_second = |number: u32| {
            let [low, middle, high, _] = number.to_le_bytes();
            [low, middle, high]
        };
        let count = |packets: u32| u8::try_from(packets).unwrap_or(u8::MAX);
        let (code, [b1, b2, b3, b4]) = match (form, control) {
            (Form::Plain, Control::Request { len, packets, at_once }) => {
                let [low, high] = short(len);
                (16, [low, high, count(packets), at_once])
            }
            (_, Control::Broadcast { len, packets }) => {
                let [low, high] = short(len);
                (32, [low, high, count(packets), 0xFF])
            }
            (Form::Plain, Control::Clear { packets, next }) => (17, [packets, count(next), 0xFF, 0xFF]),
            (Form::Plain, Control::Done { len }) => {
                let [low, high] = short(len);
                (19, [low, high, count(packets_of(len)), 0xFF])
            }
            (Form::Extended, Control::Request { len, .. }) => (20, wide(len)),
            (Form::Extended, Control::Clear { packets, next }) => {
                let [low, middle, high] = from_second(next);
                (21, [packets, low, middle, high])
            }
            (_, Control::Offset { packets, offset }) => {
                let [low, middle, high] = from_second(offset);
                (22, [packets, low, middle, high])
            }
            (Form::Extended, Control::Done { len }) => (23, wide(len)),
            (_, Control::Abort(AbortReason(reason))) => (255, [reason, 0xFF, 0xFF, 0xFF]),
        };
        self.frame(form.management(), &[code, b1, b2, b3, b4, p0, p1, p2])
    }

    /// A packet of data: what is missing to seven bytes is filled with FF.
    pub(super) fn data(self, form: Form, number: u8, bytes: &[u8]) -> Option<CanFrame> {
        let mut data = [0xFF; 8];
        data[0] = number;
        for (place, byte) in data.iter_mut().skip(1).zip(bytes) {
            *place = *byte;
        }
        self.frame(form.data(), &data)
    }

    /// True if everybody is meant.
    pub(super) fn is_broadcast(self) -> bool {
        self.destination == EVERYONE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_frames_are_read_as_they_are_written() {
        let route = Route { source: 0x90, destination: 0xF7 };
        let all = [
            (Form::Plain, Control::Request { len: 20, packets: 3, at_once: 255 }),
            (Form::Plain, Control::Broadcast { len: 20, packets: 3 }),
            (Form::Plain, Control::Clear { packets: 3, next: 1 }),
            (Form::Plain, Control::Done { len: 20 }),
            (Form::Plain, Control::Abort(AbortReason::TIMEOUT)),
            (Form::Extended, Control::Request { len: 2000, packets: 286, at_once: 255 }),
            (Form::Extended, Control::Clear { packets: 16, next: 0x1_0203 }),
            (Form::Extended, Control::Offset { packets: 16, offset: 0x1_0202 }),
            (Form::Extended, Control::Done { len: 2000 }),
            (Form::Extended, Control::Abort(AbortReason::TWICE)),
        ];
        for (form, control) in all {
            let frame = route.control(form, 0xCB00, control).unwrap();
            let id = J1939Id::of(frame.id).unwrap();
            assert_eq!((id.source, id.destination, id.priority), (0x90, 0xF7, 7));
            assert_eq!(Wire::read(id, frame.data()), Some(Wire::Control(form, 0xCB00, control)));
        }
    }

    #[test]
    fn bytes_stand_where_j1939_21_has_them() {
        let route = Route { source: 0x90, destination: 0xF7 };
        let request = Control::Request { len: 20, packets: 3, at_once: 255 };
        let frame = route.control(Form::Plain, 0xCB00, request).unwrap();
        assert_eq!(frame.id.bits(), 0x1CEC_F790);
        assert_eq!(frame.data(), [16, 20, 0, 3, 255, 0x00, 0xCB, 0x00]);
        let frame = route.control(Form::Extended, 0xCB00, Control::Clear { packets: 16, next: 17 }).unwrap();
        assert_eq!(frame.id.bits(), 0x1CC8_F790);
        assert_eq!(frame.data(), [21, 16, 17, 0, 0, 0x00, 0xCB, 0x00]);
        let frame = route.data(Form::Extended, 2, &[1, 2, 3]).unwrap();
        assert_eq!((frame.id.bits(), frame.data()), (0x1CC7_F790, &[2, 1, 2, 3, 255, 255, 255, 255][..]));
    }
}
