//! Recordings of any format, packet by packet.

mod candump;
mod capture;
mod carmen;
mod clock_back;
mod datagrams;
mod dump;
mod format;
mod fragments;
mod gzip;
mod hex;
mod mcap;
mod missing_bytes;
mod ranges;
mod ros2_scan;
mod segment;
mod sides;
mod soundness;
mod tail;
mod tcp;
mod told_scan;
mod torn;
mod wireshark;
mod words;

use std::io::{self, Cursor, Read};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use rowscan_files::Bounded;
use rowscan_protocol::compact;
use rowscan_protocol::frame::{Accept, FrameDecoder};
use rowscan_protocol::lms2xx;
use rowscan_protocol::telegram::Telegram;
use serde::Serialize;

pub use clock_back::ClockBack;
pub use format::Format;
pub use gzip::BrokenArchive;
pub use missing_bytes::MissingBytes;
pub use soundness::Soundness;
pub(crate) use torn::END;
pub use torn::{Resumed, Torn};

use crate::scan_reader::MAX_PAYLOAD;
use crate::{About, Packet, StreamKind};
use mcap::McapReader;
use tail::Tail;

/// Bytes a file is recognised by, and bytes taken from it at a time.
const CHUNK: usize = 64 * 1024;

/// Most bytes, unpacked, of a file that is read whole: a capture's packets come in any order, and a text is parsed at once.
const MOST_BYTES_WHOLE: u64 = 512 * 1024 * 1024;

/// Most lines of a text: each is a packet of its own, and takes more memory than its bytes.
const MOST_LINES: usize = 5_000_000;

/// What stands for standard input; a file of that name is `./-`.
const STDIN: &str = "-";

/// What text in UTF-8 may begin with.
const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

/// A stream of a recording.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct StreamInfo {
    /// Its name; of a capture, the device's address.
    pub name: String,
    /// What its bytes are.
    pub kind: StreamKind,
    /// Of a capture's stream that is several connections, one after the other: their names, for [`Recording::open_apart`].
    pub connections: Vec<String>,
}

impl StreamInfo {
    /// A stream.
    pub(crate) fn new(name: impl Into<String>, kind: StreamKind) -> Self {
        Self { name: name.into(), kind, connections: Vec::new() }
    }
}

/// Why a recording cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The system refused.
    #[error("{0}")]
    Io(#[source] io::Error),
    /// Standard input, a second time.
    #[error(
        "standard input can be read once, and this needs it twice: write it to a file first, and name that"
    )]
    StdinTwice,
    /// A gzip archive that cannot be unpacked to its end.
    #[error("{0}")]
    Archive(BrokenArchive),
    /// More bytes than are read of a file that is read whole.
    #[error(
        "a file of this kind is read whole, {0}; cut it in parts (a capture: `editcap -c 1000000`), or record as MCAP, which has no bound"
    )]
    TooLarge(#[source] io::Error),
    /// No bytes at all.
    #[error("it is empty: expected recorded telegrams, found 0 bytes")]
    Empty,
    /// A file of another kind.
    #[error(
        "it is {what}; expected a recording: MCAP, a network capture, raw bytes, hex text, telegrams as text, packets in Wireshark's JSON or a CARMEN log"
    )]
    Foreign {
        /// What it is, and the remedy.
        what: &'static str,
    },
    /// Text of which no line is hex, or anything else that is read.
    #[error(
        "it is text and no recording, as its line {line} shows, which begins `{found}`; expected a recording: MCAP, a network capture, raw bytes, hex text, \
         telegrams as text, a candump log, CSV of ranges, packets in Wireshark's JSON or a CARMEN log"
    )]
    OtherText {
        /// The first line that is no comment, from 1 on.
        line: usize,
        /// Its first word.
        found: String,
    },
    /// Text that is not hex.
    #[error(
        "line {line}: expected bytes as two hex digits each (a comment begins with `;`), found `{found}`"
    )]
    NotHex {
        /// From 1 on.
        line: usize,
        /// The word that is no byte.
        found: String,
    },
    /// A candump log with a line of another kind.
    #[error(
        "line {line}: expected a candump line such as `(1700000000.000001) can0 18FEF100#0102`, found `{found}`"
    )]
    NotCandump {
        /// From 1 on.
        line: usize,
        /// How it begins.
        found: String,
    },
    /// A line of text that does not keep to what the lines before it say.
    #[error("line {line}: expected {expected}, found `{found}`")]
    Line {
        /// From 1 on.
        line: usize,
        /// What should stand there.
        expected: String,
        /// What does.
        found: String,
    },
    /// An MCAP file of somebody else.
    #[error(
        "an MCAP file without a recorded stream: expected channels such as `/lms111/from_device` with message encoding `bytes`, or `sensor_msgs/msg/LaserScan` of a ROS 2 bag, found {}",
        if found.is_empty() { "none".to_owned() } else { found.join(", ") }
    )]
    NoStreams {
        /// The topics it has.
        found: Vec<String>,
    },
    /// An MCAP file compressed by something that MCAP does not name, or that this build cannot unpack.
    #[error("{}", compressed(found))]
    Compressed {
        /// The compressor.
        found: String,
    },
}

