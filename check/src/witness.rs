//! What the devices' clients were given: counted, timed and estimated from the delivered bytes, by taps in the byte paths.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rowscan_canopy::{Estimate, Pipeline};
use rowscan_emulator::{CountReader, ScannerCounts};
use rowscan_protocol::counting::Counting;
use rowscan_protocol::heard_settings::SettingsInForce;
use rowscan_protocol::host::HostEvent;
use rowscan_protocol::scan::Scan;
use rowscan_protocol::time::SimTime;
use rowscan_recording::{DATAGRAMS, Joint, MAX_PAYLOAD, Packet, ScanReader, Side, StreamKind, Tap, Taps};

use crate::fault_desk::FaultDesk;
use crate::journal::Journal;
use crate::truth::Passed;

mod counts;

pub(crate) use counts::Counts;

/// The number of what comes as datagrams, among connections.
const BY_DATAGRAMS: u64 = 0;

/// What one device's clients were given.
#[derive(Debug)]
pub(crate) struct Stream {
    /// Counts every scan, also of the time before the drive.
    counting: Counting,
    /// Measures the drive's scans.
    pipeline: Pipeline,
    /// Scans of the latest instant before it is known that the drive has started: the one that starts it is delivered before.
    waiting: Vec<(SimTime, Scan)>,
    /// The connection that scans are counted on, and the last one's number.
    taker: Option<(u64, u16)>,
    bad: u64,
    connections: u64,
    /// What the device says of itself.
    device: Option<CountReader>,
    /// Scans that it had not sent when the first one was delivered.
    not_sent_before: Option<u64>,
    not_sent: u64,
    /// The number in the last scan that a connection delivered.
    last_counter: Option<u16>,
    /// The number of the last turn that datagrams delivered.
    last_turn: Option<u16>,
    /// The turn of which parts had come at the end, and no scan.
    unfinished_turn: Option<u64>,
    /// Who listens to its datagrams.
    datagrams: Option<Arc<Connection>>,
    /// Segments that were lost on their way; none of a device that sends none.
    segments_lost: Option<u64>,
    /// Scans that the device made after the last delivered one, once the run has reached its end.
    lost_at_end: u64,
    /// How often the device had begun to count anew before the first scan that was delivered.
    anew_before: Option<u64>,
    /// How often it has begun to count anew, and nothing that was delivered told it.
    anew_unseen: u64,
    /// Telegrams that went out before the first one that was delivered.
    lost_before: u64,
    /// Scans that the device had sent before the first delivered one, as to a client at another baud rate.
    sent_before: Option<u64>,
    /// How long in the drive nobody took the device's scans, and how long it was so at the end; none where it does not tell.
    pub(crate) unheard: Option<Unheard>,
    /// What its conversations tell of its echo.
    echo: SettingsInForce,
    /// When scans were delivered.
    pub(crate) scan_times: Vec<SimTime>,
    /// When each of the drive's scans was delivered, and where along the row the estimate had it, metres.
    places: Vec<(SimTime, f64)>,
    /// The same, with the way truly driven, once the run is over.
    pub(crate) passed: Vec<Passed>,
    /// Each change of any count but the scans.
    pub(crate) changes: Vec<Change>,
    /// What the scans say, once the run is over.
    pub(crate) estimate: Option<Estimate>,
}

/// How long in the drive nobody took a device's scans.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Unheard {
    pub(crate) all: Duration,
    /// Since somebody last took one.
    pub(crate) at_end: Duration,
}

/// Counts, and when they became so.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Change {
    pub(crate) at: SimTime,
    /// Events noted before it.
    events: usize,
    pub(crate) counts: Counts,
}

impl Stream {
    fn new(pipeline: Pipeline) -> Self {
        Self {
            counting: Counting::default(),
            pipeline,
            waiting: Vec::new(),
            taker: None,
            bad: 0,
            connections: 0,
            device: None,
            not_sent_before: None,
            not_sent: 0,
            last_counter: None,
            last_turn: None,
            unfinished_turn: None,
            datagrams: None,
            segments_lost: None,
            lost_at_end: 0,
            anew_before: None,
            anew_unseen: 0,
            lost_before: 0,
            sent_before: None,
            unheard: None,
            scan_times: Vec::new(),
            places: Vec::new(),
            passed: Vec::new(),
            changes: Vec::new(),
            estimate: None,
            echo: SettingsInForce::default(),
        }
    }

    /// True if the device sends segments.
    pub(crate) fn has_segments(&self) -> bool {
        self.segments_lost.is_some()
    }

    /// True if the device says what it has not sent.
    pub(crate) fn device_tells(&self) -> bool {
        self.not_sent_before.is_some()
    }

