//! The session of a stream of Compact telegrams: it listens, and gives scans.

use alloc::collections::VecDeque;
use core::net::SocketAddr;
use core::time::Duration;

use super::assembler::Assembler;
use super::frame::Frame;
use super::scan::ScanTelegram;
use super::segment_counts::SegmentCounts;
use super::senders::{Sender, Senders};
use super::stream::{Found, StreamDecoder};
use super::telegram::Telegram;
use super::wheel::Wheel;
use crate::frame::FrameCounts;
use crate::heard_settings::{HeardSettings, first_sent};
use crate::host::{HostEvent, HostSession, OtherSender, Transmit};
use crate::reading::Reading;
use crate::scan::Scan;
use crate::validity::ScanFault;

/// Faults kept until they are told; more in one piece of bytes are told by their count.
const MAX_FAULTS: usize = 64;

/// Readings kept until they are told; the oldest make room. Of a caller that takes events after each datagram there is one at most.
const MAX_READINGS: usize = 1024;

/// Readings that wait until it is known whose they are; the oldest make room. The first segment comes within a turn.
const MAX_HELD: usize = 64;

/// Listens to Compact telegrams: datagrams, or a stream of bytes.
#[derive(Clone, Debug, Default)]
pub struct CompactListener {
    decoder: StreamDecoder,
    assembler: Assembler,
    senders: Senders,
    /// Where the datagram that is being taken came from.
    from: Option<SocketAddr>,
    /// Readings of nobody yet, with the number and the place of who sent them.
    held: VecDeque<(u32, Option<SocketAddr>, Reading)>,
    /// Another scanner that was heard for the first time, and the one that is listened to instead.
    heard: VecDeque<[Option<u32>; 2]>,
    faults: VecDeque<ScanFault>,
    readings: VecDeque<Reading>,
    wheel: Wheel,
    /// A turn, and its lines that have been given.
    turn: Option<(Frame, usize)>,
    scan: Scan,
    counts: FrameCounts,
    now: Option<Duration>,
    /// What was heard beside the datagrams: they hold no conversation.
    settings: HeardSettings,
}

impl CompactListener {
    /// Takes a whole datagram: nothing of it goes on in the next one.
    pub fn handle_datagram(&mut self, now: Duration, bytes: &[u8]) {
        self.handle_bytes(now, bytes);
        self.handle_gap();
    }

    /// The same of one that is known where it came from: readings that hold no serial number are told apart by it.
    pub fn handle_datagram_from(&mut self, now: Duration, from: SocketAddr, bytes: &[u8]) {
        self.from = Some(from);
        self.handle_datagram(now, bytes);
        self.from = None;
    }

    /// Of several scanners that send here, listens to the one with this serial number; else to the first one that is heard. If nothing of it comes and a
    /// lot of another, that one is it: it calls itself otherwise in its telegrams.
    pub fn follow(&mut self, serial_number: u32) {
        self.senders.ask(serial_number);
    }

    fn take(&mut self, found: Found) {
        match found {
            Found::Bad { len, .. } => {
                self.counts.bad += 1;
                self.counts.skipped_bytes += len as u64;
            }
            Found::Telegram { telegram, .. } => {
                self.counts.frames += 1;
                match telegram {
                    Telegram::Scan(scan) => self.take_segment(scan),
                    Telegram::Imu(imu) => self.sort(0, self.from, Reading::Imu((&imu).into())),
                    Telegram::Encoder(encoder) => {
                        self.sort(encoder.sender_id, self.from, Reading::Wheel((&encoder).into()));
                    }
                }
            }
        }
    }

    fn take_segment(&mut self, scan: ScanTelegram) {
        let sender = scan.modules.0.first().map(|module| module.sender_id);
        if let Some(Sender::Other { first }) = sender.map(|sender| self.senders.take(sender, self.from)) {
            self.note_other(first, sender);
            return;
        }
        for (sender, from, reading) in core::mem::take(&mut self.held) {
            self.sort(sender, from, reading);
        }
        if let Err(fault) = self.assembler.push(scan, self.now) {
            self.faults.truncate(MAX_FAULTS - 1);
            self.faults.push_back(fault);
        }
    }

