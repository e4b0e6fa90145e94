//! What passes between the bus and its ports.

use std::fmt;

use rowscan_ports::in_flight::Pending;
use rowscan_protocol::time::SimTime;

use crate::error_frame::ErrorFrame;
use crate::frame::CanFrame;

/// Why a port is off its bus for now.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BusLoss {
    /// The controller counted too many errors.
    #[error(
        "the CAN controller is bus-off: check bit rate, wiring and terminators; it returns with \
         `ip link set can0 type can restart`, or by itself with restart-ms set"
    )]
    BusOff,
    /// The interface is down or gone.
    #[error("the CAN interface is down or gone; nothing is sent until it is up again")]
    Down,
    /// The socketcand server closed the connection.
    #[error("the socketcand server is gone; nothing is sent until it is back, which is tried all the time")]
    ServerGone,
    /// The host runs the adapter at another rate.
    #[error("the slcan adapter was opened at another rate than the bus's 250 kbit/s (S5); it is off the bus")]
    WrongRate,
}

/// Who said a frame: a port, and of those behind it one, where a port serves several.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Origin {
    /// The port's number on its bus.
    pub port: usize,
    /// The client behind it; 0 where a port has no clients of its own.
    pub client: u64,
}

/// What a port tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PortEvent {
    /// Someone is there who was not: an adapter was opened, a client connected, the interface came up.
    Opened,
    /// A frame was received.
    Frame(CanFrame),
    /// The port is off its bus until it is [`PortEvent::Opened`] again.
    Lost(BusLoss),
    /// Nothing came of what a client sent.
    Refused(Refused),
}

/// What a client sent that was refused: its beginning, and why.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Refused {
    bytes: [u8; Self::MOST],
    len: u8,
    why: &'static str,
}

impl Refused {
    /// Bytes that are kept.
    const MOST: usize = 63;

    /// Keeps the beginning of what was sent.
    pub fn of(sent: &[u8], why: &'static str) -> Self {
        let mut bytes = [0; Self::MOST];
        let len = sent.len().min(Self::MOST);
        bytes.iter_mut().zip(sent).for_each(|(kept, byte)| *kept = *byte);
        Self { bytes, len: len as u8, why }
    }
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sent = self.bytes.get(..usize::from(self.len)).unwrap_or_default();
        write!(f, "`{}`: {}", sent.escape_ascii(), self.why)
    }
}

impl fmt::Debug for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Refused({self})")
    }
}

/// What goes out of a port.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Outgoing {
    Frame(CanFrame),
    Error(ErrorFrame),
}

impl Outgoing {
    /// The frame; none for what a controller tells.
    pub(crate) fn frame(&self) -> Option<&CanFrame> {
        match self {
            Self::Frame(frame) => Some(frame),
            Self::Error(_) => None,
        }
    }
}

/// A frame on its way out of a port.
#[derive(Clone, Debug)]
pub(crate) struct OutgoingFrame {
    pub(crate) at: SimTime,
    pub(crate) what: Outgoing,
    /// The client that said it, and is not told it again.
    pub(crate) said_by: Option<u64>,
    /// Kept until the frame is written, or has gone where nobody hears it.
    pub(crate) pending: Pending,
}