    /// The counts now.
    pub(crate) fn counts(&self) -> Counts {
        Counts {
            scans: self.counting.scans,
            scans_lost: self.counting.lost + self.lost_at_end + self.lost_before,
            untold: self.counting.untold() + self.anew_unseen,
            scans_repeated: self.counting.repeated,
            segments_lost: self.segments_lost.unwrap_or_default(),
            telegrams_bad: self.bad,
            connections: self.connections,
            not_sent: self.not_sent.saturating_sub(self.not_sent_before.unwrap_or_default()),
        }
    }

    /// What the user should know of scans that others have overtaken, where there are any.
    pub(crate) fn told_of_late(&self, id: &str) -> Option<String> {
        let late = self.counting.late;
        (late > 0).then(|| {
            format!("{late} scans of `{id}` came behind later ones: they are neither lost nor repeated, and in no area")
        })
    }

    /// The counts at the event number `event`, from 0: many things may happen at one instant.
    pub(crate) fn counts_at(&self, event: usize) -> Counts {
        let before = self.changes.iter().take_while(|change| change.events <= event).last();
        before.map(|change| change.counts).unwrap_or_default()
    }

    fn note_change(&mut self, at: SimTime, events: usize) {
        let counts = self.counts();
        if self.changes.last().map(|known| known.counts.rare()).unwrap_or_default() != counts.rare() {
            self.changes.push(Change { at, events, counts });
        }
    }

    /// True if scans of this connection count: it is the first, or the one before it gets none any more, as behind a cable that is out. A device that sends
    /// datagrams has no scans for connections meanwhile.
    fn takes(&mut self, connection: u64, counter: u16) -> bool {
        let changes = |taker| taker != connection && taker != BY_DATAGRAMS && connection != BY_DATAGRAMS;
        let takes = match self.taker {
            Some((taker, last)) if changes(taker) => (2..0x8000).contains(&counter.wrapping_sub(last)),
            _ => true,
        };
        if takes {
            self.taker = Some((connection, counter));
        }
        takes
    }

    /// Takes a scan in that is delivered at `at`, where the drive has started at `began`.
    fn scan(&mut self, at: SimTime, scan: &Scan, began: Option<SimTime>) {
        if let Some(not_sent) = self.device_counts().and_then(|counts| counts.scans_not_sent()) {
            self.not_sent = not_sent;
            self.not_sent_before.get_or_insert(self.not_sent);
        }
        if self.sent_before.is_none()
            && let Some(counts) = self.device_counts()
        {
            (self.sent_before, self.anew_before) = (Some(counts.scans_sent), counts.numbered_anew);
        }
        match self.taker {
            Some((BY_DATAGRAMS, _)) => self.last_turn = Some(scan.scan_counter),
            _ => {
                // What a client has asked for and never got, before all that it has.
                if self.last_counter.is_none() {
                    let first = self.device_counts().and_then(|counts| counts.first_taken);
                    self.lost_before = behind(Some(scan.telegram_counter), first);
                }
                self.last_counter = Some(scan.telegram_counter);
            }
        }
        self.scan_times.push(at);
        self.counting.observe(scan);
        self.drive(began);
        match began {
            Some(began) if at >= began => self.measure(at, scan),
            _ => {
                // The tractor stands: what it sees again and again is no row driven past.
                self.waiting.retain(|(before, _)| *before == at);
                self.waiting.push((at, scan.clone()));
            }
        }
    }

    fn device_counts(&self) -> Option<ScannerCounts> {
        self.device.as_ref()?.counts()
    }

    /// The run is over. If it has reached its end, what the device made after the last delivered scan is lost: it may not pay to stay away.
    fn end(&mut self, reached: bool) {
        let Some(counts) = self.device_counts() else { return };
        self.unheard = counts.unheard.zip(counts.silence).map(|(all, at_end)| Unheard { all, at_end });
        if !reached {
            return;
        }
        if let Some(not_sent) = counts.scans_not_sent().filter(|_| self.device_tells()) {
            self.not_sent = not_sent;
        }
        let anew = counts.numbered_anew.zip(self.anew_before).map(|(all, before)| all.saturating_sub(before));
        self.anew_unseen = anew.unwrap_or_default().saturating_sub(self.counting.untold());
        if self.anew_unseen > 0 {
            return;
        }
        let by_datagrams = self.taker.is_some_and(|(taker, _)| taker == BY_DATAGRAMS);
        self.lost_at_end = match counts.datagrams.filter(|_| by_datagrams) {
            Some(sent) => {
                let turns =
                    behind(sent.last_turn.map(|last| last as u16), self.last_turn) / sent.interval.max(1);
                // Nobody can tell that a turn without its end is over.
                let turns = turns.saturating_sub(u64::from(
                    sent.last_turn.is_some() && sent.last_turn == self.unfinished_turn,
                ));
                turns * sent.lines
            }
            None if counts.numbered_anew.is_none() => self.not_delivered(counts.scans_sent),
            None => behind(counts.last_counter, self.last_counter),
        };
    }

