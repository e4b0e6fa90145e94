//! The host's side, without I/O: sets a scanner up and turns its telegrams into scans.
//!
//! Calling order: hand in bytes ([`Client::handle_bytes`]) or time ([`Client::handle_timeout`]); then take events
//! ([`Client::poll_event`]) until there is none, then frames to send ([`Client::poll_transmit`]) until there is none, then ask when time
//! is due next ([`Client::poll_timeout`]). A new client begins with `poll_transmit`.
//!
//! Time is a [`Duration`] since an epoch of the caller's choice.

mod config;
mod event;
mod machine;
mod step;

use alloc::vec::Vec;
use core::time::Duration;

pub use config::{ClientConfig, Login};
pub use event::{DeviceInfo, Event};
use machine::Machine;

use crate::frame::{Accept, Dialect, FrameCounts, FrameDecoder};
use crate::scan::Scan;
use crate::telegram::LmdScandata;

/// One connection to a scanner, or a tapped line.
#[derive(Clone, Debug)]
pub struct Client {
    decoder: FrameDecoder,
    machine: Machine,
}

impl Client {
    /// A client that sets the scanner up, subscribes to its scans, and goes on decoding them.
    pub fn new(config: ClientConfig, dialect: Dialect) -> Self {
        let decoder = FrameDecoder::new(Accept::Only(dialect), config.max_payload);
        Self { decoder, machine: Machine::start(config, dialect) }
    }

    /// A client that only listens: to a recording, or a tapped line, in either dialect, with one side's frames or both sides'.
    pub fn listen(max_payload: usize) -> Self {
        Self { decoder: FrameDecoder::new(Accept::Either, max_payload), machine: Machine::listen() }
    }

    /// Takes received bytes.
    pub fn handle_bytes(&mut self, now: Duration, bytes: &[u8]) {
        self.machine.set_time(now);
        self.decoder.push(bytes);
        self.advance();
    }

    /// No more bytes will come, as at a recording's end: good frames inside an unfinished one come out.
    pub fn handle_end(&mut self) {
        self.decoder.finish();
        self.advance();
    }

    /// It is `now`.
    pub fn handle_timeout(&mut self, now: Duration) {
        self.machine.set_time(now);
        self.machine.check_deadline();
    }

    /// When [`handle_timeout`](Self::handle_timeout) wants to be called; never, while nothing is awaited.
    pub fn poll_timeout(&self) -> Option<Duration> {
        self.machine.deadline()
    }

    /// The next frame to send, to be sent in one write.
    pub fn poll_transmit(&mut self) -> Option<Vec<u8>> {
        self.machine.transmit()
    }

    /// The next event. One call reads no further than the next scan.
    pub fn poll_event(&mut self) -> Option<Event> {
        if !self.machine.has_event() {
            self.advance();
        }
        self.machine.next_event()
    }

    /// Begins a clean stop: unsubscribes, then [`Event::Stopped`]. Other clients' scans go on.
    pub fn stop(&mut self, now: Duration) {
        self.machine.set_time(now);
        self.machine.stop();
    }

    /// The scan of the last [`Event::Scan`], valid until the next `handle_…` or [`poll_event`](Self::poll_event).
    pub fn scan(&self) -> &Scan {
        self.machine.scan()
    }

    /// The telegram that scan came from.
    pub fn telegram(&self) -> &LmdScandata {
        self.machine.telegram()
    }

    /// What was received.
    pub fn counts(&self) -> FrameCounts {
        self.decoder.counts()
    }

    /// True once the client waits for nothing more and sends nothing more.
    pub fn is_done(&self) -> bool {
        self.machine.is_done()
    }

    /// Reads frames up to the next scan: there is room for one.
    fn advance(&mut self) {
        while !self.machine.has_scan() && !self.machine.is_done() {
            let Some(frame) = self.decoder.next_frame() else { break };
            self.machine.handle_frame(&frame);
        }
    }
}
