//! The host's side of CoLa, without I/O: sets a scanner up and turns its telegrams into scans.
//!
//! The calling order is that of every [`HostSession`].

mod config;
mod machine;
mod step;

use core::time::Duration;

pub use config::{ColaConfig, Login};
use machine::Machine;

use crate::frame::{Accept, Dialect, FrameCounts, FrameDecoder};
use crate::heard_settings::HeardSettings;
use crate::host::{HostEvent, HostSession, Transmit};
use crate::scan::Scan;
use crate::telegram::LmdScandata;

/// One CoLa connection to a scanner, or a tapped line.
#[derive(Clone, Debug)]
pub struct ColaClient {
    decoder: FrameDecoder,
    /// Of a client that only listens: frames of the host, where its bytes come apart from the scanner's.
    overheard: Option<FrameDecoder>,
    /// The host's bytes began anew, and the scanner's have not yet: what it asks is answered there.
    asks_anew: bool,
    machine: Machine,
}

impl ColaClient {
    /// A client that sets the scanner up, subscribes to its scans, and goes on decoding them.
    pub fn new(config: ColaConfig, dialect: Dialect) -> Self {
        let decoder = FrameDecoder::new(Accept::Only(dialect), config.max_payload);
        Self { decoder, overheard: None, asks_anew: false, machine: Machine::start(config, dialect) }
    }

    /// A client that only listens: to a recording, or a tapped line, in either dialect, with one side's frames or both sides'.
    pub fn listen(max_payload: usize) -> Self {
        let decoder = || FrameDecoder::new(Accept::Either, max_payload);
        Self { decoder: decoder(), overheard: Some(decoder()), asks_anew: false, machine: Machine::listen() }
    }

    /// The telegram that the last scan came from.
    pub fn telegram(&self) -> &LmdScandata {
        self.machine.telegram()
    }

    /// Reads frames up to the next scan: there is room for one.
    fn advance(&mut self) {
        while !self.machine.has_scan() && !self.machine.is_done() {
            let Some(frame) = self.decoder.next_frame() else { break };
            self.machine.handle_frame(&frame);
        }
    }
}

impl HostSession for ColaClient {
    fn handle_bytes(&mut self, now: Duration, bytes: &[u8]) {
        self.asks_anew = false;
        self.machine.set_time(now);
        self.decoder.push(bytes);
        self.advance();
    }

    fn handle_end(&mut self) {
        self.decoder.finish();
        self.advance();
    }

    fn handle_gap(&mut self) {
        self.handle_end();
        if !core::mem::take(&mut self.asks_anew) {
            self.machine.forget_requests();
        }
    }

    /// A request is heard once it is whole, before the scanner's next bytes.
    fn overhear(&mut self, bytes: &[u8], follows_gap: bool) {
        let Some(decoder) = &mut self.overheard else { return };
        if follows_gap {
            decoder.finish();
            self.machine.forget_requests();
            self.asks_anew = true;
        }
        decoder.push(bytes);
        while let Some(frame) = decoder.next_frame() {
            self.machine.hear(&frame);
        }
    }

    fn heard_settings(&mut self) -> Option<&mut HeardSettings> {
        self.machine.heard()
    }

    fn handle_timeout(&mut self, now: Duration) {
        self.machine.set_time(now);
        let counts = self.decoder.counts();
        self.machine.check_deadline(counts.frames + counts.bad > 0);
    }

    fn poll_timeout(&self) -> Option<Duration> {
        self.machine.deadline()
    }

    fn poll_transmit(&mut self) -> Option<Transmit> {
        self.machine.transmit().map(Transmit::Frame)
    }

    fn poll_event(&mut self) -> Option<HostEvent> {
        if !self.machine.has_event() {
            self.advance();
        }
        self.machine.next_event()
    }

    /// Unsubscribes; other clients' scans go on.
    fn stop(&mut self, now: Duration) {
        self.machine.set_time(now);
        self.machine.stop();
    }

    fn scan(&self) -> &Scan {
        self.machine.scan()
    }

    fn counts(&self) -> FrameCounts {
        self.decoder.counts()
    }

    fn is_done(&self) -> bool {
        self.machine.is_done()
    }
}