    /// Scans lost after the last delivered one, of a device that has sent `sent` in all. An LMS2xx numbers its scans from 0 to 255 again and again, so the numbers alone
    /// do not tell.
    fn not_delivered(&self, sent: u64) -> u64 {
        let Counting { scans, repeated, lost, .. } = self.counting;
        let sent = sent.saturating_sub(self.sent_before.unwrap_or(sent));
        let is_known = self.counting.untold() == 0;
        if is_known { sent.saturating_sub(scans - repeated + lost) } else { 0 }
    }

    /// Measures those scans that waited for the start of the drive and are of it.
    fn drive(&mut self, began: Option<SimTime>) {
        let Some(began) = began else { return };
        for (at, scan) in std::mem::take(&mut self.waiting) {
            if at >= began {
                self.measure(at, &scan);
            }
        }
    }

    fn measure(&mut self, at: SimTime, scan: &Scan) {
        self.pipeline.push(scan);
        self.places.extend(self.pipeline.progress().y_m.map(|y_m| (at, y_m)));
    }
}

/// By how much the last one delivered is behind the last one there was. A device that has begun to count anew is behind by nothing that could be told.
fn behind(last: Option<u16>, delivered: Option<u16>) -> u64 {
    let behind = last.zip(delivered).map(|(last, delivered)| last.wrapping_sub(delivered));
    behind.filter(|behind| *behind < 0x8000).unwrap_or_default().into()
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
    /// What goes wrong.
    faults: Option<FaultDesk>,
}

/// One connection to a device, or all its datagrams.
#[derive(Debug)]
struct Connection {
    witness: Witness,
    device: String,
    number: u64,
    ear: Mutex<Ear>,
}

/// What listens to one connection.
#[derive(Debug)]
struct Ear {
    reader: ScanReader,
    /// Broken frames so far.
    bad_frames: u64,
}

impl Witness {
    pub(crate) fn new(journal: Journal) -> Self {
        Self { journal, seen: Arc::default() }
    }

    #[cfg(test)]
    pub(crate) fn journal(&self) -> Journal {
        self.journal.clone()
    }

    /// Watches the device `id` as well, whose scans go into `pipeline`.
    pub(crate) fn watch(&self, id: &str, pipeline: Pipeline) {
        self.lock().streams.insert(id.to_owned(), Stream::new(pipeline));
    }

    /// Hears what `counter` says of the device `id`.
    pub(crate) fn hear(&self, id: &str, counter: CountReader) {
        if let Some(stream) = self.lock().streams.get_mut(id) {
            stream.device = Some(counter);
        }
    }

    /// Tells `faults` of good scans, and has it note what it did before anything is counted.
    pub(crate) fn beside(&self, faults: FaultDesk) {
        self.lock().faults = Some(faults);
    }

    /// True if somebody takes scans of every device.
    pub(crate) fn is_taken(&self) -> bool {
        self.untaken().is_empty()
    }

    /// The devices whose scans nobody takes.
    pub(crate) fn untaken(&self) -> Vec<String> {
        let seen = self.lock();
        let of = |stream: &Stream| stream.device.as_ref().and_then(CountReader::is_taken) != Some(true);
        seen.streams.iter().filter(|(_, stream)| of(stream)).map(|(id, _)| id.clone()).collect()
    }

    /// Scans delivered so far, of the device that has delivered most.
    pub(crate) fn scans(&self) -> u64 {
        self.lock().streams.values().map(|stream| stream.counts().scans).max().unwrap_or(0)
    }

    /// Taps for the byte paths. The one place where delivered bytes come in: behind the faults.
    pub(crate) fn taps(&self) -> Taps {
        let witness = self.clone();
        Taps::new(move |device, kind| witness.connected(device, kind))
    }

    /// The run is over, its end reached or not; what was seen. The journal's last event is the end.
    pub(crate) fn close(&self, reached: bool) -> BTreeMap<String, Stream> {
        self.end_datagrams();
        let mut seen = self.lock();
        seen.over = true;
        let mut streams = std::mem::take(&mut seen.streams);
        let began = self.journal.began();
        for stream in streams.values_mut() {
            stream.drive(began);
            stream.end(reached);
            stream.note_change(self.journal.now(), self.journal.len().saturating_sub(1));
            stream.estimate = Some(stream.pipeline.finish());
            stream.passed = stream
                .places
                .iter()
                .map(|(at, y_m)| Passed { y_m: *y_m, way_m: self.journal.way_m(*at) })
                .collect();
        }
        streams
    }

