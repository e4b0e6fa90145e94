//! The MCAP file: raw bytes of every stream and side on channels of their own, what they mean beside them.
//!
//! | channel | holds |
//! |---|---|
//! | `/NAME/from_device`, `/NAME/to_device` | the bytes of one packet a message; message encoding `bytes`, no schema |
//! | `/NAME/scan` | `foxglove.LaserScan` in JSON |
//! | `/NAME/points` | `foxglove.PointCloud` in JSON |
//! | `/NAME/fix` | `foxglove.LocationFix` in JSON, of a GNSS receiver |
//! | `/NAME/frame` | `rowscan.CanFrame` in JSON, of a CAN bus, both directions |
//!
//! As a ROS 2 bag ([`Language::Ros2`]) every message is in CDR, for ROS 2 reads no file with two encodings: raw bytes are `std_msgs/msg/UInt8MultiArray`, scans
//! `sensor_msgs/msg/LaserScan`, positions `sensor_msgs/msg/NavSatFix`. Its topics are names that ROS 2 takes (`ros2_names.rs`), and every layer of a scanner with
//! several has one of its own, for a `LaserScan` says nothing of how its plane lies.
//!
//! Log time is the host's; in the file of a recorder it never goes back. A channel's sequence numbers count packets, lost ones too. Records are not chunked: whatever was handed to
//! the system before a crash is whole records and at most one torn one, and every MCAP reader can read up to there.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::io::{self, Seek, Write};
use std::time::Duration;

use mcap::records::{MessageHeader, Metadata};
use mcap::{McapError, WriteOptions, Writer};
use rowscan_protocol::can::CanFrame;
use rowscan_protocol::scan::Scan;

use crate::drive::Drive;
use crate::fix::FixReader;
use crate::scan_reader::{MAX_PAYLOAD, ScanReader};
use crate::schema::{Language, Schema};
use crate::{Side, StreamKind, foxglove, ros2, ros2_names};

/// Message encoding of raw bytes.
pub(crate) const BYTES: &str = "bytes";
/// Name of the metadata record that says what the recording is of.
pub(crate) const ABOUT: &str = "rowscan";
/// Keys of a raw channel's metadata.
pub(crate) const STREAM_KEY: &str = "stream";
pub(crate) const SIDE_KEY: &str = "from";
pub(crate) const KIND_KEY: &str = "kind";
/// Whose clock times are by, where it is the scanner's.
const DEVICE: &str = "device";
/// What stands before a stream's name in the key of its model.
const MODEL_OF: &str = "model/";
/// The same of the rig's scanner that it is.
const MOUNT_OF: &str = "mount/";
/// The same of the models that it can be, where its name does not tell which.
const CANDIDATES_OF: &str = "candidates/";

/// Describes a recording, as far as is known; stored in the file's metadata.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct About {
    /// Scanner model, by the name `rowscan models` lists.
    pub model: Option<String>,
    /// The model of each stream, by the stream's name, where that is known.
    pub models: BTreeMap<String, String>,
    /// The models that a stream's scanner can be, with commas between them, where its name is that of a family.
    pub candidates: BTreeMap<String, String>,
    /// Which of the rig's scanners each stream is of, from 0, by the stream's name, where that is known.
    pub mounts: BTreeMap<String, usize>,
    /// The scene, as it was named.
    pub scene: Option<String>,
    /// The rig, as a rig file has it.
    pub rig: Option<String>,
    /// The seed.
    pub seed: Option<u64>,
    /// When the drive began, of a run whose tractor waits for its start.
    pub drive: Option<Drive>,
    /// Times are by the scanner's clock, for what it was written from had none: no host's clock is known.
    pub by_device_clock: bool,
    /// Where the bytes came from: addresses, files.
    pub source: Option<String>,
    /// Program and version that wrote it.
    pub program: Option<String>,
}

