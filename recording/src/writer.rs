//! The MCAP file: raw bytes of every stream and side on channels of their own, decoded scans and points beside them.
//!
//! | channel | holds |
//! |---|---|
//! | `/NAME/from_device`, `/NAME/to_device` | the bytes of one packet a message; message encoding `bytes`, no schema |
//! | `/NAME/scan` | `foxglove.LaserScan` in JSON |
//! | `/NAME/points` | `foxglove.PointCloud` in JSON |
//!
//! Log time is the host's. A channel's sequence numbers count packets, lost ones too. Records are not chunked: whatever was handed to
//! the system before a crash is whole records and at most one torn one, and every MCAP reader can read up to there.

use std::collections::BTreeMap;
use std::io::{self, Seek, Write};

use mcap::records::{MessageHeader, Metadata};
use mcap::{McapError, WriteOptions, Writer};

use crate::scans::ScanWatch;
use crate::{Side, StreamKind, foxglove};

/// Message encoding of raw bytes.
pub(crate) const BYTES: &str = "bytes";
/// Name of the metadata record that says what the recording is of.
pub(crate) const ABOUT: &str = "rowscan";
/// Keys of a raw channel's metadata.
pub(crate) const STREAM_KEY: &str = "stream";
pub(crate) const SIDE_KEY: &str = "from";
pub(crate) const KIND_KEY: &str = "kind";

/// What a recording is of, as far as it is known. It travels in the file's metadata.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct About {
    /// Scanner model, by the name `rowscan models` lists.
    pub model: Option<String>,
    /// The scene, as it was named.
    pub scene: Option<String>,
    /// The rig, as a rig file has it.
    pub rig: Option<String>,
    /// The seed.
    pub seed: Option<u64>,
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
            ("source", self.source.clone()),
            ("program", self.program.clone()),
        ];
        entries.into_iter().filter_map(|(key, value)| Some((key.to_owned(), value?))).collect()
    }

    /// What is known here, and the rest from `other`.
    pub fn or(self, other: Self) -> Self {
        Self {
            model: self.model.or(other.model),
            scene: self.scene.or(other.scene),
            rig: self.rig.or(other.rig),
            seed: self.seed.or(other.seed),
            source: self.source.or(other.source),
            program: self.program.or(other.program),
        }
    }

    /// From the entries of a metadata record; unknown ones are left alone.
    pub fn from_entries(entries: &BTreeMap<String, String>) -> Self {
        let text = |key: &str| entries.get(key).cloned();
        Self {
            model: text("model"),
            scene: text("scene"),
            rig: text("rig"),
            seed: text("seed").and_then(|seed| seed.parse().ok()),
            source: text("source"),
            program: text("program"),
        }
    }
}

/// What is written beside the raw bytes, for programs that do not know CoLa.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Decoded {
    /// Scans as `foxglove.LaserScan`.
    pub scans: bool,
    /// Returns as `foxglove.PointCloud`.
    pub points: bool,
}

/// A stream of the file being written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StreamId(usize);

/// Writes one MCAP file.
pub struct McapWriter<W: Write + Seek> {
    writer: Writer<W>,
    decoded: Decoded,
    streams: Vec<Stream>,
    /// Schema numbers, once they are needed.
    laser_scan: Option<u16>,
    point_cloud: Option<u16>,
}

struct Stream {
    name: String,
    from_device: Channel,
    to_device: Channel,
    /// Finds scans in what the device sends; none where nothing is decoded.
    watch: Option<ScanWatch>,
    scan: Option<Channel>,
    points: Option<Channel>,
}

#[derive(Clone, Copy)]
struct Channel {
    id: u16,
    sequence: u32,
}

impl<W: Write + Seek> McapWriter<W> {
    /// Begins a file that is safe against crashes: records one after another, the index only at its end.
    pub fn new(out: W, about: &About, decoded: Decoded) -> io::Result<Self> {
        Self::with_options(out, about, decoded, WriteOptions::new().use_chunks(false))
    }

    /// Begins a file whose messages are indexed, chunk by chunk: for a recording that is complete already.
    pub fn indexed(out: W, about: &About, decoded: Decoded) -> io::Result<Self> {
        Self::with_options(out, about, decoded, WriteOptions::new().use_chunks(true))
    }

    fn with_options(out: W, about: &About, decoded: Decoded, options: WriteOptions) -> io::Result<Self> {
        let program = about.program.clone().unwrap_or_else(|| "rowscan".to_owned());
        let options = options.compression(None).profile("").library(program);
        let mut writer = Writer::with_options(out, options).map_err(plain)?;
        let about = Metadata { name: ABOUT.to_owned(), metadata: about.entries() };
        writer.write_metadata(&about).map_err(plain)?;
        Ok(Self { writer, decoded, streams: Vec::new(), laser_scan: None, point_cloud: None })
    }