    fn lock(&self) -> MutexGuard<'_, Seen> {
        self.seen.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn connected(&self, device: &str, kind: StreamKind) -> Tap {
        let Some(reader) = ScanReader::new(kind, MAX_PAYLOAD) else { return Tap::default() };
        if kind == StreamKind::Compact {
            return self.datagrams(device.strip_suffix(DATAGRAMS).unwrap_or(device), reader);
        }
        self.note_faults();
        let number = {
            let mut seen = self.lock();
            let Some(stream) = seen.streams.get_mut(device) else { return Tap::default() };
            stream.connections += 1;
            stream.note_change(self.journal.now(), self.journal.len());
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

    /// Listens to a device's datagrams: they are no connection, and nobody says when they begin.
    fn datagrams(&self, device: &str, reader: ScanReader) -> Tap {
        let mut seen = self.lock();
        let Some(stream) = seen.streams.get_mut(device) else { return Tap::default() };
        let ear = Mutex::new(Ear { reader, bad_frames: 0 });
        let datagrams = Arc::new(Connection {
            witness: self.clone(),
            device: device.to_owned(),
            number: BY_DATAGRAMS,
            ear,
        });
        stream.datagrams = Some(Arc::clone(&datagrams));
        stream.segments_lost = Some(0);
        Tap::new(move |from, bytes| datagrams.delivered(from, bytes))
    }

    /// Takes what datagrams have brought and no later one completes.
    fn end_datagrams(&self) {
        let of = |stream: &mut Stream| stream.datagrams.take();
        let all: Vec<_> = self.lock().streams.values_mut().filter_map(of).collect();
        for datagrams in all {
            let mut ear = datagrams.ear();
            ear.reader.finish();
            datagrams.take(&mut ear, self.journal.now());
            let unfinished = ear.reader.unfinished_turn();
            if let Some(stream) = self.lock().streams.get_mut(&datagrams.device) {
                stream.unfinished_turn = unfinished;
            }
        }
    }

    fn note_faults(&self) -> Option<FaultDesk> {
        let faults = self.lock().faults.clone();
        faults.inspect(FaultDesk::note)
    }
}

impl Connection {
    fn delivered(&self, from: Side, bytes: &[u8]) {
        let at = self.witness.journal.now();
        // Nothing of a datagram goes on in the next one.
        let joint = if self.number == BY_DATAGRAMS { Joint::Anew } else { Joint::Seamless };
        let packet =
            Packet { from: Some(from), at_ns: Some(at.0), bytes: bytes.to_vec(), joint, ..Packet::default() };
        let mut ear = self.ear();
        // The echo is the device's, whichever connection it was set on.
        let known = self.witness.lock().streams.get(&self.device).map(|stream| stream.echo);
        if let (Some(heard), Some(known)) = (ear.reader.heard_settings(), known) {
            heard.set_in_force(known);
        }
        ear.reader.push(Duration::from_nanos(at.0), &packet);
        if from == Side::Host {
            return;
        }
        self.take(&mut ear, at);
        let known = ear.reader.heard_settings().map(|heard| heard.in_force());
        if let (Some(known), Some(stream)) = (known, self.witness.lock().streams.get_mut(&self.device)) {
            stream.echo = known;
        }
    }

    fn take(&self, ear: &mut Ear, at: SimTime) {
        let faults = self.witness.note_faults();
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
        let mut good = false;
        while let Some(event) = ear.reader.next_event() {
            match event {
                HostEvent::Scan if stream.takes(self.number, ear.reader.scan().telegram_counter) => {
                    if stream.scan_times.is_empty() {
                        journal.note(format!("{}.first_scan", self.device), "");
                    }
                    stream.scan(at, ear.reader.scan(), journal.began());
                    good = true;
                }
                HostEvent::Malformed { fault } => {
                    stream.pipeline.push_unreadable(&fault);
                    bad(stream, fault.to_string());
                }
                _ => {}
            }
        }
        stream.segments_lost = stream.segments_lost.map(|_| ear.reader.segments().lost);
        let broken = ear.reader.counts().damaged();
        for _ in ear.bad_frames..broken {
            bad(stream, "a broken frame, or bytes that begin none".to_owned());
        }
        ear.bad_frames = broken;
        stream.note_change(at, journal.len());
        if let Some(faults) = faults.filter(|_| good) {
            faults.good_scan(&self.device, at);
        }
    }

    fn ear(&self) -> MutexGuard<'_, Ear> {
        self.ear.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Connection {
    fn drop(&mut self) {
        if self.number == BY_DATAGRAMS {
            return;
        }
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
            && stream.taker.is_some_and(|(taker, _)| taker == self.number)
        {
            stream.taker = None;
        }
        self.witness
            .journal
            .note(format!("{}.disconnected", self.device), format!("connection {}", self.number));
    }
}

#[cfg(test)]
pub(crate) mod tests;
