//! MCAP files: ours, whole, cut off anywhere or with holes.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::io::Read;

use mcap::records::Record;

use super::torn::Torn;
use super::{ReadError, StreamInfo, ros2_scan};
use crate::mcap_records::Records;
use crate::ros2;
use crate::schema::Language;
use crate::writer::{ABOUT, BYTES, KIND_KEY, SIDE_KEY, STREAM_KEY};
use crate::{About, Joint, Packet, Side, StreamKind};

/// Longer records are refused.
const LONGEST_RECORD: usize = 64 * 1024 * 1024;

/// Reads record after record.
pub(super) struct McapReader {
    records: Records<Box<dyn Read + Send>>,
    channels: BTreeMap<u16, Channel>,
    /// The names of schemas, by their numbers.
    schemas: BTreeMap<u16, String>,
    pub(super) streams: Vec<StreamInfo>,
    pub(super) about: About,
    /// Topics that are not ours, for the error message.
    foreign: Vec<String>,
}

/// A channel of raw bytes.
struct Channel {
    stream: usize,
    from: Side,
    wrapping: Wrapping,
    /// The next message's number, once one has come.
    next: Option<u32>,
}

/// What a message has around a packet's bytes.
#[derive(Clone, Copy)]
enum Wrapping {
    None,
    /// Of a ROS 2 bag.
    Ros2,
    /// No packet's bytes: a scan of a ROS 2 bag that somebody else wrote.
    Ros2Scan,
}

impl Wrapping {
    fn of(encoding: &str) -> Option<Self> {
        if encoding == BYTES {
            return Some(Self::None);
        }
        (encoding == Language::Ros2.of_messages()).then_some(Self::Ros2)
    }

    /// The bytes of the packet; none if the message is another one. Scans are counted from `counter` on.
    fn bytes(self, message: &[u8], counter: u32) -> Option<Cow<'_, [u8]>> {
        match self {
            Self::None => Some(message.into()),
            Self::Ros2 => ros2::packet(message).map(Cow::from),
            Self::Ros2Scan => ros2_scan::telegram(message, counter as u16).map(Cow::from),
        }
    }
}

impl McapReader {
    pub(super) fn new(input: Box<dyn Read + Send>) -> Self {
        Self {
            records: Records::new(input, LONGEST_RECORD),
            channels: BTreeMap::new(),
            schemas: BTreeMap::new(),
            streams: Vec::new(),
            about: About::default(),
            foreign: Vec::new(),
        }
    }

    /// The next packet of any stream; none at the end of the file, or where it breaks off.
    pub(super) fn next(&mut self) -> Result<Option<Packet>, ReadError> {
        while let Some(record) = self.records.next_record()? {
            match record {
                Record::Message { header, data } => {
                    let known = self.channels.get_mut(&header.channel_id);
                    let packet = known.and_then(|channel| {
                        let counter = channel.next.unwrap_or_default();
                        let bytes = channel.wrapping.bytes(&data, counter)?;
                        // Their own numbers, which many recorders leave at 0, tell nothing.
                        let is_scan = matches!(channel.wrapping, Wrapping::Ros2Scan);
                        let sequence = if is_scan { counter } else { header.sequence };
                        Some(channel.packet(sequence, header.log_time, &bytes))
                    });
                    if packet.is_some() {
                        return Ok(packet);
                    }
                }
                Record::Schema { header, .. } => {
                    self.schemas.insert(header.id, header.name);
                }
                Record::Channel(channel) => {
                    let schema = self.schemas.get(&channel.schema_id).map(String::as_str);
                    match scan_topic(&self.channels, &channel, schema) {
                        Some(name) => {
                            let stream = self.streams.len();
                            let found = Channel::new(stream, Side::Device, Wrapping::Ros2Scan);
                            if let Entry::Vacant(free) = self.channels.entry(channel.id) {
                                self.streams.push(StreamInfo::new(name, StreamKind::Cola));
                                free.insert(found);
                            }
                        }
                        None => add(&mut self.channels, &mut self.streams, &mut self.foreign, channel),
                    }
                }
                Record::Metadata(found) if found.name == ABOUT => {
                    self.about = About::from_entries(&found.metadata);
                }
                _ => {}
            }
        }
        if self.streams.is_empty() {
            return Err(ReadError::NoStreams { found: std::mem::take(&mut self.foreign) });
        }
        Ok(None)
    }

