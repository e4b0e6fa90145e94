//! The host's side of an LMS2xx, without I/O: finds the line's rate, raises it, sets the device up and turns its telegrams into scans.
//!
//! The calling order is that of every [`HostSession`]. Output may be a change of the line's own rate ([`Transmit::Rate`]), to be made once
//! everything before it has left.

mod clock;
mod config;
mod machine;
mod step;

use core::time::Duration;

pub use config::Lms2xxConfig;
use machine::Machine;

use super::Rate;
use super::frame::{FrameCounts, FrameDecoder, Listener};
use crate::host::{HostEvent, HostSession, Transmit};
use crate::scan::Scan;

/// One serial line to a device, or a tapped one.
#[derive(Clone, Debug)]
pub struct Lms2xxClient {
    decoder: FrameDecoder,
    machine: Machine,
    /// When bytes came last.
    last_bytes: Option<Duration>,
    /// Bad frames while a reply was awaited: a request cuts off what the device is sending, which is no damage.
    cut_off: u64,
}

/// After such a silence an unfinished telegram was cut off by a request, as a device does. The device itself pauses for 14 ms at most; the
/// rest is for adapters and networks.
const CUT_OFF: Duration = Duration::from_millis(100);

impl Lms2xxClient {
    /// A client that finds the device, sets it up, has it stream, and goes on decoding.
    pub fn new(config: Lms2xxConfig) -> Self {
        Self {
            decoder: FrameDecoder::new(Listener::Host),
            machine: Machine::start(config),
            last_bytes: None,
            cut_off: 0,
        }
    }

    /// A client that only listens: to a recording, or a tapped line, with one side's frames or both sides'.
    pub fn listen() -> Self {
        Self {
            decoder: FrameDecoder::new(Listener::Either),
            machine: Machine::listen(),
            last_bytes: None,
            cut_off: 0,
        }
    }

    /// The rate the line runs at.
    pub fn rate(&self) -> Rate {
        self.machine.rate()
    }

    /// When the telegram that is coming in was cut off, unless more of it comes; none while no reply is waited for.
    fn cut_off_at(&self) -> Option<Duration> {
        self.machine.deadline()?;
        let last = self.last_bytes.filter(|_| self.decoder.pending() > 0)?;
        Some(last.saturating_add(CUT_OFF))
    }

    /// Reads frames up to the next scan: there is room for one.
    fn advance(&mut self) {
        while !self.machine.has_scan() && !self.machine.is_done() {
            // Bytes skipped on the way to this one count.
            let awaited = self.machine.deadline().is_some();
            let bad = self.decoder.counts().bad;
            let junk = self.decoder.skip_junk();
            let found = self.decoder.next_received().map(|heard| self.machine.handle(&heard, junk)).is_some();
            if awaited {
                self.cut_off += self.decoder.counts().bad - bad;
            }
            if !found {
                break;
            }
        }
    }
}

impl HostSession for Lms2xxClient {
    fn handle_bytes(&mut self, now: Duration, bytes: &[u8]) {
        self.machine.set_time(now);
        self.last_bytes = Some(now);
        self.decoder.push(bytes);
        self.advance();
    }

    fn handle_end(&mut self) {
        self.decoder.finish();
        self.advance();
    }

    fn handle_timeout(&mut self, now: Duration) {
        self.machine.set_time(now);
        if self.cut_off_at().is_some_and(|at| now >= at) {
            self.decoder.finish();
            self.advance();
        }
        if self.machine.is_due() {
            // Whatever began and did not end by now is no telegram.
            self.decoder.finish();
            self.advance();
            self.machine.check_deadline();
        }
    }

    fn poll_timeout(&self) -> Option<Duration> {
        let deadline = self.machine.deadline()?;
        Some(self.cut_off_at().map_or(deadline, |at| at.min(deadline)))
    }

    fn poll_transmit(&mut self) -> Option<Transmit> {
        self.machine.transmit()
    }

    fn poll_event(&mut self) -> Option<HostEvent> {
        if !self.machine.has_event() {
            self.advance();
        }
        self.machine.next_event()
    }

    /// The stream ends and the line goes back to 9600.
    fn stop(&mut self, now: Duration) {
        self.machine.set_time(now);
        self.machine.stop();
    }

    fn scan(&self) -> &Scan {
        self.machine.scan()
    }

    fn counts(&self) -> FrameCounts {
        let counts = self.decoder.counts();
        FrameCounts { bad: counts.bad.saturating_sub(self.cut_off), ..counts }
    }

    fn is_done(&self) -> bool {
        self.machine.is_done()
    }
}
