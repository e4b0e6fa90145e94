//! A recording while it plays, all chosen streams in one: read as it goes, over and over if it loops.

use std::path::{Path, PathBuf};

use bytes::Bytes;
use rowscan_protocol::device::{DeviceEvent as Event, monitor_event, scan_event};
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::lms2xx::settings_reply::has_values;
use rowscan_protocol::telegram::{Kind, LmdScandata};
use rowscan_protocol::time::SimTime;
use rowscan_recording::{ReadError, RecordedFrame, Side, StreamKind};

use super::moment::{Moment, Moments};
use super::stamps::{Restamp, Stamps};
use super::survey::{polled_scan, still_streams};
use super::timed_frames::TimedFrames;
use super::{Part, ReplayError, unreadable};

/// What is played, and how.
#[derive(Clone, Copy, Debug)]
pub struct Played {
    /// Where to begin.
    pub from: Moment,
    /// Where to end, before what stands there.
    pub until: Moment,
    /// Time from one beginning to the next, if it loops.
    pub every_ns: Option<u64>,
    /// Counters and device times.
    pub stamps: Stamps,
    /// All that the device sent, replies too, to whoever connects; nobody is listened to.
    pub verbatim: bool,
}

/// The chosen streams, frame by frame, in the order they were recorded in.
pub struct Playback {
    path: PathBuf,
    /// Streams of a capture that are single connections have to be asked for.
    names: Vec<String>,
    /// Streams whose clock stands still.
    still: Vec<usize>,
    tracks: Vec<Track>,
    played: Played,
    frames: TimedFrames,
    /// How often it has begun anew.
    rounds: u64,
    /// Frames before this are passed over.
    skip_until: Moment,
    /// Where the last frame stood.
    moments: Moments,
    /// Frames of this round so far.
    found: u64,
}

/// A stream that is played.
#[derive(Debug)]
struct Track {
    stream: usize,
    verbatim: bool,
    /// Its scans are replies to polls.
    polled: bool,
    /// The next scan does not follow the one before it.
    jumped: bool,
    restamp: Restamp,
}

/// Something the device sends by itself.
pub(crate) struct PlaybackEvent {
    /// Of which of the chosen streams, from 0.
    pub(crate) track: usize,
    /// When, in recorded time; loops count on.
    pub(crate) at_ns: u64,
    /// What it is; none if it goes to everyone.
    pub(crate) event: Option<Event>,
    recorded: Bytes,
    dialect: Option<Dialect>,
    /// The scan, if it must be written anew.
    scan: Option<LmdScandata>,
}

impl std::fmt::Debug for Playback {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Playback").field("path", &self.path).field("tracks", &self.tracks).finish()
    }
}

impl Playback {
    /// These parts of the recording at `path`.
    pub fn open(path: PathBuf, parts: &[&Part], played: Played) -> Result<Self, ReplayError> {
        let names: Vec<String> = parts.iter().map(|part| part.name.clone()).collect();
        let still = still_streams(parts.iter().copied());
        let frames = open(&path, &names, &still).map_err(unreadable(&path))?;
        let track = |part: &&Part| Track {
            stream: part.stream,
            verbatim: part.is_verbatim(played.verbatim),
            polled: part.polled,
            jumped: false,
            restamp: Restamp::default(),
        };
        Ok(Self {
            tracks: parts.iter().map(track).collect(),
            skip_until: played.from,
            moments: Moments::default(),
            path,
            names,
            still,
            played,
            frames,
            rounds: 0,
            found: 0,
        })
    }

    /// Goes to a place of the recording.
    pub(crate) fn seek(&mut self, to: Moment) -> Result<(), ReadError> {
        self.rounds = 0;
        self.begin(to)
    }

    fn begin(&mut self, from: Moment) -> Result<(), ReadError> {
        self.frames = open(&self.path, &self.names, &self.still)?;
        (self.skip_until, self.moments) = (from, Moments::default());
        self.tracks.iter_mut().for_each(|track| track.jumped = true);
        self.found = 0;
        Ok(())
    }

    /// The next event; none at the end.
    pub(crate) fn next(&mut self) -> Result<Option<PlaybackEvent>, ReadError> {
        loop {
            let frame = self.frames.next_frame()?;
            let found = frame.map(|frame| (self.moments.next(frame.at_ns), frame));
            let Some((moment, frame)) = found.filter(|(moment, _)| *moment < self.played.until) else {
                // A loop with nothing in it would never end.
                if self.played.every_ns.is_none() || self.found == 0 {
                    return Ok(None);
                }
                self.rounds += 1;
                self.begin(self.played.from)?;
                continue;
            };
            let track = self.tracks.iter().position(|track| track.stream == frame.stream);
            if let Some(track) = track
                && frame.from == Side::Device
                && moment >= self.skip_until
                && let Some(event) = self.event(track, frame)
            {
                self.found += 1;
                return Ok(Some(event));
            }
        }
    }

