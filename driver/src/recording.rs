//! A recording as a source: its bytes go through the client session as a live link's do.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::path::{Path, PathBuf};
use std::task::{Context, Poll};
use std::time::Duration;

use rowscan_protocol::compact::SegmentCounts;
use rowscan_protocol::host::{HostEvent, OtherSender};
use rowscan_protocol::model::AnyModel;
use rowscan_protocol::scan::Scan;
use rowscan_recording::{DeviceSettings, Packet, ScanReader, Side, StreamInfo, StreamKind, Tap, device_of};

use crate::before_drive::BeforeDrive;
use crate::clock::HostTime;
use crate::error::DriverError;
use crate::feed::Feed;
use crate::later::Later;
use crate::left_out::StreamsLeftOut;
use crate::recorded_model::{models_of, seen_ahead};

/// So many scans can two conversations have in common, where a client that read at the same time reads on: what came between the last packets of both.
const MOST_TWICE: usize = 32;
/// A scan is sent to all clients within this, and a scanner that counts anew was off for longer.
const TWICE_NS: u64 = 100_000_000;

/// A recording being read: one stream of it.
#[derive(Debug)]
pub(crate) struct Recording {
    path: PathBuf,
    recording: rowscan_recording::Recording,
    /// The stream asked for by name.
    wanted: Option<String>,
    /// Where none was asked for: the first by name of those that hold scans, as far as that can be seen ahead.
    preferred: Option<String>,
    /// The stream that is read: the one asked for, the preferred one, or the first with a scan.
    chosen: Option<usize>,
    /// A listening session a stream, until one is chosen.
    clients: BTreeMap<usize, ScanReader>,
    /// What conversations with the scanner tell of its settings, in whichever streams they stand.
    settings: DeviceSettings,
    /// The stream of the last packet that went to a session, until it is known what was heard in it.
    taken: Option<usize>,
    /// Streams of scanners that are not read.
    left_out: BTreeSet<String>,
    /// What is said in other conversations with the scanner that is read since that was heard last.
    later: Later,
    /// Packets to be taken before the next one of the file.
    due: VecDeque<Packet>,
    /// The first stream that was read.
    first: Option<String>,
    /// Bad frames of conversations that were read before.
    bad_before: u64,
    /// Numbers and times of the scans that were read last, by the scanner's clock and the log's.
    latest: VecDeque<(u16, u32, u64)>,
    /// Those of the conversation before.
    read_before: VecDeque<(u16, u32, u64)>,
    /// The stream that bytes came from last.
    current: usize,
    /// The log time of the packet read last, if it has one.
    at_ns: Option<u64>,
    before_drive: BeforeDrive,
    max_payload: usize,
    bytes: u64,
    ended: bool,
    received: HostTime,
    tap: Tap,
}

impl Recording {
    /// Opens `path`; the session only listens. What is read passes `tap`.
    pub(crate) fn open(
        path: &Path,
        stream: Option<&str>,
        max_payload: usize,
        tap: Tap,
    ) -> Result<Self, DriverError> {
        let recording = rowscan_recording::Recording::open_apart(path, stream.as_slice())
            .map_err(|cause| DriverError::Recording { path: path.to_owned(), cause })?;
        let with_scans = if stream.is_none() { seen_ahead(path, &recording) } else { BTreeSet::new() };
        let preferred = with_scans.first().cloned();
        let before_drive = BeforeDrive::of(path, recording.format());
        Ok(Self {
            path: path.to_owned(),
            recording,
            left_out: with_scans.into_iter().skip(1).collect(),
            preferred,
            wanted: stream.map(str::to_owned),
            chosen: None,
            clients: BTreeMap::new(),
            settings: DeviceSettings::default(),
            taken: None,
            later: Later::default(),
            due: VecDeque::new(),
            first: None,
            bad_before: 0,
            latest: VecDeque::new(),
            read_before: VecDeque::new(),
            current: 0,
            at_ns: None,
            before_drive,
            max_payload,
            bytes: 0,
            ended: false,
            received: HostTime::default(),
            tap,
        })
    }