/// What is said of an MCAP file compressed by `found`.
fn compressed(found: &str) -> String {
    let expected = match found {
        "lz4" | "zstd" if cfg!(not(feature = "compressed")) => {
            "which needs the feature `compressed`, which this build leaves out: cargo build --release --features compressed; or"
        }
        _ => "expected lz4, zstd or none;",
    };
    format!(
        "an MCAP file with chunks compressed by `{found}`, {expected} write it anew with `mcap compress --compression none`"
    )
}

impl From<io::Error> for ReadError {
    fn from(error: io::Error) -> Self {
        match error.downcast::<BrokenArchive>() {
            Ok(broken) => Self::Archive(broken),
            Err(error) if error.kind() == io::ErrorKind::FileTooLarge => Self::TooLarge(error),
            Err(error) => Self::Io(error),
        }
    }
}

/// A recording being read.
pub struct Recording {
    format: Format,
    about: About,
    streams: Vec<StreamInfo>,
    began_ns: Option<u64>,
    torn: Option<Torn>,
    clock_back: Option<ClockBack>,
    missing_bytes: Option<MissingBytes>,
    packets: Packets,
    watch: soundness::Watch,
}

enum Packets {
    Mcap(Box<McapReader>),
    /// Read as a whole when the file was opened.
    Listed(std::vec::IntoIter<Packet>),
    /// With the bytes read last.
    Raw(Box<dyn Read + Send>, Tail),
}

impl std::fmt::Debug for Recording {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Recording").field("format", &self.format).field("streams", &self.streams).finish()
    }
}