impl About {
    /// As the entries of a metadata record.
    pub fn entries(&self) -> BTreeMap<String, String> {
        let seed = self.seed.map(|seed| seed.to_string());
        let entries = [
            ("format", Some("1".to_owned())),
            ("model", self.model.clone()),
            ("scene", self.scene.clone()),
            ("rig", self.rig.clone()),
            ("seed", seed),
            ("drive", self.drive.map(|drive| drive.to_string())),
            ("clock", self.by_device_clock.then(|| DEVICE.to_owned())),
            ("source", self.source.clone()),
            ("program", self.program.clone()),
        ];
        let entries = entries.into_iter().filter_map(|(key, value)| Some((key.to_owned(), value?)));
        let of_streams = |before: &'static str, known: &BTreeMap<String, String>| {
            let named = known.iter().map(|(stream, models)| (format!("{before}{stream}"), models.clone()));
            named.collect::<Vec<_>>()
        };
        let models = of_streams(MODEL_OF, &self.models);
        let mounts =
            self.mounts.iter().map(|(stream, mount)| (format!("{MOUNT_OF}{stream}"), mount.to_string()));
        entries.chain(models).chain(of_streams(CANDIDATES_OF, &self.candidates)).chain(mounts).collect()
    }

    /// Says what the scanners are: the model of each, which of the rig's it is, and the streams that its telegrams may come in.
    #[must_use]
    pub fn of_scanners<S: IntoIterator<Item = String>>(
        mut self,
        scanners: impl IntoIterator<Item = (&'static str, usize, S)>,
    ) -> Self {
        let mut names = Vec::new();
        for (model, mount, streams) in scanners {
            names.push(model);
            for stream in streams {
                self.mounts.insert(stream.clone(), mount);
                self.models.insert(stream, model.to_owned());
            }
        }
        self.model = Some(names.join(", "));
        self
    }

    /// The model of this stream: the one that is told of it, else the only one that is told at all.
    pub fn model_of(&self, stream: &str) -> Option<&str> {
        told_of(&self.models, stream).map(String::as_str).or_else(|| self.only_model())
    }

    /// Which of the rig's scanners this stream is of, from 0.
    pub fn mount_of(&self, stream: &str) -> Option<usize> {
        told_of(&self.mounts, stream).copied()
    }

    /// The models that this stream's scanner can be: one where it is known, none where nothing is.
    pub fn candidates_of(&self, stream: &str) -> Vec<&str> {
        match (self.model_of(stream), told_of(&self.candidates, stream)) {
            (Some(model), _) => vec![model],
            (None, Some(candidates)) => candidates.split(',').map(str::trim).collect(),
            (None, None) => Vec::new(),
        }
    }

    /// The model of all scanners, where it is one.
    pub fn only_model(&self) -> Option<&str> {
        let mut names = self.model.as_deref()?.split(',').map(str::trim);
        let first = names.next()?;
        names.all(|name| name == first).then_some(first)
    }

    /// Fills what is unknown here from `other`.
    pub fn or(self, other: Self) -> Self {
        Self {
            model: self.model.or(other.model),
            models: if self.models.is_empty() { other.models } else { self.models },
            candidates: if self.candidates.is_empty() { other.candidates } else { self.candidates },
            mounts: if self.mounts.is_empty() { other.mounts } else { self.mounts },
            scene: self.scene.or(other.scene),
            rig: self.rig.or(other.rig),
            seed: self.seed.or(other.seed),
            drive: self.drive.or(other.drive),
            by_device_clock: self.by_device_clock || other.by_device_clock,
            source: self.source.or(other.source),
            program: self.program.or(other.program),
        }
    }

    /// From the entries of a metadata record; unknown ones are ignored.
    pub fn from_entries(entries: &BTreeMap<String, String>) -> Self {
        let text = |key: &str| entries.get(key).cloned();
        let of_streams = |before: &str| {
            let named = |(key, value): (&String, &String)| {
                Some((key.strip_prefix(before)?.to_owned(), value.clone()))
            };
            entries.iter().filter_map(named).collect()
        };
        Self {
            model: text("model"),
            models: of_streams(MODEL_OF),
            candidates: of_streams(CANDIDATES_OF),
            mounts: entries
                .iter()
                .filter_map(|(key, value)| {
                    Some((key.strip_prefix(MOUNT_OF)?.to_owned(), value.parse().ok()?))
                })
                .collect(),
            scene: text("scene"),
            rig: text("rig"),
            seed: text("seed").and_then(|seed| seed.parse().ok()),
            drive: entries.get("drive").and_then(|drive| Drive::from_text(drive)),
            by_device_clock: text("clock").as_deref() == Some(DEVICE),
            source: text("source"),
            program: text("program"),
        }
    }
}

