//! What bytes on a line or a connection mean: one type a protocol, served alike on a pseudo-terminal and over TCP.

use std::fmt;
use std::time::Duration;

use rowscan_protocol::time::SimTime;

use crate::CanFrame;
use crate::error_frame::ErrorFrame;
use crate::port_event::{Outgoing, PortEvent};

/// One client's conversation.
pub trait Dialect: fmt::Debug + Default + Send + 'static {
    /// What serves it over TCP, in messages.
    const SERVER: &'static str;
    /// What the server says first.
    const GREETING: &'static str = "";
    /// How long a client gets no frames after it has opened the bus, host time.
    const QUIET: Duration = Duration::ZERO;
    /// Whoever connects is on the bus, without a word.
    const OPEN_AT_ONCE: bool = false;

    /// Takes bytes from the client; appends the answers and what comes of them.
    fn take(&mut self, bytes: &[u8], answers: &mut Vec<u8>, heard: &mut Vec<PortEvent>);

    /// Appends a frame from the bus, as the client shall see it.
    fn tell(&self, at: SimTime, frame: &CanFrame, out: &mut Vec<u8>);

    /// The controller tells of an error.
    fn error(&mut self, _error: &ErrorFrame) {}
}

/// Appends what goes out of a port.
pub(super) fn pass<D: Dialect>(dialect: &mut D, at: SimTime, what: &Outgoing, out: &mut Vec<u8>) {
    match what {
        Outgoing::Frame(frame) => dialect.tell(at, frame, out),
        Outgoing::Error(error) => dialect.error(error),
    }
}