impl Recording {
    /// Opens a file and recognises its format; `-` is standard input, which is read once.
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        Self::open_apart(path, &[])
    }

    /// The same; of a capture, the connections of these names (see [`StreamInfo::connections`]) are streams of their own, and no part of
    /// the streams they belong to. Other names are passed over.
    pub fn open_apart(path: &Path, connections: &[&str]) -> Result<Self, ReadError> {
        let input: Box<dyn Read + Send> = match path == Path::new(STDIN) {
            true => Box::new(stdin_once()?),
            false => Box::new(rowscan_files::open(path)?),
        };
        Self::read_apart(input, connections)
    }

    /// Reads a recording from any bytes; never panics, whatever they are.
    pub fn read(input: Box<dyn Read + Send>) -> Result<Self, ReadError> {
        Self::read_apart(input, &[])
    }

    fn read_apart(input: Box<dyn Read + Send>, connections: &[&str]) -> Result<Self, ReadError> {
        let (mut head, mut input) = gzip::unpacked(input)?;
        if head.is_empty() {
            return Err(ReadError::Empty);
        }
        if let Some(what) = format::foreign(&head) {
            return Err(ReadError::Foreign { what });
        }
        // Spreadsheets put a byte order mark before text.
        if head.starts_with(BYTE_ORDER_MARK) {
            head.drain(..BYTE_ORDER_MARK.len());
        }
        let format = Format::of(&head);
        let kind = language(&head);
        input = Box::new(Cursor::new(head).chain(input));
        if !matches!(format, Format::Mcap | Format::Raw) {
            input = Box::new(Bounded::new(input, MOST_BYTES_WHOLE));
        }
        let scanner = |kind| StreamInfo::new("scanner", kind);
        let mut recording = Self {
            format,
            about: About::default(),
            streams: Vec::new(),
            began_ns: None,
            torn: None,
            clock_back: None,
            missing_bytes: None,
            packets: Packets::Listed(Vec::new().into_iter()),
            watch: soundness::Watch::default(),
        };
        match format {
            Format::Mcap => recording.packets = Packets::Mcap(Box::new(McapReader::new(input))),
            Format::Raw => {
                recording.streams.push(scanner(kind));
                recording.packets = Packets::Raw(input, Tail::new(kind));
            }
            Format::Capture => {
                let mut bytes = Vec::new();
                input.read_to_end(&mut bytes)?;
                let capture = capture::read(&bytes).unwrap_or_default();
                drop(bytes);
                recording.began_ns = capture.began_ns;
                recording.torn = capture.torn;
                recording.clock_back = capture.clock_back;
                let (mut packets, mut streams) = sides::packets(capture.connections, connections);
                capture.datagrams.join(&mut packets, &mut streams);
                recording.missing_bytes = MissingBytes::of(&packets, capture.cut_packets);
                recording.streams = streams;
                recording.packets = Packets::Listed(packets.into_iter());
            }
            Format::Hex => {
                let text = text(input)?;
                let (packets, torn) = lines(&text, |text| match dump::packets(text)? {
                    Some(packets) => Ok(packets),
                    None => hex::packets(text),
                })?;
                if packets.is_empty() {
                    return Err(ReadError::Empty);
                }
                let bytes: Vec<u8> = packets.iter().flat_map(|packet| packet.bytes.iter().copied()).collect();
                let kind = language(&bytes);
                recording.torn = torn.or_else(|| last_line_torn(&text, kind, packets.last()));
                recording.streams.push(scanner(kind));
                recording.packets = Packets::Listed(packets.into_iter());
            }
            Format::Telegrams => {
                recording.streams.push(scanner(StreamKind::Cola));
                let (packets, torn) = lines(&text(input)?, words::packets)?;
                recording.packets = Packets::Listed(packets.into_iter());
                recording.torn = torn;
            }
            Format::WiresharkJson => {
                recording.streams.push(scanner(StreamKind::Cola));
                let (packets, torn) = wireshark::packets(&text(input)?)?;
                recording.packets = Packets::Listed(packets.into_iter());
                recording.torn = torn;
            }
            Format::Carmen => {
                let ((packets, streams), torn) = lines(&text(input)?, carmen::packets)?;
                recording.streams = streams;
                recording.packets = Packets::Listed(packets.into_iter());
                recording.torn = torn;
            }
            Format::Candump => {
                let ((packets, interfaces), torn) = lines(&text(input)?, candump::packets)?;
                recording.torn = torn;
                recording.streams =
                    interfaces.into_iter().map(|name| StreamInfo::new(name, StreamKind::Can)).collect();
                recording.packets = Packets::Listed(packets.into_iter());
            }
            Format::Ranges => {
                let ((packets, about), torn) = lines(&text(input)?, ranges::packets)?;
                recording.about = about;
                recording.torn = torn;
                recording.streams.push(scanner(StreamKind::Cola));
                recording.packets = Packets::Listed(packets.into_iter());
            }
        }
        Ok(recording)
    }

    /// What kind of file it is.
    pub fn format(&self) -> Format {
        self.format
    }

    /// True if the host's times of all its packets are known, as far as it is read.
    pub(crate) fn has_times(&self) -> bool {
        let is_known = match &self.packets {
            Packets::Listed(packets) => packets.as_slice().iter().all(|packet| packet.at_ns.is_some()),
            Packets::Mcap(_) | Packets::Raw(..) => true,
        };
        self.format.has_times() && is_known
    }

    /// When a packet of it came by the host's clock, nanoseconds; none where only the scanner's is known.
    pub fn host_ns(&self, packet: &Packet) -> Option<u64> {
        packet.at_ns.filter(|_| !self.about().by_device_clock)
    }

    /// What it is of, as far as the file says and was read.
    pub fn about(&self) -> &About {
        match &self.packets {
            Packets::Mcap(reader) => &reader.about,
            _ => &self.about,
        }
    }

    /// The streams met so far; all of them once the last packet was read.
    pub fn streams(&self) -> &[StreamInfo] {
        match &self.packets {
            Packets::Mcap(reader) => &reader.streams,
            _ => &self.streams,
        }
    }

    /// What the bytes of its first scanner's stream are, of those met so far; of none, of its first stream.
    pub fn main_kind(&self) -> StreamKind {
        let mut kinds = self.streams().iter().map(|stream| stream.kind);
        let first = kinds.clone().next().unwrap_or(StreamKind::Bytes);
        kinds.find(|kind| kind.is_scanner()).unwrap_or(first)
    }

    /// When it begins: the time of the first packet, of any protocol.
    pub fn began_ns(&self) -> Option<u64> {
        self.began_ns
    }

    /// Where the file breaks off, once the last packet was read.
    pub fn torn(&self) -> Option<&Torn> {
        match &self.packets {
            Packets::Mcap(reader) => reader.torn(),
            _ => self.torn.as_ref(),
        }
    }

    /// Where the clock of a capture was set back; none of other files.
    pub fn clock_back(&self) -> Option<ClockBack> {
        self.clock_back
    }

    /// What a capture lacks of the connections that it holds; none of other files.
    pub fn missing_bytes(&self) -> Option<MissingBytes> {
        self.missing_bytes
    }

    /// How much of what was read so far can be read as telegrams.
    pub fn soundness(&self) -> Soundness {
        self.watch.found()
    }

    /// The next packet, in the order they came; none at the end.
    pub fn next_packet(&mut self) -> Result<Option<Packet>, ReadError> {
        let packet = match &mut self.packets {
            Packets::Mcap(reader) => reader.next()?,
            Packets::Listed(packets) => packets.next(),
            Packets::Raw(input, tail) => {
                let mut bytes = Vec::new();
                input.by_ref().take(CHUNK as u64).read_to_end(&mut bytes)?;
                tail.push(&bytes);
                if bytes.is_empty() {
                    self.torn = tail.torn();
                }
                (!bytes.is_empty()).then(|| Packet { bytes, ..Packet::default() })
            }
        };
        if let (None, Some(at_ns)) = (self.began_ns, packet.as_ref().and_then(|packet| packet.at_ns)) {
            self.began_ns = Some(at_ns);
        }
        match &packet {
            Some(packet) => {
                let kind = self.streams().get(packet.stream).map_or(StreamKind::Bytes, |stream| stream.kind);
                self.watch.see(kind, packet);
            }
            None => self.watch.end(),
        }
        Ok(packet)
    }
}

