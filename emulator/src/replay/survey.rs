//! A recording read once from end to end: which streams it has, who the scanners are, where the scans stand in time.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use rowscan_protocol::angle::BeamGrid;
use rowscan_protocol::device::DeviceEvent as Event;
use rowscan_protocol::heard_settings::HeardSettings;
use rowscan_protocol::leftover_set::LeftoverSet;
use rowscan_protocol::lms2xx::settings_reply::has_values;
use rowscan_protocol::model::{AnyModel, MODELS, Model};
use rowscan_protocol::telegram::device_ident::DeviceIdent;
use rowscan_protocol::telegram::set_access_mode::SetAccessMode;
use rowscan_protocol::telegram::{Kind, LmdScandata, Method, Telegram, Variable};
use rowscan_recording::{
    About, DeviceSettings, RecordedFrame, Side, Soundness, StreamInfo, StreamKind, Torn,
};

use super::compact::TurnMoments;
use super::echo::{SettingsTrace, ToldEcho};
use super::moment::{Moment, Moments};
use super::timed_frames::TimedFrames;
use super::traces::Traces;
use super::{CompactPart, Lms2xxPart, ReplayError, Script, unreadable};

/// What is known of a recording before it is played.
#[derive(Debug)]
pub struct Survey {
    /// The file.
    pub path: PathBuf,
    /// What the file says of itself.
    pub about: About,
    /// Its streams, in the file's order.
    pub parts: Vec<Part>,
    /// What of the file cannot be read.
    pub torn: Option<Torn>,
    /// How much of it can be read.
    pub soundness: Soundness,
}

/// One stream.
#[derive(Debug)]
pub struct Part {
    /// Its number in the file.
    pub stream: usize,
    /// Its name.
    pub name: String,
    /// What its bytes are.
    pub kind: StreamKind,
    /// Names of its connections, where it is several.
    pub connections: Vec<String>,
    /// What was asked and answered.
    pub script: Arc<Script>,
    /// DeviceIdent, if it was asked for.
    pub ident: Option<String>,
    /// The first scan.
    pub first_scan: Option<LmdScandata>,
    /// Scans.
    pub scans: u64,
    /// Those of them that are the monitor's (LMDscandatamon): who asks for LMDscandata gets none of these.
    pub monitor_scans: u64,
    /// When what the device sends by itself begins: with the reply to the subscription, or the first event.
    pub begins_ns: Option<u64>,
    /// Time of the first scan.
    pub first_scan_ns: Option<u64>,
    /// Time of the last event.
    pub ends_ns: u64,
    /// Its scans are replies to polls: it sent none by itself.
    pub polled: bool,
    /// Scans a second that it is played at, where its own clock stands still.
    pub assumed_hz: Option<f64>,
    /// What is known of a scanner that speaks no CoLa.
    pub lms2xx: Lms2xxPart,
    /// What is known of a scanner that sends datagrams.
    pub compact: CompactPart,
    last_scan_ns: Option<u64>,
    subscribed_ns: Option<u64>,
    /// Passwords the host logged in with.
    pub(super) passwords: Vec<u32>,
    traces: Traces,
    polls: Option<Polls>,
    /// What is heard of the scanner's settings.
    heard: HeardSettings,
    /// The settings at the scans that it sent by itself, and at those that were polled.
    scans_of: [SettingsTrace; 2],
}

/// Streams that are played at an assumed rate.
pub(super) fn still_streams<'a>(parts: impl IntoIterator<Item = &'a Part>) -> Vec<usize> {
    let still = parts.into_iter().filter(|part| part.assumed_hz.is_some());
    still.map(|part| part.stream).collect()
}

/// Scans that were polled.
#[derive(Debug)]
struct Polls {
    first_ns: u64,
    last_ns: u64,
    scans: u64,
    /// The first one.
    scan: LmdScandata,
}