    /// Takes a reading of the scanner that is listened to, and leaves out one of another.
    fn sort(&mut self, sender: u32, from: Option<SocketAddr>, reading: Reading) {
        match self.senders.take_reading(sender, from) {
            Some(Sender::Own) => self.take_reading(reading),
            Some(Sender::Other { first }) => {
                self.note_other(first, Some(sender).filter(|sender| *sender != 0))
            }
            None => {
                if self.held.len() >= MAX_HELD {
                    self.held.pop_front();
                }
                self.held.push_back((sender, from, reading));
            }
        }
    }

    fn note_other(&mut self, first: bool, found: Option<u32>) {
        if first {
            self.heard.push_back([found, self.senders.followed()]);
        }
    }

    fn take_reading(&mut self, reading: Reading) {
        if let Reading::Wheel(wheel) = reading {
            self.wheel.take(wheel);
        }
        if self.readings.len() >= MAX_READINGS {
            self.readings.pop_front();
        }
        self.readings.push_back(reading);
    }

    fn take_all(&mut self) {
        while let Some(found) = self.decoder.next_found() {
            self.take(found);
        }
    }
}

impl HostSession for CompactListener {
    fn handle_bytes(&mut self, now: Duration, bytes: &[u8]) {
        self.now = Some(now);
        self.decoder.push(bytes);
    }

    fn handle_gap(&mut self) {
        self.decoder.finish();
        self.take_all();
        self.decoder = StreamDecoder::default();
    }

    fn handle_end(&mut self) {
        self.handle_gap();
        self.assembler.finish();
    }

    fn handle_timeout(&mut self, _: Duration) {}

    fn poll_timeout(&self) -> Option<Duration> {
        None
    }

    fn poll_transmit(&mut self) -> Option<Transmit> {
        None
    }

    fn poll_event(&mut self) -> Option<HostEvent> {
        loop {
            if let Some(fault) = self.faults.pop_front() {
                return Some(HostEvent::Malformed { fault });
            }
            if let Some([found, followed]) = self.heard.pop_front() {
                return Some(HostEvent::OtherSender { found, followed });
            }
            if let Some(reading) = self.readings.pop_front() {
                return Some(HostEvent::Reading(reading));
            }
            if let Some((frame, given)) = self.turn.take().filter(|(frame, given)| *given < frame.lines.len())
            {
                frame.to_scan_into(given, &mut self.scan);
                self.scan.received = self.now;
                self.scan.echo = self.settings.code().and_then(first_sent);
                self.scan.leftovers = self.settings.leftovers();
                self.scan.encoders.extend(self.wheel.at(self.scan.scan_time_us));
                self.turn = Some((frame, given + 1));
                return Some(HostEvent::Scan);
            }
            match self.assembler.next_frame() {
                Some(Ok(frame)) => {
                    self.turn = Some((frame, 0));
                    continue;
                }
                Some(Err(fault)) => return Some(HostEvent::Malformed { fault }),
                None => {}
            }
            let found = self.decoder.next_found()?;
            self.take(found);
        }
    }

    fn stop(&mut self, _: Duration) {}

    fn scan(&self) -> &Scan {
        &self.scan
    }

    fn counts(&self) -> FrameCounts {
        self.counts
    }

    fn segments(&self) -> SegmentCounts {
        self.assembler.counts()
    }

    fn heard_settings(&mut self) -> Option<&mut HeardSettings> {
        Some(&mut self.settings)
    }

    fn other_senders(&self) -> &[OtherSender] {
        self.senders.others()
    }

    fn unfinished_turn(&self) -> Option<u64> {
        self.assembler.unfinished()
    }

    fn is_done(&self) -> bool {
        false
    }
}