/// Standard input, of which a second reader would get what the first one has left: there is one a process, and so there is one mark of it.
fn stdin_once() -> Result<io::Stdin, ReadError> {
    static TAKEN: AtomicBool = AtomicBool::new(false);
    match TAKEN.swap(true, Ordering::Relaxed) {
        true => Err(ReadError::StdinTwice),
        false => Ok(io::stdin()),
    }
}

/// The protocol of raw bytes: the one that more of them are valid telegrams of. A frame of CoLa A has no checksum, and two bytes of
/// an LMS2xx scan may look like one: only what is a telegram counts.
fn language(bytes: &[u8]) -> StreamKind {
    let mut decoder = FrameDecoder::new(Accept::Either, MAX_PAYLOAD);
    decoder.push(bytes);
    let mut cola = 0;
    while let Some(frame) = decoder.next_frame() {
        if Telegram::parse(frame.dialect, frame.payload).is_ok() {
            cola += frame.len;
        }
    }
    let mut decoder = lms2xx::frame::FrameDecoder::new(lms2xx::frame::Listener::Either);
    decoder.push(bytes);
    let mut lms2xx = 0;
    while let Some(received) = decoder.next_received() {
        if let lms2xx::frame::Received::Frame(frame) = received {
            lms2xx += frame.len;
        }
    }
    let mut decoder = compact::StreamDecoder::default();
    decoder.push(bytes);
    let mut compact = 0;
    while let Some(found) = decoder.next_found() {
        if let compact::Found::Telegram { len, .. } = found {
            compact += len;
        }
    }
    // Only telegrams with a right CRC count, so none is there by chance. Where none of any kind is whole, their start tells.
    let begins = || (0..bytes.len()).any(|at| bytes.get(at..).is_some_and(compact::begins));
    if compact > cola.max(lms2xx) || (cola.max(lms2xx) == 0 && begins()) {
        return StreamKind::Compact;
    }
    if lms2xx > cola { StreamKind::Lms2xx } else { StreamKind::Cola }
}

/// What `read` makes of a text. A last line without its end, which cannot be read, is where the text breaks off.
fn lines<T>(text: &str, read: impl Fn(&str) -> Result<T, ReadError>) -> Result<(T, Option<Torn>), ReadError> {
    let why = match read(text) {
        Ok(found) => return Ok((found, None)),
        Err(why) => why,
    };
    let whole = text.rfind('\n').and_then(|end| text.split_at_checked(end + 1));
    let Some((whole, rest)) = whole.filter(|(_, rest)| !rest.is_empty()) else { return Err(why) };
    // Where a line before it is wrong as well, that is what is to be told.
    let found = read(whole).map_err(|_| why)?;
    let begins: String = rest.chars().take(40).collect();
    let torn = Torn {
        offset: whole.len() as u64,
        expected: "a whole line",
        found: format!("`{begins}`"),
        resumed: None,
    };
    Ok((found, Some(torn)))
}

/// A text of bytes whose last line has no end and ends inside a telegram.
fn last_line_torn(text: &str, kind: StreamKind, last: Option<&Packet>) -> Option<Torn> {
    let mut tail = Tail::new(kind);
    tail.push(&last?.bytes);
    let torn = tail.torn().filter(|_| !text.ends_with('\n'))?;
    Some(Torn { offset: text.rfind('\n').map_or(0, |end| end + 1) as u64, ..torn })
}