/// The scan that the device sent: by itself, or where it sent none by itself, as the reply to a poll.
pub(super) fn is_scan(telegram: &Telegram<'_>, polled: bool) -> bool {
    match telegram.kind {
        Kind::Sn => matches!(Event::by_name(telegram.name), Some(Event::ScanData | Event::Monitor)),
        Kind::Ra => polled && polled_scan(telegram).is_some(),
        _ => false,
    }
}

/// The scan in the reply to a poll; none before the first one was made.
pub(super) fn polled_scan(telegram: &Telegram<'_>) -> Option<LmdScandata> {
    let is_reply = telegram.kind == Kind::Ra && telegram.name == LmdScandata::NAME;
    let scan = is_reply.then(|| telegram.args.decode::<LmdScandata>().ok()).flatten();
    scan.filter(|scan| !scan.channels16.is_empty())
}

impl Survey {
    /// Reads a recording to its end.
    pub fn read(path: &Path) -> Result<Self, ReplayError> {
        Self::read_apart(path, &[])
    }

    /// The same; of a capture, connections of these names are streams of their own ([`Recording::open_apart`](rowscan_recording::Recording::open_apart)).
    pub fn read_apart(path: &Path, connections: &[&str]) -> Result<Self, ReplayError> {
        let survey = Self::read_once(path, connections, &[])?;
        let still: Vec<usize> =
            survey.parts.iter().filter(|part| part.stands_still()).map(|part| part.stream).collect();
        // Times that tell nothing are found out at the end.
        if still.is_empty() { Ok(survey) } else { Self::read_once(path, connections, &still) }
    }

    fn read_once(path: &Path, connections: &[&str], still: &[usize]) -> Result<Self, ReplayError> {
        let fail = unreadable(path);
        let mut frames = TimedFrames::open(path, connections, still).map_err(&fail)?;
        let mut parts: Vec<Part> = Vec::new();
        let mut echoes = DeviceSettings::default();
        while let Some(frame) = frames.next_frame().map_err(&fail)? {
            for (stream, info) in frames.recording().streams().iter().enumerate().skip(parts.len()) {
                parts.push(Part::new(stream, info));
            }
            let Some(part) = parts.get_mut(frame.stream) else { continue };
            let streams = frames.recording().streams();
            echoes.tell(streams, &part.name, &mut part.heard);
            let telegram = frame.telegram();
            if let Some(telegram) = telegram.as_ref().filter(|_| frame.from == Side::Device) {
                part.traces.take(telegram);
            }
            match telegram {
                Some(telegram) if frame.from == Side::Device && telegram.kind == Kind::Sn => {
                    part.event(frame.at_ns, &telegram);
                }
                Some(telegram) => {
                    part.heard.take(&telegram);
                    if frame.from == Side::Device {
                        part.reply(frame.at_ns, &telegram);
                    }
                    let subscribes = is_subscription(&telegram) && frame.from == Side::Device;
                    if subscribes && part.first_scan_ns.is_none() {
                        part.subscribed_ns = Some(frame.at_ns);
                    }
                    if telegram.kind == Kind::Mn && telegram.name == SetAccessMode::NAME {
                        let login = telegram.args.decode::<SetAccessMode>();
                        part.passwords.extend(login.map(|login| login.password.0));
                    }
                    if telegram.kind == Kind::Ra && telegram.name == DeviceIdent::NAME && part.ident.is_none()
                    {
                        part.ident = telegram.args.decode::<DeviceIdent>().ok().map(
                            |DeviceIdent { name, version }| format!("{} {}", name.trim(), version.trim()),
                        );
                    }
                    // Nobody shares it yet.
                    if let Some(script) = Arc::get_mut(&mut part.script) {
                        script.take(&frame, part.scans == 0);
                    }
                }
                None if part.kind == StreamKind::Lms2xx => part.serial_telegram(&frame),
                None if part.kind == StreamKind::Compact && frame.from == Side::Device => {
                    part.datagram(&frame)
                }
                // A line without telegrams plays from its first byte.
                None if !part.is_scanner() && frame.from == Side::Device => {
                    part.begins_ns.get_or_insert(frame.at_ns);
                    part.ends_ns = part.ends_ns.max(frame.at_ns);
                }
                None => {}
            }
            echoes.learn(frames.recording().streams(), &part.name, &part.heard);
        }
        let recording = frames.recording();
        for (stream, info) in recording.streams().iter().enumerate().skip(parts.len()) {
            parts.push(Part::new(stream, info));
        }
        for part in &mut parts {
            part.assumed_hz = frames.hertz(part.stream);
            part.take_polls();
            part.scans += part.compact.finish().len() as u64;
        }
        let torn = recording.torn().cloned();
        let (about, soundness) = (recording.about().clone(), recording.soundness());
        Ok(Self { path: path.to_owned(), about, parts, torn, soundness })
    }