    /// The session of the stream that is read.
    fn client(&self) -> Option<&ScanReader> {
        self.clients.get(&self.chosen.unwrap_or(self.current))
    }

    /// The next event of the session, or `None` at the end of the file.
    fn next_event(&mut self) -> Result<Option<HostEvent>, DriverError> {
        loop {
            if let Some(event) = self.clients.get_mut(&self.current).and_then(ScanReader::next_event) {
                if event == HostEvent::Scan && self.chosen.is_none() {
                    let chosen = self.current;
                    self.chosen = Some(chosen);
                    self.first = self.recording.streams().get(chosen).map(|stream| stream.name.clone());
                    self.clients.retain(|stream, _| *stream == chosen);
                }
                if event == HostEvent::Scan && (self.before_drive.leaves_out(self.at_ns) || self.was_read()) {
                    continue;
                }
                return Ok(Some(event));
            }
            let due = self.due.pop_front();
            if let Some(due) = &due
                && self.chosen.is_some_and(|chosen| chosen != due.stream)
            {
                self.go_on_with(due.stream);
            }
            let fail = |cause| DriverError::Recording { path: self.path.clone(), cause };
            let packet = match due {
                None => self.recording.next_packet().map_err(fail)?,
                due => due,
            };
            match packet {
                Some(packet) => self.take(packet),
                None if !self.ended => {
                    self.learn_of_taken();
                    self.due = self.later.take_rest();
                    if !self.due.is_empty() {
                        continue;
                    }
                    self.ended = true;
                    self.current = self.chosen.unwrap_or(self.current);
                    self.warn_of_missing();
                    self.clients.values_mut().for_each(ScanReader::finish);
                }
                None => return self.at_end(),
            }
        }
    }

    /// Learns what the packet before told of the scanner, all of whose events have been taken by now.
    fn learn_of_taken(&mut self) {
        let streams = self.recording.streams();
        if let Some(taken) = self.taken.take()
            && let Some(heard) = self.clients.get_mut(&taken).and_then(ScanReader::heard_settings)
            && let Some(taken) = streams.get(taken)
        {
            self.settings.learn(streams, &taken.name, heard);
        }
    }

    fn take(&mut self, packet: Packet) {
        self.learn_of_taken();
        let streams = self.recording.streams();
        let Some(stream) = streams.get(packet.stream) else { return };
        if let Some(chosen) = self.chosen.filter(|_| self.wanted.is_none()) {
            let is_of_its_scanner = |name: &str| {
                let read = streams.get(chosen).map_or("", |chosen| chosen.name.as_str());
                stream.kind == StreamKind::Cola && device_of(streams, read) == device_of(streams, name)
            };
            if packet.stream == chosen {
                self.later.forget();
            } else if is_of_its_scanner(&stream.name) && self.later.hear(&packet) {
                self.due = self.later.take(packet.stream);
                return;
            }
        }
        let wanted = match (self.chosen, &self.wanted) {
            (Some(chosen), _) => chosen == packet.stream,
            (None, Some(name)) => *name == stream.name,
            (None, None) => self.preferred.as_ref().is_none_or(|name| *name == stream.name),
        };
        let may_hold_scans = packet.from != Some(Side::Host) && ScanReader::new(stream.kind, 0).is_some();
        if !wanted && self.wanted.is_none() && may_hold_scans && !self.left_out.contains(&stream.name) {
            self.left_out.insert(stream.name.clone());
        }
        let read = self.chosen.and_then(|chosen| streams.get(chosen)).map(|chosen| &chosen.name);
        let read = read.or(self.wanted.as_ref()).or(self.preferred.as_ref());
        if !wanted && read.is_some_and(|read| device_of(streams, read) == device_of(streams, &stream.name)) {
            self.settings.overhear(streams, &packet);
        }
        let known = self.clients.contains_key(&packet.stream);
        let reader = if known { None } else { ScanReader::new(stream.kind, self.max_payload) };
        if !wanted || !known && reader.is_none() {
            return;
        }
        self.bytes += packet.bytes.len() as u64;
        self.tap.record(packet.from.unwrap_or(Side::Device), &packet.bytes);
        self.clients.extend(reader.map(|reader| (packet.stream, reader)));
        if let Some(heard) = self.clients.get_mut(&packet.stream).and_then(ScanReader::heard_settings) {
            self.settings.tell(streams, &stream.name, heard);
        }
        self.taken = Some(packet.stream);
        if packet.from == Some(Side::Host) {
            // It was set to something, perhaps.
            if let Some(client) = self.clients.get_mut(&packet.stream) {
                client.push(self.received.0, &packet);
            }
            return;
        }
        self.at_ns = self.recording.host_ns(&packet);
        if let (Some(at_ns), Some(began_ns)) = (packet.at_ns, self.recording.began_ns()) {
            self.received = HostTime(Duration::from_nanos(at_ns.saturating_sub(began_ns)));
        }
        self.current = packet.stream;
        if let Some(client) = self.clients.get_mut(&packet.stream) {
            client.push(self.received.0, &packet);
        }
    }