    /// Adds a stream; its channels stand in the file from here on.
    pub fn add_stream(&mut self, name: &str, kind: StreamKind) -> io::Result<StreamId> {
        let from_device = self.raw_channel(name, kind, Side::Device)?;
        let to_device = self.raw_channel(name, kind, Side::Host)?;
        let decodes = kind == StreamKind::Cola && (self.decoded.scans || self.decoded.points);
        self.streams.push(Stream {
            name: name.to_owned(),
            from_device,
            to_device,
            watch: decodes.then(ScanWatch::default),
            scan: None,
            points: None,
        });
        Ok(StreamId(self.streams.len() - 1))
    }

    fn raw_channel(&mut self, name: &str, kind: StreamKind, from: Side) -> io::Result<Channel> {
        let (topic, from) = match from {
            Side::Device => (format!("/{name}/from_device"), "device"),
            Side::Host => (format!("/{name}/to_device"), "host"),
        };
        let about = [(STREAM_KEY, name), (SIDE_KEY, from), (KIND_KEY, &kind.to_string())];
        let about = about.into_iter().map(|(key, value)| (key.to_owned(), value.to_owned())).collect();
        let id = self.writer.add_channel(0, &topic, BYTES, &about).map_err(plain)?;
        Ok(Channel { id, sequence: 0 })
    }

    /// Writes one packet, and the scans it completes. `lost_before` packets of this stream were lost before it.
    pub fn write(
        &mut self,
        stream: StreamId,
        from: Side,
        at_ns: u64,
        lost_before: u32,
        bytes: &[u8],
    ) -> io::Result<()> {
        let Self { writer, streams, .. } = self;
        let Some(found) = streams.get_mut(stream.0) else { return Ok(()) };
        let channel = match from {
            Side::Device => &mut found.from_device,
            Side::Host => &mut found.to_device,
        };
        channel.sequence = channel.sequence.wrapping_add(lost_before);
        message(writer, channel, at_ns, bytes)?;
        if from == Side::Device {
            self.write_scans(stream, at_ns, bytes)?;
        }
        Ok(())
    }

    fn write_scans(&mut self, stream: StreamId, at_ns: u64, bytes: &[u8]) -> io::Result<()> {
        let Some(mut watch) = self.streams.get_mut(stream.0).and_then(|found| found.watch.take()) else {
            return Ok(());
        };
        watch.push(bytes);
        while let Some(scan) = watch.next_scan() {
            let name = self.streams.get(stream.0).map(|found| found.name.clone()).unwrap_or_default();
            if self.decoded.scans {
                let text = foxglove::laser_scan(at_ns, &name, scan);
                let schema =
                    self.schema(foxglove::LASER_SCAN, foxglove::LASER_SCAN_SCHEMA, |s| &mut s.laser_scan)?;
                self.write_decoded(stream, &format!("/{name}/scan"), schema, at_ns, &text, |s| &mut s.scan)?;
            }
            if self.decoded.points {
                let text = foxglove::point_cloud(at_ns, &name, scan);
                let schema =
                    self.schema(foxglove::POINT_CLOUD, foxglove::POINT_CLOUD_SCHEMA, |s| &mut s.point_cloud)?;
                self.write_decoded(stream, &format!("/{name}/points"), schema, at_ns, &text, |s| {
                    &mut s.points
                })?;
            }
        }
        if let Some(found) = self.streams.get_mut(stream.0) {
            found.watch = Some(watch);
        }
        Ok(())
    }

    fn schema(&mut self, name: &str, text: &str, kept: fn(&mut Self) -> &mut Option<u16>) -> io::Result<u16> {
        if let Some(id) = *kept(self) {
            return Ok(id);
        }
        let id = self.writer.add_schema(name, "jsonschema", text.as_bytes()).map_err(plain)?;
        *kept(self) = Some(id);
        Ok(id)
    }

    fn write_decoded(
        &mut self,
        stream: StreamId,
        topic: &str,
        schema: u16,
        at_ns: u64,
        text: &[u8],
        kept: fn(&mut Stream) -> &mut Option<Channel>,
    ) -> io::Result<()> {
        let Self { writer, streams, .. } = self;
        let Some(found) = streams.get_mut(stream.0) else { return Ok(()) };
        let channel = kept(found);
        if channel.is_none() {
            let id = writer.add_channel(schema, topic, "json", &BTreeMap::new()).map_err(plain)?;
            *channel = Some(Channel { id, sequence: 0 });
        }
        channel.as_mut().map_or(Ok(()), |channel| message(writer, channel, at_ns, text))
    }

    /// Hands all that was written to the system.
    pub fn flush(&mut self) -> io::Result<()> {
        self.writer.flush().map_err(plain)
    }

    /// What it was written to. Without [`finish`](Self::finish) before, the file has no end.
    pub fn into_inner(self) -> W {
        self.writer.into_inner()
    }

    /// Writes the file's end: statistics and, where there are chunks, their index.
    pub fn finish(&mut self) -> io::Result<()> {
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
fn plain(error: McapError) -> io::Error {
    match error {
        McapError::Io(cause) => cause,
        other => io::Error::other(other.to_string()),
    }
}