    fn event(&self, track: usize, frame: RecordedFrame) -> Option<PlaybackEvent> {
        let at_ns = frame.at_ns + self.rounds * self.played.every_ns.unwrap_or_default();
        let (mut event, mut scan) = (None, None);
        let Track { verbatim, polled, .. } = *self.tracks.get(track)?;
        let kind = frame.kind;
        if kind == StreamKind::Lms2xx && !verbatim {
            // What else it said the device says by itself.
            let recorded = has_values(frame.payload()).then(|| frame.bytes.get(frame.frame_at..))??;
            let recorded = Bytes::copy_from_slice(recorded);
            return Some(PlaybackEvent { track, at_ns, event, dialect: None, scan, recorded });
        }
        if !verbatim
            && polled
            && let Some(polled) = frame.telegram().as_ref().and_then(polled_scan)
        {
            let (dialect, event) = (frame.dialect?, Some(Event::ScanData));
            let recorded = encode(event, dialect, &polled).into();
            let dialect = Some(dialect);
            return Some(PlaybackEvent { track, at_ns, event, dialect, scan: Some(polled), recorded });
        }
        if !verbatim {
            let telegram = frame.telegram().filter(|telegram| telegram.kind == Kind::Sn)?;
            event = Some(Event::by_name(telegram.name)?);
            let is_scan = matches!(event, Some(Event::ScanData | Event::Monitor));
            if is_scan && self.played.stamps == Stamps::Now {
                scan = telegram.args.decode::<LmdScandata>().ok();
            }
        }
        let recorded = match kind {
            // A datagram goes alone: what was damaged before it is none.
            StreamKind::Compact => Bytes::copy_from_slice(frame.bytes.get(frame.frame_at..)?),
            _ => frame.bytes.into(),
        };
        Some(PlaybackEvent { track, at_ns, event, dialect: frame.dialect, scan, recorded })
    }

    /// Stamps an event that is sent at `at`, if that is wanted.
    pub(crate) fn stamp(&mut self, event: &mut PlaybackEvent, at: SimTime) {
        let track = self.tracks.get_mut(event.track);
        if let (Some(track), Some(scan), Some(dialect)) = (track, &mut event.scan, event.dialect) {
            track.restamp.stamp(scan, at, std::mem::take(&mut track.jumped));
            event.recorded = encode(event.event, dialect, scan).into();
        }
    }
}

impl PlaybackEvent {
    /// Its bytes as they were recorded, or stamped anew.
    pub(crate) fn bytes(&self) -> Bytes {
        self.recorded.clone()
    }

    /// Its bytes in a dialect; as recorded where that is the recorded one. Events other than scans have no other form.
    pub(crate) fn in_dialect(&self, wanted: Dialect) -> Option<Bytes> {
        let dialect = self.dialect.filter(|_| self.event.is_some());
        if dialect.is_none_or(|dialect| dialect == wanted) {
            return Some(self.recorded.clone());
        }
        Some(encode(self.event, wanted, &self.scan()?).into())
    }

    /// The same event with another scan.
    pub(crate) fn with_scan(&self, dialect: Dialect, scan: &LmdScandata) -> Bytes {
        encode(self.event, dialect, scan).into()
    }

    /// The scan it tells, if it is one.
    pub(crate) fn scan(&self) -> Option<LmdScandata> {
        self.scan.clone().or_else(|| self.decoded())
    }

    fn decoded(&self) -> Option<LmdScandata> {
        use rowscan_protocol::frame::{Accept, FrameDecoder};
        use rowscan_protocol::telegram::Telegram;
        let mut decoder = FrameDecoder::new(Accept::Either, self.recorded.len());
        decoder.push(&self.recorded);
        let frame = decoder.next_frame()?;
        let telegram = Telegram::parse(frame.dialect, frame.payload).ok()?;
        match self.event {
            Some(Event::ScanData | Event::Monitor) => telegram.args.decode().ok(),
            _ => None,
        }
    }
}

fn encode(event: Option<Event>, dialect: Dialect, scan: &LmdScandata) -> Vec<u8> {
    let mut bytes = Vec::new();
    match event {
        Some(Event::Monitor) => monitor_event(dialect, scan, &mut bytes),
        _ => scan_event(dialect, scan, &mut bytes),
    }
    bytes
}

fn open(path: &Path, names: &[String], still: &[usize]) -> Result<TimedFrames, ReadError> {
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    TimedFrames::open(path, &names, still)
}