    /// Whether the conversation before had this scan already: clients that come again may do so before they leave.
    fn was_read(&mut self) -> bool {
        let at_ns = self.at_ns.unwrap_or_default();
        let stamps = |scan: &Scan| (scan.telegram_counter, scan.scan_time_us, at_ns);
        let Some(found) = self.client().map(|client| stamps(client.scan())) else { return false };
        let is_same = |before: &(u16, u32, u64)| {
            (before.0, before.1) == (found.0, found.1) && at_ns.saturating_sub(before.2) < TWICE_NS
        };
        if self.read_before.iter().any(is_same) {
            return true;
        }
        if self.latest.len() >= MOST_TWICE {
            self.latest.pop_front();
        }
        self.latest.push_back(found);
        false
    }

    /// Whoever read the scanner has left, and somebody else reads on: the scans of that conversation follow on those of the one before.
    fn go_on_with(&mut self, stream: usize) {
        self.bad_before += self.client().map_or(0, |client| client.counts().bad);
        self.clients.clear();
        self.taken = None;
        self.chosen = Some(stream);
        self.read_before = std::mem::take(&mut self.latest);
        if let Some(read) = self.recording.streams().get(stream) {
            self.left_out.remove(&read.name);
        }
    }

    fn at_end(&self) -> Result<Option<HostEvent>, DriverError> {
        let streams = self.recording.streams();
        if let Some(wanted) =
            self.wanted.as_ref().filter(|name| streams.iter().all(|stream| stream.name != **name))
        {
            let names = |stream: &StreamInfo| [&[stream.name.clone()][..], &stream.connections].concat();
            let mut found: Vec<String> = streams.iter().flat_map(names).collect();
            // Which stream came first into the file is the host's doing.
            found.sort();
            return Err(DriverError::NoStream { path: self.path.clone(), wanted: wanted.clone(), found });
        }
        let is_silent = self.clients.values().all(|client| client.counts().frames == 0);
        if is_silent || self.recording.soundness().sound == 0 {
            let format = self.recording.format();
            let kind = self.recording.main_kind();
            return Err(DriverError::NotARecording {
                path: self.path.clone(),
                format,
                kind,
                bytes: self.bytes,
            });
        }
        let torn = self.recording.torn();
        if self.chosen.is_none() {
            // Read once more: nobody counts names while scans come.
            let format = self.recording.format();
            let holds = rowscan_recording::Recording::open(&self.path).and_then(rowscan_recording::contents);
            let holds = holds.ok().flatten().unwrap_or_else(|| "no telegram".to_owned());
            let torn = torn.cloned().map(Box::new);
            return Err(DriverError::NoScan { path: self.path.clone(), format, holds, torn });
        }
        Ok(None)
    }

