//! Listens to a recorded scanner in the language it speaks.

use std::time::Duration;

use rowscan_protocol::client::{self, Event};
use rowscan_protocol::frame::FrameCounts;
use rowscan_protocol::lms2xx;
use rowscan_protocol::scan::Scan;

use crate::{Joint, Packet, Side, StreamKind};

/// The largest payload that is taken for one: twice that of the largest scan telegram in text.
pub(crate) const MAX_PAYLOAD: usize = 64 * 1024;

/// A session that only listens, to one stream.
#[derive(Debug)]
pub struct Listener(Session);

#[derive(Debug)]
enum Session {
    Cola(Box<client::Client>),
    Lms2xx(Box<lms2xx::client::Client>),
}

impl Listener {
    /// For an LMS2xx.
    pub(crate) fn lms2xx() -> Self {
        Self(Session::Lms2xx(Box::new(lms2xx::client::Client::listen())))
    }

    /// For a stream of this kind; none if no scanner speaks on it. CoLa payloads longer than `max_payload` are none.
    pub fn new(kind: StreamKind, max_payload: usize) -> Option<Self> {
        match kind {
            StreamKind::Cola => Some(Self(Session::Cola(Box::new(client::Client::listen(max_payload))))),
            StreamKind::Lms2xx => Some(Self::lms2xx()),
            StreamKind::Nmea | StreamKind::Can | StreamKind::Bytes => None,
        }
    }

    /// Takes a packet of the stream that came at `at`, any epoch. What the host said is nothing to a listener.
    pub fn hear(&mut self, at: Duration, packet: &Packet) {
        if packet.from == Some(Side::Host) {
            return;
        }
        if packet.joint != Joint::Seamless {
            // What was unfinished stays so.
            self.end();
        }
        self.hear_bytes(at, &packet.bytes);
    }

    /// Takes the device's next bytes.
    pub(crate) fn hear_bytes(&mut self, at: Duration, bytes: &[u8]) {
        match &mut self.0 {
            Session::Cola(client) => client.handle_bytes(at, bytes),
            Session::Lms2xx(client) => client.handle_bytes(at, bytes),
        }
    }

    /// No more bytes will come.
    pub fn end(&mut self) {
        match &mut self.0 {
            Session::Cola(client) => client.handle_end(),
            Session::Lms2xx(client) => client.handle_end(),
        }
    }

    /// What was heard next: scans, and telegrams that make no sense.
    pub fn next_event(&mut self) -> Option<Event> {
        match &mut self.0 {
            Session::Cola(client) => client.poll_event(),
            Session::Lms2xx(client) => loop {
                match client.poll_event()? {
                    lms2xx::client::Event::Scan => return Some(Event::Scan),
                    lms2xx::client::Event::Malformed { reason } => {
                        return Some(Event::Malformed { reason: reason.to_string() });
                    }
                    _ => {}
                }
            },
        }
    }

    /// The next whole scan; what makes no sense is passed over.
    pub(crate) fn next_scan(&mut self) -> Option<&Scan> {
        loop {
            if self.next_event()? == Event::Scan {
                return Some(self.scan());
            }
        }
    }

    /// The scan of the last [`Event::Scan`].
    pub fn scan(&self) -> &Scan {
        match &self.0 {
            Session::Cola(client) => client.scan(),
            Session::Lms2xx(client) => client.scan(),
        }
    }

    /// What was received.
    pub fn counts(&self) -> FrameCounts {
        match &self.0 {
            Session::Cola(client) => client.counts(),
            Session::Lms2xx(client) => client.counts(),
        }
    }
}
