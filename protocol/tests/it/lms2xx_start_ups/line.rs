//! A device on its line, and a host at a rate of its own, in simulated time.

use std::time::Duration;

use rowscan_protocol::lms2xx::Rate;
use rowscan_protocol::lms2xx::device::{Beams, Device, Pace, Sweep};
use rowscan_protocol::lms2xx::frame::{FrameDecoder, Listener, Received, encode};
use rowscan_protocol::time::SimTime;

pub struct Line {
    pub device: Device,
    pub now: SimTime,
    /// The host's rate.
    pub tty: Rate,
    pub first_scan: Option<SimTime>,
    /// Nobody is there to hear.
    pub closed: bool,
    sending: Option<Sending>,
    free: SimTime,
    host: FrameDecoder,
}

struct Sending {
    bytes: Vec<u8>,
    began: SimTime,
    pace: Pace,
    /// Bytes that came before the host forgot what it had.
    forgotten: usize,
}

impl Sending {
    fn end(&self) -> SimTime {
        self.pace.end(self.began, self.bytes.len())
    }
}

/// What the host hears.
pub enum Heard {
    Ack,
    Nak,
    Body(Vec<u8>),
}

impl Line {
    pub fn new(device: Device) -> Self {
        Self {
            tty: Rate::R9600,
            device,
            now: SimTime::ZERO,
            first_scan: None,
            closed: false,
            sending: None,
            free: SimTime::ZERO,
            host: FrameDecoder::new(Listener::Host),
        }
    }

    /// Puts a frame around the body and sends it; the host has forgotten what came before.
    pub fn send(&mut self, body: &[u8]) {
        let mut frame = Vec::new();
        encode(0, body, &mut frame);
        self.write(&frame);
        self.host = FrameDecoder::new(Listener::Host);
        if let Some(sending) = &mut self.sending {
            sending.forgotten = sending.pace.left(sending.began, sending.bytes.len(), self.now);
        }
    }

    /// Sends bytes; they have arrived when it returns.
    pub fn write(&mut self, bytes: &[u8]) {
        let (first, spacing) = (self.now, self.tty.transmission(1));
        self.wait(self.tty.transmission(bytes.len()));
        // At another rate nothing arrives that could be read.
        let heard = if self.tty == self.device.rate() { bytes } else { &[0xF8] };
        self.device.handle_bytes(first, spacing, heard);
        if let Some(sending) = self.sending.as_mut().filter(|_| self.device.interrupts()) {
            let left = sending.pace.left(sending.began, sending.bytes.len(), self.now);
            sending.bytes.truncate(left + 1);
            self.free = sending.end();
        }
    }

    pub fn wait(&mut self, time: Duration) {
        let end = self.now + time;
        while self.now < end {
            self.step(end);
        }
    }

    /// The next that the host hears within this time.
    pub fn hear(&mut self, within: Duration) -> Option<Heard> {
        let end = self.now + within;
        loop {
            match self.host.next_received() {
                Some(Received::Ack) => return Some(Heard::Ack),
                Some(Received::Nak) => return Some(Heard::Nak),
                Some(Received::Frame(frame)) => return Some(Heard::Body(frame.body.to_vec())),
                Some(Received::Broken | Received::CutOff { .. }) => {}
                None if self.now >= end => return None,
                None => drop(self.step(end)),
            }
        }
    }

    /// The bytes that came since the host last wrote, as they are; for a session that reads by itself.
    pub fn step_to(&mut self, end: SimTime) -> Vec<u8> {
        self.step(end)
    }

    /// Goes on to what happens next, at most to `end`; what has arrived at the host.
    fn step(&mut self, end: SimTime) -> Vec<u8> {
        self.device.handle_timeout(self.now);
        if self.sending.is_none()
            && let Some(bytes) = self.device.poll_transmit(self.now)
        {
            let sending =
                Sending { bytes, began: self.free.max(self.now), pace: self.device.pace(), forgotten: 0 };
            self.free = sending.end();
            self.sending = Some(sending);
        }
        let sweep = self.device.plan(self.free).filter(|_| self.sending.is_none());
        if sweep.is_none() {
            self.free = self.free.max(self.now);
        }
        let due = match &self.sending {
            Some(sending) => Some(sending.end()),
            None => [self.device.poll_timeout(), sweep.map(|sweep| sweep.done())].into_iter().flatten().min(),
        };
        self.now = due.map_or(end, |due| due.min(end)).max(self.now);
        if let Some(sweep) = sweep.filter(|sweep| sweep.done() <= self.now) {
            self.measure(sweep);
        }
        match self.sending.take_if(|sending| sending.end() <= self.now) {
            Some(sending) => self.arrive(&sending),
            None => Vec::new(),
        }
    }

    fn measure(&mut self, sweep: Sweep) {
        for turn in sweep.turns() {
            let count = self.device.turn_beams(turn).len();
            let beams = Beams { range_mm: &vec![1500; count], remission: &vec![0x4000; count] };
            self.device.measure(sweep, turn, beams);
        }
        self.device.finish(self.now, sweep);
    }

    fn arrive(&mut self, sending: &Sending) -> Vec<u8> {
        // What another rate makes of it is no frame.
        let heard = match sending.pace.rate == self.tty {
            true => sending.bytes[sending.forgotten..].to_vec(),
            false => vec![0x80; sending.bytes.len() / 3],
        };
        if !self.closed {
            self.host.push(&heard);
        }
        self.device.transmitted(self.now);
        heard
    }
}