    /// What of the file cannot be read, once the last packet was.
    pub(super) fn torn(&self) -> Option<&Torn> {
        self.records.torn()
    }
}

/// The name of a channel of scans in a ROS 2 bag of somebody else: one of ours has the scanner's bytes, which say more.
fn scan_topic(
    known: &BTreeMap<u16, Channel>,
    found: &mcap::records::Channel,
    schema: Option<&str>,
) -> Option<String> {
    let is_scan = schema == Some(ros2_scan::TYPE) && found.message_encoding == Language::Ros2.of_messages();
    let are_ours = known.values().any(|channel| !matches!(channel.wrapping, Wrapping::Ros2Scan));
    (is_scan && !are_ours).then(|| found.topic.trim_start_matches('/').to_owned())
}

/// Notes a channel; one that holds no raw bytes of ours is only remembered by name.
fn add(
    channels: &mut BTreeMap<u16, Channel>,
    streams: &mut Vec<StreamInfo>,
    foreign: &mut Vec<String>,
    found: mcap::records::Channel,
) {
    let text = |key: &str| found.metadata.get(key).map(String::as_str);
    let from = match text(SIDE_KEY) {
        Some("device") => Some(Side::Device),
        Some("host") => Some(Side::Host),
        _ => None,
    };
    let wrapping = Wrapping::of(&found.message_encoding);
    let (Some(name), Some(from), Some(wrapping)) = (text(STREAM_KEY), from, wrapping) else {
        if !foreign.contains(&found.topic) && foreign.len() < 20 {
            foreign.push(found.topic);
        }
        return;
    };
    let known = streams.iter().position(|stream| stream.name == name);
    let stream = known.unwrap_or_else(|| {
        let kind = text(KIND_KEY).and_then(|kind| kind.parse().ok()).unwrap_or(StreamKind::Bytes);
        streams.push(StreamInfo::new(name, kind));
        streams.len() - 1
    });
    channels.entry(found.id).or_insert(Channel::new(stream, from, wrapping));
}

impl Channel {
    fn new(stream: usize, from: Side, wrapping: Wrapping) -> Self {
        Self { stream, from, wrapping, next: None }
    }

    fn packet(&mut self, sequence: u32, at_ns: u64, bytes: &[u8]) -> Packet {
        let joint = match self.next {
            Some(next) if next == sequence => Joint::Seamless,
            None if sequence == 0 => Joint::Anew,
            // One that goes back is not what follows: another program has merged or sorted the file.
            Some(next) if sequence.wrapping_sub(next).cast_signed() < 0 => Joint::Anew,
            next => {
                Joint::Gap { bytes: 0, packets: u64::from(sequence.wrapping_sub(next.unwrap_or_default())) }
            }
        };
        self.next = Some(sequence.wrapping_add(1));
        Packet {
            stream: self.stream,
            from: Some(self.from),
            at_ns: Some(at_ns),
            joint,
            bytes: bytes.to_vec(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file of one chunk that says it is compressed so.
    fn chunk(compression: &str) -> Vec<u8> {
        let text = |text: &str| [&(text.len() as u32).to_le_bytes(), text.as_bytes()].concat();
        let record = |opcode: u8, content: &[u8]| {
            [&[opcode], &(content.len() as u64).to_le_bytes()[..], content].concat()
        };
        let records = [7; 8];
        let times_sizes_and_checksum = [0; 8 + 8 + 8 + 4];
        let content = [
            &times_sizes_and_checksum[..],
            &text(compression),
            &(records.len() as u64).to_le_bytes(),
            &records,
        ];
        let (magic, header) = (&b"\x89MCAP0\r\n"[..], record(0x01, &[text(""), text("")].concat()));
        [magic, &header, &record(0x06, &content.concat())].concat()
    }

    #[test]
    fn a_chunk_that_cannot_be_unpacked_is_refused_with_the_remedy() {
        let refused = |compression: &str| {
            let why = McapReader::new(Box::new(std::io::Cursor::new(chunk(compression)))).next();
            why.map(drop).expect_err("no packet").to_string()
        };
        let foreign = refused("brotli");
        assert!(foreign.contains("`brotli`, expected lz4, zstd or none; write it anew"), "{foreign}");
        if cfg!(not(feature = "compressed")) {
            let missing = refused("zstd");
            assert!(
                missing.contains("needs the feature `compressed`") && missing.contains("write it anew"),
                "{missing}"
            );
        }
    }
}