    /// Where a part's scan number `number`, from 0, begins; none if it has fewer.
    pub fn scan_at(&self, part: &Part, number: u64) -> Result<Option<Moment>, ReplayError> {
        let fail = unreadable(&self.path);
        let names: Vec<&str> = self.parts.iter().map(|part| part.name.as_str()).collect();
        let mut frames = TimedFrames::open(&self.path, &names, &still_streams(&self.parts)).map_err(&fail)?;
        let (mut scans, mut turns, mut moments) = (0, TurnMoments::default(), Moments::default());
        while let Some(frame) = frames.next_frame().map_err(&fail)? {
            let moment = moments.next(frame.at_ns);
            if frame.stream != part.stream || frame.from != Side::Device {
                continue;
            }
            let is_scan = match frame.kind {
                StreamKind::Lms2xx => has_values(frame.payload()),
                StreamKind::Compact => {
                    for begins in turns.take(frame.payload(), moment) {
                        if scans == number {
                            return Ok(Some(begins));
                        }
                        scans += 1;
                    }
                    continue;
                }
                _ => frame.telegram().is_some_and(|telegram| is_scan(&telegram, part.polled)),
            };
            if is_scan && scans == number {
                return Ok(Some(moment));
            }
            scans += u64::from(is_scan);
        }
        Ok(turns.finish().nth((number - scans) as usize))
    }

    /// The parts called so; without names, the first `count` with scans, or with anything a scanner sends by itself.
    pub fn choose(&self, names: &[String], count: usize) -> Result<Vec<&Part>, ReplayError> {
        if names.is_empty() {
            let chosen: Vec<&Part> = self.scanners().into_iter().take(count).collect();
            return if chosen.is_empty() { Err(self.nothing()) } else { Ok(chosen) };
        }
        let by_name = |name: &String| {
            let part = self.parts.iter().find(|part| part.name == *name).ok_or_else(|| {
                ReplayError::NoStream { path: self.path.clone(), wanted: name.clone(), found: self.found() }
            })?;
            if part.begins_ns.is_some() { Ok(part) } else { Err(self.nothing()) }
        };
        names.iter().map(by_name).collect()
    }

    /// The scanners with scans; where there are none, those with other events.
    pub fn scanners(&self) -> Vec<&Part> {
        let scanners = |with_scans: bool| {
            let plays = move |part: &&Part| {
                part.is_scanner() && part.begins_ns.is_some() && (part.scans > 0 || !with_scans)
            };
            self.parts.iter().filter(plays).collect::<Vec<_>>()
        };
        Some(scanners(true)).filter(|chosen| !chosen.is_empty()).unwrap_or_else(|| scanners(false))
    }

    /// There is nothing to play.
    pub fn nothing(&self) -> ReplayError {
        ReplayError::Nothing { path: self.path.clone(), found: self.found() }
    }

    fn found(&self) -> String {
        let told = |part: &Part| match part.is_scanner() {
            true => format!("{} ({}, {} scans)", part.name, part.kind, part.scans),
            false => format!("{} ({})", part.name, part.kind),
        };
        let told = |part: &Part| match part.connections.as_slice() {
            [] => told(part),
            connections => format!("{}, of the connections {}", told(part), connections.join(", ")),
        };
        let names: Vec<String> = self.parts.iter().map(told).collect();
        if names.is_empty() { "no stream".to_owned() } else { names.join(", ") }
    }
}

