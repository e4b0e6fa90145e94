//! The host's side of an LMS2xx, without I/O: finds the line's rate, raises it, sets the device up and turns its telegrams into scans.
//!
//! Calling order as in [`crate::client`], with one thing more: what is to be sent may be a change of the line's own rate
//! ([`Transmit::Rate`]), which is made once everything before it has left.

mod clock;
mod config;
mod machine;
mod step;

use core::time::Duration;

pub use config::{ClientConfig, DeviceInfo, Event, Transmit};
use machine::Machine;

use super::Rate;
use super::frame::{FrameCounts, FrameDecoder, Listener};
use crate::scan::Scan;

/// One line to a device, or a tapped one.
#[derive(Clone, Debug)]
pub struct Client {
    decoder: FrameDecoder,
    machine: Machine,
}

impl Client {
    /// A client that finds the device, sets it up, has it stream, and goes on decoding.
    pub fn new(config: ClientConfig) -> Self {
        Self { decoder: FrameDecoder::new(Listener::Host), machine: Machine::start(config) }
    }

    /// A client that only listens: to a recording, or a tapped line, with one side's frames or both sides'.
    pub fn listen() -> Self {
        Self { decoder: FrameDecoder::new(Listener::Either), machine: Machine::listen() }
    }

    /// Takes received bytes.
    pub fn handle_bytes(&mut self, now: Duration, bytes: &[u8]) {
        self.machine.set_time(now);
        self.decoder.push(bytes);
        self.advance();
    }

    /// No more bytes will come: good frames inside an unfinished one come out.
    pub fn handle_end(&mut self) {
        self.decoder.finish();
        self.advance();
    }

    /// It is `now`.
    pub fn handle_timeout(&mut self, now: Duration) {
        self.machine.set_time(now);
        if self.machine.is_due() {
            // Whatever began and did not end by now is no telegram.
            self.decoder.finish();
            self.advance();
            self.machine.check_deadline();
        }
    }

    /// When [`handle_timeout`](Self::handle_timeout) wants to be called; never, while nothing is awaited.
    pub fn poll_timeout(&self) -> Option<Duration> {
        self.machine.deadline()
    }

    /// The next thing to send.
    pub fn poll_transmit(&mut self) -> Option<Transmit> {
        self.machine.transmit()
    }

    /// The next event. One call reads no further than the next scan.
    pub fn poll_event(&mut self) -> Option<Event> {
        if !self.machine.has_event() {
            self.advance();
        }
        self.machine.next_event()
    }

    /// Begins a clean stop: the stream ends and the line goes back to 9600, then [`Event::Stopped`].
    pub fn stop(&mut self, now: Duration) {
        self.machine.set_time(now);
        self.machine.stop();
    }

    /// The scan of the last [`Event::Scan`], valid until the next call that changes the client.
    pub fn scan(&self) -> &Scan {
        self.machine.scan()
    }

    /// What was received.
    pub fn counts(&self) -> FrameCounts {
        self.decoder.counts()
    }

    /// The rate the line runs at.
    pub fn rate(&self) -> Rate {
        self.machine.rate()
    }

    /// True once the client waits for nothing more and sends nothing more.
    pub fn is_done(&self) -> bool {
        self.machine.is_done()
    }

    /// Reads frames up to the next scan: there is room for one.
    fn advance(&mut self) {
        while !self.machine.has_scan() && !self.machine.is_done() {
            let Some(heard) = self.decoder.next_received() else { break };
            self.machine.handle(&heard);
        }
    }
}