fn text(mut input: Box<dyn Read + Send>) -> Result<String, ReadError> {
    let mut bytes = Vec::new();
    input.read_to_end(&mut bytes)?;
    if bytes.iter().filter(|byte| **byte == b'\n').count() > MOST_LINES {
        let why = format!("expected at most {MOST_LINES} lines, found more");
        return Err(ReadError::TooLarge(io::Error::new(io::ErrorKind::FileTooLarge, why)));
    }
    // What is UTF-8 is not copied.
    Ok(String::from_utf8(bytes)
        .unwrap_or_else(|error| String::from_utf8_lossy(error.as_bytes()).into_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_protocol::frame::{Dialect, encode};

    #[test]
    fn a_byte_order_mark_is_no_part_of_a_text() {
        let recording = Recording::read(Box::new(&b"\xEF\xBB\xBF02 73 03\n"[..])).expect("it opens");
        assert_eq!(recording.format(), Format::Hex);
        let table = "\u{feff}# rowscan ranges 1; frequency_hz 50; start_deg 0; step_deg 1; unit mm\ntime_s,telegram_counter,scan_time_us,range_0\n0,1,2,3\n";
        let recording = Recording::read(Box::new(table.as_bytes())).expect("it opens");
        assert_eq!(recording.format(), Format::Ranges);
    }

    #[test]
    fn a_text_that_ends_inside_a_line_is_read_up_to_there() {
        let flaser = format!("FLASER 181{} 0 0 0 0 0 0 1 host 1", " 1.0".repeat(181));
        for (text, cut, packets) in [
            ("02 73 03\n02 73 03\n".to_owned(), 1, 1),
            ("(1.0) can0 123#00\n(2.0) can0 123#00\n".to_owned(), 3, 1),
            ("# rowscan ranges 1; frequency_hz 50; start_deg 0; step_deg 1; unit mm\ntime_s,telegram_counter,scan_time_us,range_0\n0,1,2,3\n0,1,2,3\n".to_owned(), 3, 1),
            (format!("# CARMEN Logfile\n{flaser}\n{flaser}\n"), 40, 1),
            ("sRN DeviceIdent\nsRN STlms\n".to_owned(), 6, 1),
        ] {
            // The last line loses its end, and a part of itself.
            let mut text = text;
            text.truncate(text.trim_end().len() - cut);
            let mut recording = Recording::read(Box::new(Cursor::new(text.clone()))).expect(&text);
            let found = std::iter::from_fn(|| recording.next_packet().expect("it reads")).count();
            let begins = text.rfind('\n').expect("a line before") as u64 + 1;
            let torn = recording.torn().map(|torn| torn.offset);
            assert_eq!((found, torn), (packets, Some(begins)), "{text}");
        }
        let wrong = Recording::read(Box::new(&b"02 73 03\nhello\n02 7"[..])).expect_err("no hex");
        assert!(wrong.to_string().starts_with("line 2: "), "{wrong}");
    }

    #[test]
    fn raw_bytes_are_taken_for_the_scanner_that_speaks_so() {
        let (mut cola, mut lms2xx) = (Vec::new(), Vec::new());
        encode(Dialect::B, b"sRA LMDscandata ", &mut cola);
        lms2xx::frame::encode(lms2xx::frame::FROM_DEVICE, &[0xA0, 0, 0x10], &mut lms2xx);
        let damaged = |mut bytes: Vec<u8>| {
            bytes[20] ^= 1;
            bytes
        };
        let chance = b"\x02\x80\x0c\x00\xb0\x04\x40\xe8\x03\x10\x02\x73\x03\xe8\x03\x10\x08\xb1".to_vec();
        let mut imu = Vec::new();
        compact::Telegram::Imu(compact::Imu::default()).encode(&mut imu).unwrap();
        for (bytes, expected) in [
            (cola.clone(), StreamKind::Cola),
            ([&[0x06][..], &lms2xx].concat(), StreamKind::Lms2xx),
            ([lms2xx, cola].concat(), StreamKind::Cola),
            (b"\xFF\x00nothing of either".to_vec(), StreamKind::Cola),
            // Ranges of 371 and 1000 mm contain `02 73 03`, a frame of CoLa A.
            (chance, StreamKind::Lms2xx),
            (imu.clone(), StreamKind::Compact),
            (damaged(imu), StreamKind::Compact),
        ] {
            let recording = Recording::read(Box::new(Cursor::new(bytes))).expect("it opens");
            assert_eq!(recording.streams()[0].kind, expected);
        }
    }
}