/// `sEA LMDscandata 1`, or the monitor's.
fn is_subscription(telegram: &Telegram<'_>) -> bool {
    telegram.kind == Kind::Ea
        && matches!(Event::by_name(telegram.name), Some(Event::ScanData | Event::Monitor))
        && telegram.args.decode::<bool>() == Ok(true)
}

impl Part {
    fn new(stream: usize, info: &StreamInfo) -> Self {
        Self {
            stream,
            name: info.name.clone(),
            kind: info.kind,
            connections: info.connections.clone(),
            script: Arc::default(),
            ident: None,
            first_scan: None,
            scans: 0,
            monitor_scans: 0,
            begins_ns: None,
            first_scan_ns: None,
            ends_ns: 0,
            polled: false,
            assumed_hz: None,
            last_scan_ns: None,
            lms2xx: Lms2xxPart::default(),
            compact: CompactPart::default(),
            subscribed_ns: None,
            passwords: Vec::new(),
            traces: Traces::default(),
            polls: None,
            heard: HeardSettings::default(),
            scans_of: Default::default(),
        }
    }

    fn serial_telegram(&mut self, frame: &RecordedFrame) {
        if frame.from == Side::Device && self.lms2xx.take(frame.payload()) {
            self.begins_ns.get_or_insert(frame.at_ns);
            self.first_scan_ns.get_or_insert(frame.at_ns);
            self.ends_ns = self.ends_ns.max(frame.at_ns);
            self.last_scan_ns = self.last_scan_ns.max(Some(frame.at_ns));
            self.scans += 1;
        }
    }

    /// Takes note of a datagram. A turn counts where it is whole.
    fn datagram(&mut self, frame: &RecordedFrame) {
        self.begins_ns.get_or_insert(frame.at_ns);
        self.ends_ns = self.ends_ns.max(frame.at_ns);
        let turns = self.compact.take(frame.bytes.get(frame.frame_at..).unwrap_or_default());
        self.scans += turns.len() as u64;
        turns.iter().for_each(|_| self.scans_of[0].scan(&self.heard));
        if !turns.is_empty() {
            self.first_scan_ns.get_or_insert(frame.at_ns);
            self.last_scan_ns = self.last_scan_ns.max(Some(frame.at_ns));
        }
    }

    fn event(&mut self, at_ns: u64, telegram: &Telegram<'_>) {
        self.begins_ns.get_or_insert(self.subscribed_ns.map_or(at_ns, |subscribed| subscribed.min(at_ns)));
        self.ends_ns = self.ends_ns.max(at_ns);
        if !is_scan(telegram, false) {
            return;
        }
        self.scans += 1;
        self.monitor_scans += u64::from(Event::by_name(telegram.name) == Some(Event::Monitor));
        self.scans_of[0].scan(&self.heard);
        self.first_scan_ns.get_or_insert(at_ns);
        self.last_scan_ns = self.last_scan_ns.max(Some(at_ns));
        if self.first_scan.is_none() {
            self.first_scan = telegram.args.decode().ok();
        }
    }

    /// Takes note of a scan that was polled.
    fn reply(&mut self, at_ns: u64, telegram: &Telegram<'_>) {
        let Some(scan) = polled_scan(telegram) else { return };
        let polls = self.polls.get_or_insert(Polls { first_ns: at_ns, last_ns: at_ns, scans: 0, scan });
        polls.last_ns = polls.last_ns.max(at_ns);
        polls.scans += 1;
        self.scans_of[1].scan(&self.heard);
    }

    /// What the conversation tells of the echo in the scans.
    pub fn told_echo(&self) -> ToldEcho {
        self.settings_at_scans().told(&self.heard)
    }

    /// Settings that take something from some of the scans and not from others. The device that plays them has these as they were at the first scan.
    pub fn settings_changed(&self) -> LeftoverSet {
        self.settings_at_scans().changed()
    }