    /// Tells once what the scans do not come from: telegrams that cannot be read, the part behind a cut, and streams that were not asked for.
    fn warn_of_missing(&self) {
        let path = self.path.display();
        if let Some(torn) = self.recording.torn() {
            tracing::warn!("{path}: {torn}; {} is read", torn.read_part());
        }
        if let Some(step) = self.recording.clock_back() {
            tracing::warn!("{path}: {step}");
        }
        if let Some(missing) = self.recording.missing_bytes() {
            tracing::warn!("{path}: {missing}");
        }
        let soundness = self.recording.soundness();
        if let Some(damage) = soundness.damage().filter(|_| soundness.sound > 0) {
            tracing::warn!("{path}: {damage}");
        }
        if let Some(told) = self.before_drive.told() {
            tracing::warn!("{path}: {told}");
        }
        if let Some(StreamsLeftOut { read, left_out }) = self.streams_left_out() {
            tracing::warn!(
                "{path}: scans of `{read}` only; left out: {}; name one with `{path}#STREAM`",
                left_out.join(", ")
            );
        }
    }
}

impl Feed for Recording {
    fn poll_event(&mut self, _: &mut Context<'_>) -> Poll<Result<Option<HostEvent>, DriverError>> {
        Poll::Ready(self.next_event())
    }

    fn begin_stop(&mut self, _: Duration) {}

    fn poll_stopped(&mut self, _: &mut Context<'_>) -> Poll<()> {
        Poll::Ready(())
    }

    fn scan(&self) -> Option<&Scan> {
        self.client().map(ScanReader::scan)
    }

    /// When the last packet came, since the recording's beginning.
    fn received(&self) -> HostTime {
        self.received
    }

    fn is_timed(&self) -> bool {
        self.at_ns.is_some()
    }

    fn now(&self) -> HostTime {
        HostTime::default()
    }

    fn connections(&self) -> u64 {
        0
    }

    fn segments(&self) -> SegmentCounts {
        self.client().map_or_else(SegmentCounts::default, ScanReader::segments)
    }

    fn telegrams_foreign(&self) -> u64 {
        self.client().map_or(0, |client| OtherSender::telegrams_of(client.other_senders()))
    }

    fn frames_bad(&self) -> u64 {
        self.bad_before + self.client().map_or(0, |client| client.counts().bad)
    }

    fn recorded_models(&self) -> Vec<AnyModel> {
        let chosen = self.chosen.and_then(|chosen| self.recording.streams().get(chosen));
        let asked = self.wanted.as_deref().or(self.preferred.as_deref());
        let stream = chosen.map(|stream| stream.name.as_str()).or(asked);
        let named = models_of(self.recording.about(), stream);
        if !named.is_empty() {
            return named;
        }
        // A file that names none may hold the scanner's own word.
        let ident = stream.and_then(|stream| self.settings.ident_of(self.recording.streams(), stream));
        ident.map_or_else(Vec::new, |ident| AnyModel::of_device(&ident.name.0, &ident.version.0))
    }

    fn recorded_kind(&self) -> Option<StreamKind> {
        self.recording.streams().get(self.chosen?).map(|stream| stream.kind)
    }

    fn streams_left_out(&self) -> Option<StreamsLeftOut> {
        let read = self.first.clone()?;
        let left_out: Vec<String> = self.left_out.iter().cloned().collect();
        (!left_out.is_empty()).then_some(StreamsLeftOut { read, left_out })
    }

    fn broken_off(&self) -> Option<String> {
        self.recording.torn().filter(|_| self.ended).map(ToString::to_string)
    }

    fn lacks_bytes(&self) -> bool {
        self.recording.missing_bytes().is_some()
    }
}
