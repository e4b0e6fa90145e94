//! What the devices' clients were given: counted, timed and estimated from the delivered bytes, by taps in the byte paths.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rowscan_canopy::{Estimate, Pipeline};
use rowscan_protocol::host::HostEvent;
use rowscan_protocol::time::SimTime;
use rowscan_recording::{Packet, ScanReader, Side, StreamKind, Tap, Taps};

use crate::journal::Journal;
use crate::what::Count;

/// The largest payload that is taken for one: twice that of the largest scan telegram in text.
const MAX_PAYLOAD: usize = 64 * 1024;

/// Counts of a stream at one time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Counts {
    pub(crate) scans: u64,
    pub(crate) scans_lost: u64,
    pub(crate) scans_repeated: u64,
    pub(crate) telegrams_bad: u64,
    pub(crate) connections: u64,
}

impl Counts {
    /// One of them.
    pub(crate) fn of(&self, count: Count) -> u64 {
        match count {
            Count::ScansLost => self.scans_lost,
            Count::ScansRepeated => self.scans_repeated,
            Count::TelegramsBad => self.telegrams_bad,
            Count::Reconnects => self.connections.saturating_sub(1),
        }
    }

    /// The same without the scans, which change all the time.
    fn rare(self) -> Self {
        Self { scans: 0, ..self }
    }
}

/// What one device's clients were given.
#[derive(Debug)]
pub(crate) struct Stream {
    pipeline: Pipeline,
    /// The connection that scans come over first; those over others at the same time are not counted.
    taker: Option<u64>,
    bad: u64,
    connections: u64,
    /// When scans were delivered.
    pub(crate) scan_times: Vec<SimTime>,
    /// The counts after each change of any but the scans.
    pub(crate) changes: Vec<(SimTime, Counts)>,
    /// What the scans say, once the run is over.
    pub(crate) estimate: Option<Estimate>,
}

impl Stream {
    fn new(pipeline: Pipeline) -> Self {
        let (scan_times, changes) = (Vec::new(), Vec::new());
        Self { pipeline, taker: None, bad: 0, connections: 0, scan_times, changes, estimate: None }
    }

    /// The counts now.
    pub(crate) fn counts(&self) -> Counts {
        let progress = self.pipeline.progress();
        Counts {
            scans: progress.scans,
            scans_lost: progress.scans_lost,
            scans_repeated: progress.scans_repeated,
            telegrams_bad: self.bad,
            connections: self.connections,
        }
    }

    /// The counts at `at`.
    pub(crate) fn counts_at(&self, at: SimTime) -> Counts {
        let before = self.changes.iter().take_while(|(time, _)| *time <= at).last();
        before.map(|(_, counts)| *counts).unwrap_or_default()
    }

    fn note_change(&mut self, at: SimTime) {
        let counts = self.counts();
        if self.changes.last().map(|(_, known)| known.rare()).unwrap_or_default() != counts.rare() {
            self.changes.push((at, counts));
        }
    }
}

/// Watches what all devices' clients are given. Clones share it.
#[derive(Clone, Debug)]
pub(crate) struct Witness {
    journal: Journal,
    seen: Arc<Mutex<Seen>>,
}

#[derive(Debug, Default)]
struct Seen {
    streams: BTreeMap<String, Stream>,
    /// The run is over: nothing counts any more.
    over: bool,
}

/// One connection to a device.
struct Connection {
    witness: Witness,
    device: String,
    number: u64,
    ear: Mutex<Ear>,
}

/// What listens to one connection.
struct Ear {
    reader: ScanReader,
    /// Broken frames so far.
    bad_frames: u64,
}

impl Witness {
    pub(crate) fn new(journal: Journal) -> Self {
        Self { journal, seen: Arc::default() }
    }

    /// Watches the device `id` as well, whose scans go into `pipeline`.
    pub(crate) fn watch(&self, id: &str, pipeline: Pipeline) {
        self.lock().streams.insert(id.to_owned(), Stream::new(pipeline));
    }

    /// Taps for the byte paths. The one place where delivered bytes come in: they must be tapped behind the faults.
    pub(crate) fn taps(&self) -> Taps {
        let witness = self.clone();
        Taps::new(move |device, kind| witness.connected(device, kind))
    }

    /// The run is over; what was seen.
    pub(crate) fn close(&self) -> BTreeMap<String, Stream> {
        let mut seen = self.lock();
        seen.over = true;
        let mut streams = std::mem::take(&mut seen.streams);
        for stream in streams.values_mut() {
            stream.estimate = Some(stream.pipeline.finish());
        }
        streams
    }

    fn lock(&self) -> MutexGuard<'_, Seen> {
        self.seen.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn connected(&self, device: &str, kind: StreamKind) -> Tap {
        let Some(reader) = ScanReader::new(kind, MAX_PAYLOAD) else { return Tap::default() };
        let number = {
            let mut seen = self.lock();
            let Some(stream) = seen.streams.get_mut(device) else { return Tap::default() };
            stream.connections += 1;
            stream.note_change(self.journal.now());
            stream.connections
        };
        self.journal.note(format!("{device}.connected"), format!("connection {number}"));
        let connection = Connection {
            witness: self.clone(),
            device: device.to_owned(),
            number,
            ear: Mutex::new(Ear { reader, bad_frames: 0 }),
        };
        Tap::new(move |from, bytes| connection.delivered(from, bytes))
    }
}

impl Connection {
    fn delivered(&self, from: Side, bytes: &[u8]) {
        if from != Side::Device {
            return;
        }
        let at = self.witness.journal.now();
        let packet =
            Packet { from: Some(from), at_ns: Some(at.0), bytes: bytes.to_vec(), ..Packet::default() };
        let mut ear = self.ear();
        ear.reader.push(Duration::from_nanos(at.0), &packet);
        self.take(&mut ear, at);
    }

    fn take(&self, ear: &mut Ear, at: SimTime) {
        let journal = &self.witness.journal;
        let mut seen = self.witness.lock();
        if seen.over {
            return;
        }
        let Some(stream) = seen.streams.get_mut(&self.device) else { return };
        let bad = |stream: &mut Stream, why: String| {
            stream.bad += 1;
            journal.note(format!("{}.telegram_bad", self.device), why);
        };
        while let Some(event) = ear.reader.next_event() {
            match event {
                HostEvent::Scan if *stream.taker.get_or_insert(self.number) == self.number => {
                    if stream.scan_times.is_empty() {
                        journal.note(format!("{}.first_scan", self.device), "");
                    }
                    stream.scan_times.push(at);
                    stream.pipeline.push(ear.reader.scan());
                }
                HostEvent::Malformed { fault } => {
                    stream.pipeline.push_unreadable(&fault);
                    bad(stream, fault.to_string());
                }
                _ => {}
            }
        }
        let broken = ear.reader.counts().bad;
        for _ in ear.bad_frames..broken {
            bad(stream, "a broken frame".to_owned());
        }
        ear.bad_frames = broken;
        stream.note_change(at);
    }

    fn ear(&self) -> MutexGuard<'_, Ear> {
        self.ear.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Connection {
    fn drop(&mut self) {
        let at = self.witness.journal.now();
        {
            let mut ear = self.ear();
            ear.reader.finish();
            self.take(&mut ear, at);
        }
        let mut seen = self.witness.lock();
        if seen.over {
            return;
        }
        if let Some(stream) = seen.streams.get_mut(&self.device)
            && stream.taker == Some(self.number)
        {
            stream.taker = None;
        }
        self.witness
            .journal
            .note(format!("{}.disconnected", self.device), format!("connection {}", self.number));
    }
}

#[cfg(test)]
mod tests;