    fn settings_at_scans(&self) -> &SettingsTrace {
        let [sent, polled] = &self.scans_of;
        if self.polled { polled } else { sent }
    }

    /// Without a scan that the device sent by itself, the polled ones are what is played. Beside others they would be the same scans again.
    fn take_polls(&mut self) {
        let Some(Polls { first_ns, last_ns, scans, scan }) = self.polls.take().filter(|_| self.scans == 0)
        else {
            return;
        };
        self.polled = true;
        self.scans = scans;
        self.first_scan = Some(scan);
        (self.first_scan_ns, self.last_scan_ns) = (Some(first_ns), Some(last_ns));
        self.begins_ns = self.begins_ns.map_or(Some(first_ns), |begins| Some(begins.min(first_ns)));
        self.ends_ns = self.ends_ns.max(last_ns);
    }

    /// All scans came at one instant: the recording's clock tells nothing of them.
    fn stands_still(&self) -> bool {
        (self.is_scanner() || self.kind == StreamKind::Compact)
            && self.scans > 1
            && self.first_scan_ns == self.last_scan_ns
    }

    /// The models that the device can be by what it says it is, if it was asked; none where no model here is called so.
    pub fn told_models(&self) -> Vec<AnyModel> {
        let serial = self.lms2xx.type_text().map(|text| text.rsplit_once(';').unwrap_or((text, "")));
        let told = serial.or_else(|| Some((self.ident.as_deref()?, "")));
        told.map_or_else(Vec::new, |(ident, firmware)| AnyModel::of_device(ident, firmware))
    }

    /// A scanner's telegrams, and not another instrument's bytes.
    pub fn is_scanner(&self) -> bool {
        matches!(self.kind, StreamKind::Cola | StreamKind::Lms2xx)
    }

    /// All that was sent goes to whoever connects: that is asked for, or its bytes are no telegrams.
    pub fn is_verbatim(&self, asked: bool) -> bool {
        asked || !self.is_scanner()
    }

    /// The mean time between two scans, or between nothing and nothing a second.
    pub fn period_ns(&self) -> u64 {
        let span = self.first_scan_ns.map_or(0, |first| self.ends_ns.saturating_sub(first));
        match self.scans.saturating_sub(1) {
            0 => 1_000_000_000,
            intervals => (span / intervals).max(1),
        }
    }

    /// The first model that the scanner may be, in the order of the table.
    pub fn model_by_scan(&self) -> Option<&'static Model> {
        self.models_by_scan().first().copied()
    }

    /// The models whose beams are those of the scans, whose passwords the host knew, and which can have answered as the scanner did. Where
    /// none can, the answers are left out of it.
    pub(super) fn models_by_scan(&self) -> Vec<&'static Model> {
        let Some(scan) = self.first_scan.as_ref() else { return Vec::new() };
        let knows = |model: &Model, password: &u32| model.logins.iter().any(|login| login.hash == *password);
        let fits = |model: &&'static Model| {
            self.passwords.iter().all(|password| knows(model, password)) && has_beams_of(model, scan)
        };
        let models: Vec<&'static Model> = MODELS.iter().copied().filter(fits).collect();
        let told: Vec<&'static Model> =
            models.iter().copied().filter(|model| self.traces.fit(model)).collect();
        if told.is_empty() { models } else { told }
    }
}

/// Whether a scan of this model has such beams.
fn has_beams_of(model: &Model, scan: &LmdScandata) -> bool {
    let Some(channel) = scan.channels16.first() else { return false };
    model.modes.iter().any(|mode| {
        let turn = model.turn_of(*mode);
        let fits = |angle: i32, expected: i32| angle.abs_diff(expected) <= 10;
        let fits =
            |beams: BeamGrid| beams.len() == channel.values.len() && fits(channel.start_angle, beams.start);
        turn.frequency_centihz.abs_diff(scan.scan_frequency) <= 1
            && turn.step == channel.step
            && model.grids(*mode).any(fits)
    })
}
