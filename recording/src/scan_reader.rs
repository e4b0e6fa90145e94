//! Decodes one recorded stream in the scanner's protocol.

use std::time::Duration;

use rowscan_protocol::client::ColaClient;
use rowscan_protocol::compact::{CompactListener, SegmentCounts};
use rowscan_protocol::frame::FrameCounts;
use rowscan_protocol::heard_settings::HeardSettings;
use rowscan_protocol::host::{HostEvent, HostSession, OtherSender};
use rowscan_protocol::lms2xx::client::Lms2xxClient;
use rowscan_protocol::scan::Scan;

use crate::{Joint, Packet, Side, StreamKind};

/// The largest payload that is taken for one: twice that of the largest scan telegram in text.
pub const MAX_PAYLOAD: usize = 64 * 1024;

/// A session that only listens, to one stream.
#[derive(Debug)]
pub struct ScanReader(Box<dyn HostSession + Send>);

impl ScanReader {
    /// For an LMS2xx.
    pub(crate) fn lms2xx() -> Self {
        Self(Box::new(Lms2xxClient::listen()))
    }

    /// For a stream of this kind; `None` if no scanner speaks on it. CoLa payloads longer than `max_payload` are not taken for payloads.
    pub fn new(kind: StreamKind, max_payload: usize) -> Option<Self> {
        match kind {
            StreamKind::Cola => Some(Self(Box::new(ColaClient::listen(max_payload)))),
            StreamKind::Lms2xx => Some(Self::lms2xx()),
            StreamKind::Compact => Some(Self(Box::new(CompactListener::default()))),
            StreamKind::Nmea | StreamKind::Can | StreamKind::Bytes => None,
        }
    }

    /// Takes a packet of the stream that came at `at`, any epoch. What the host asked for is heard: it tells which echo the scans behind it hold
    /// ([`Scan::echo`]), and what was taken from them ([`Scan::leftovers`]).
    pub fn push(&mut self, at: Duration, packet: &Packet) {
        if packet.from == Some(Side::Host) {
            self.0.overhear(&packet.bytes, packet.joint != Joint::Seamless);
            return;
        }
        if packet.joint != Joint::Seamless {
            // What was unfinished stays so.
            self.0.handle_gap();
        }
        self.push_bytes(at, &packet.bytes);
    }

    /// Takes the device's next bytes, which came at `at`, any epoch.
    pub fn push_bytes(&mut self, at: Duration, bytes: &[u8]) {
        self.0.handle_bytes(at, bytes);
    }

    /// No more bytes will come.
    pub fn finish(&mut self) {
        self.0.handle_end();
    }

    /// Which settings it has heard of; none of a protocol that has no such settings.
    pub fn heard_settings(&mut self) -> Option<&mut HeardSettings> {
        self.0.heard_settings()
    }

    /// The next event: scans, and telegrams that cannot be read.
    pub fn next_event(&mut self) -> Option<HostEvent> {
        self.0.poll_event()
    }

    /// The next whole scan; telegrams that cannot be read are skipped.
    pub(crate) fn next_scan(&mut self) -> Option<&Scan> {
        loop {
            if self.next_event()? == HostEvent::Scan {
                return Some(self.scan());
            }
        }
    }

    /// The scan of the last [`HostEvent::Scan`].
    pub fn scan(&self) -> &Scan {
        self.0.scan()
    }

    /// What became of the parts of scans, where scans come in parts.
    pub fn segments(&self) -> SegmentCounts {
        self.0.segments()
    }

    /// The number of the turn that had begun when its parts ended, and gave no scan.
    pub fn unfinished_turn(&self) -> Option<u64> {
        self.0.unfinished_turn()
    }

    /// Other scanners whose telegrams came in the same stream, and were left out.
    pub fn other_senders(&self) -> &[OtherSender] {
        self.0.other_senders()
    }

    /// Frames and bytes received so far.
    pub fn counts(&self) -> FrameCounts {
        self.0.counts()
    }
}