/// What is told of this stream, else of the one whose scanner it is of again: a later client's stream has a number behind the name.
fn told_of<'a, T>(told: &'a BTreeMap<String, T>, stream: &str) -> Option<&'a T> {
    let again = || {
        let (first, number) = stream.rsplit_once('-')?;
        number.parse::<u64>().ok().and_then(|_| told.get(first))
    };
    told.get(stream).or_else(again)
}

/// What is written beside the raw bytes, for programs that do not know CoLa.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Decoded {
    /// Scans as `foxglove.LaserScan`.
    pub scans: bool,
    /// Returns as `foxglove.PointCloud`.
    pub points: bool,
    /// Positions as `foxglove.LocationFix`, CAN frames as `rowscan.CanFrame`.
    pub beside: bool,
    /// In which language. ROS 2 has no points of ours and no CAN frames.
    pub language: Language,
}

/// A stream of the file being written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StreamId(usize);

/// Where an MCAP file goes: its head is written again at the end.
pub trait WriteSeek: Write + Seek {}
impl<W: Write + Seek> WriteSeek for W {}

/// Writes one MCAP file.
pub struct McapWriter<W: Write + Seek> {
    writer: Writer<W>,
    decoded: Decoded,
    streams: Vec<Stream>,
    /// Schema numbers by name, once they are needed.
    schemas: BTreeMap<&'static str, u16>,
}

struct Stream {
    name: String,
    /// The same in its topics.
    topics: String,
    from_device: Channel,
    to_device: Channel,
    /// Decodes what is sent; `None` if nothing is decoded.
    watch: Option<Watch>,
    /// When its last bytes came.
    last_ns: u64,
    /// Decoded channels by the last word of their topic, once they are needed.
    decoded: BTreeMap<String, Channel>,
}

/// A decoded message.
struct Message {
    schema: Schema,
    /// The last word of its topic.
    topic: String,
    data: Vec<u8>,
}

impl Message {
    fn new(schema: Schema, data: Vec<u8>) -> Self {
        Self { schema, topic: schema.topic.to_owned(), data }
    }

    /// A scan in a topic and a frame of its layer.
    fn ros2_scan(at_ns: u64, name: &str, scan: &Scan) -> Self {
        let of_layer = |name: &str| ros2_names::of_layer(name, scan.layer_centideg);
        let data = ros2::laser_scan(at_ns, &of_layer(name), scan);
        Self { schema: ros2::LASER_SCAN, topic: of_layer(ros2::LASER_SCAN.topic), data }
    }
}

/// Decodes a stream for programs that do not know its protocol.
enum Watch {
    Scans(ScanReader),
    Fixes(FixReader),
    Frames,
}

impl Watch {
    fn new(kind: StreamKind, decoded: Decoded) -> Option<Self> {
        match kind {
            scanner if scanner.is_scanner() && (decoded.scans || decoded.points) => {
                ScanReader::new(scanner, MAX_PAYLOAD).map(Self::Scans)
            }
            StreamKind::Nmea if decoded.beside => Some(Self::Fixes(FixReader::default())),
            StreamKind::Can if decoded.beside && decoded.language == Language::Json => Some(Self::Frames),
            _ => None,
        }
    }

    /// The messages that `bytes` complete.
    fn read(&mut self, name: &str, from: Side, at_ns: u64, bytes: &[u8], wanted: Decoded) -> Vec<Message> {
        let mut messages = Vec::new();
        match self {
            Self::Scans(reader) if from == Side::Device => {
                reader.push_bytes(Duration::from_nanos(at_ns), bytes);
                messages = scan_messages(reader, name, at_ns, wanted);
            }
            Self::Fixes(reader) if from == Side::Device => {
                reader.push(bytes);
                let fixes = std::iter::from_fn(|| reader.next_fix());
                messages.extend(fixes.map(|fix| match wanted.language {
                    Language::Json => {
                        Message::new(foxglove::LOCATION_FIX, foxglove::location_fix(at_ns, name, &fix))
                    }
                    Language::Ros2 => Message::new(ros2::NAV_SAT_FIX, ros2::nav_sat_fix(at_ns, name, &fix)),
                }));
            }
            // A bus has no sides.
            Self::Frames => {
                let frame = std::str::from_utf8(bytes).ok().and_then(CanFrame::from_text);
                let told = |frame| Message::new(foxglove::CAN_FRAME, foxglove::can_frame(at_ns, &frame));
                messages.extend(frame.map(told));
            }
            Self::Scans(_) | Self::Fixes(_) => {}
        }
        messages
    }

    /// The messages that are complete since no more bytes come: the last turn of a scanner that sends it in segments.
    fn end(&mut self, name: &str, at_ns: u64, wanted: Decoded) -> Vec<Message> {
        let Self::Scans(reader) = self else { return Vec::new() };
        reader.finish();
        scan_messages(reader, name, at_ns, wanted)
    }
}

/// The messages of the scans that are complete.
fn scan_messages(reader: &mut ScanReader, name: &str, at_ns: u64, wanted: Decoded) -> Vec<Message> {
    let mut messages = Vec::new();
    while let Some(scan) = reader.next_scan() {
        if wanted.scans {
            messages.push(match wanted.language {
                Language::Json => Message::new(foxglove::LASER_SCAN, foxglove::laser_scan(at_ns, name, scan)),
                Language::Ros2 => Message::ros2_scan(at_ns, name, scan),
            });
        }
        if wanted.points && wanted.language == Language::Json {
            messages.push(Message::new(foxglove::POINT_CLOUD, foxglove::point_cloud(at_ns, name, scan)));
        }
    }
    messages
}

#[derive(Clone, Copy)]
struct Channel {
    id: u16,
    sequence: u32,
}

/// The number of a schema in the file, where it stands from here on.
fn schema_id<W: Write + Seek>(
    writer: &mut Writer<W>,
    schemas: &mut BTreeMap<&'static str, u16>,
    schema: Schema,
) -> io::Result<u16> {
    if let Some(id) = schemas.get(schema.name) {
        return Ok(*id);
    }
    let language = schema.language.of_schema();
    let id = writer.add_schema(schema.name, language, schema.text.as_bytes()).map_err(plain)?;
    Ok(*schemas.entry(schema.name).or_insert(id))
}

impl<W: Write + Seek> McapWriter<W> {
    /// Begins a file that is safe against crashes: records one after another, the index only at its end.
    pub fn new(out: W, about: &About, decoded: Decoded) -> io::Result<Self> {
        Self::with_options(out, about, decoded, WriteOptions::new().use_chunks(false))
    }

    /// Begins a file whose messages are indexed, chunk by chunk: for a recording that is complete already.
    pub fn indexed(out: W, about: &About, decoded: Decoded) -> io::Result<Self> {
        // Chunks are put together in memory, so that a pipe will do.
        Self::with_options(out, about, decoded, WriteOptions::new().use_chunks(true).disable_seeking(true))
    }

    fn with_options(out: W, about: &About, decoded: Decoded, options: WriteOptions) -> io::Result<Self> {
        let program = about.program.clone().unwrap_or_else(|| "rowscan".to_owned());
        let profile = match decoded.language {
            Language::Json => "",
            Language::Ros2 => "ros2",
        };
        let options = options.compression(None).profile(profile).library(program);
        let writer = Writer::with_options(out, options).map_err(plain)?;
        let mut begun = Self { writer, decoded, streams: Vec::new(), schemas: BTreeMap::new() };
        begun.describe(about)?;
        Ok(begun)
    }

    /// Says what the recording is of, in place of what was said before.
    pub fn describe(&mut self, about: &About) -> io::Result<()> {
        let about = Metadata { name: ABOUT.to_owned(), metadata: about.entries() };
        self.writer.write_metadata(&about).map_err(plain)
    }

    /// Adds a stream; its channels stand in the file from here on.
    pub fn add_stream(&mut self, name: &str, kind: StreamKind) -> io::Result<StreamId> {
        let topics = match self.decoded.language {
            Language::Json => name.to_owned(),
            Language::Ros2 => {
                let is_free = |topics: &str| self.streams.iter().all(|stream| stream.topics != topics);
                ros2_names::of_stream(name, is_free)
            }
        };
        let from_device = self.raw_channel((name, &topics), kind, Side::Device)?;
        let to_device = self.raw_channel((name, &topics), kind, Side::Host)?;
        self.streams.push(Stream {
            name: name.to_owned(),
            topics,
            from_device,
            to_device,
            watch: Watch::new(kind, self.decoded),
            last_ns: 0,
            decoded: BTreeMap::new(),
        });
        Ok(StreamId(self.streams.len() - 1))
    }

    fn raw_channel(
        &mut self,
        (name, topics): (&str, &str),
        kind: StreamKind,
        from: Side,
    ) -> io::Result<Channel> {
        let (topic, from) = match from {
            Side::Device => (format!("/{topics}/from_device"), "device"),
            Side::Host => (format!("/{topics}/to_device"), "host"),
        };
        let about = [(STREAM_KEY, name), (SIDE_KEY, from), (KIND_KEY, &kind.to_string())];
        let about = about.into_iter().map(|(key, value)| (key.to_owned(), value.to_owned())).collect();
        let (schema, encoding) = match self.decoded.language {
            Language::Json => (0, BYTES),
            Language::Ros2 => {
                (schema_id(&mut self.writer, &mut self.schemas, ros2::BYTES)?, Language::Ros2.of_messages())
            }
        };
        let id = self.writer.add_channel(schema, &topic, encoding, &about).map_err(plain)?;
        Ok(Channel { id, sequence: 0 })
    }

    /// Writes one packet, and what it completes. `lost_before` packets of this stream were lost before it.
    pub fn write(
        &mut self,
        stream: StreamId,
        from: Side,
        at_ns: u64,
        lost_before: u32,
        bytes: &[u8],
    ) -> io::Result<()> {
        let Self { writer, decoded, streams, schemas } = self;
        let Some(found) = streams.get_mut(stream.0) else { return Ok(()) };
        let channel = match from {
            Side::Device => &mut found.from_device,
            Side::Host => &mut found.to_device,
        };
        channel.sequence = channel.sequence.wrapping_add(lost_before);
        match decoded.language {
            Language::Json => message(writer, channel, at_ns, bytes)?,
            Language::Ros2 => message(writer, channel, at_ns, &ros2::bytes(bytes))?,
        }
        found.last_ns = at_ns;
        let Some(watch) = &mut found.watch else { return Ok(()) };
        let messages = watch.read(&found.name, from, at_ns, bytes, *decoded);
        Self::tell(writer, schemas, found, at_ns, messages)
    }

    /// Writes what was decoded of a stream.
    fn tell(
        writer: &mut Writer<W>,
        schemas: &mut BTreeMap<&'static str, u16>,
        found: &mut Stream,
        at_ns: u64,
        messages: Vec<Message>,
    ) -> io::Result<()> {
        for Message { schema, topic, data } in messages {
            let schema_id = schema_id(writer, schemas, schema)?;
            let channel = match found.decoded.entry(topic) {
                Entry::Occupied(known) => known.into_mut(),
                Entry::Vacant(free) => {
                    let topic = format!("/{}/{}", found.topics, free.key());
                    let id = writer
                        .add_channel(schema_id, &topic, schema.language.of_messages(), &BTreeMap::new())
                        .map_err(plain)?;
                    free.insert(Channel { id, sequence: 0 })
                }
            };
            message(writer, channel, at_ns, &data)?;
        }
        Ok(())
    }

    /// Flushes all that was written.
    pub fn flush(&mut self) -> io::Result<()> {
        self.writer.flush().map_err(plain)
    }

    /// What it was written to. Without [`finish`](Self::finish) before, the file has no end.
    pub fn into_inner(self) -> W {
        self.writer.into_inner()
    }

    /// Writes the file's end: statistics and, where there are chunks, their index.
    pub fn finish(&mut self) -> io::Result<()> {
        let Self { writer, decoded, streams, schemas } = self;
        for found in streams {
            let Some(watch) = &mut found.watch else { continue };
            let (at_ns, messages) = (found.last_ns, watch.end(&found.name, found.last_ns, *decoded));
            Self::tell(writer, schemas, found, at_ns, messages)?;
        }
        // It flushes, too.
        self.writer.finish().map(drop).map_err(plain)
    }
}

fn message<W: Write + Seek>(
    writer: &mut Writer<W>,
    channel: &mut Channel,
    at_ns: u64,
    data: &[u8],
) -> io::Result<()> {
    let header = MessageHeader {
        channel_id: channel.id,
        sequence: channel.sequence,
        log_time: at_ns,
        publish_time: at_ns,
    };
    channel.sequence = channel.sequence.wrapping_add(1);
    writer.write_to_known_channel(&header, data).map_err(plain)
}

/// The system's own error where there is one.
pub(crate) fn plain(error: McapError) -> io::Error {
    match error {
        McapError::Io(cause) => cause,
        other => io::Error::other(other.to_string()),
    }
}
