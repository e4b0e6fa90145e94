//! What a file is: recognised by its first bytes, never by its name.

use std::fmt;

use rowscan_protocol::can::CandumpLine;

use super::{carmen, ranges, wireshark, words};

/// Kinds of files that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// MCAP, ours.
    Mcap,
    /// A network capture, pcap or pcapng.
    Capture,
    /// A log of CAN frames as candump writes it.
    Candump,
    /// Ranges as text, with a header that says how they were measured.
    Ranges,
    /// Telegrams as text, one a line, without their frames.
    Telegrams,
    /// A log of the CARMEN toolkit.
    Carmen,
    /// Packets as Wireshark exports them.
    WiresharkJson,
    /// Bytes in hex.
    Hex,
    /// Bytes as they went over the wire.
    Raw,
}

/// First bytes of MCAP.
const MCAP: &[u8] = b"\x89MCAP";

/// First bytes of captures, in either byte order.
const CAPTURES: [[u8; 4]; 5] = [
    [0x0A, 0x0D, 0x0D, 0x0A],
    [0xA1, 0xB2, 0xC3, 0xD4],
    [0xD4, 0xC3, 0xB2, 0xA1],
    [0xA1, 0xB2, 0x3C, 0x4D],
    [0x4D, 0x3C, 0xB2, 0xA1],
];

/// Files that people take for recordings, by their first bytes, and what to do with them.
const OTHERS: [(&[u8], &str); 15] = [
    (b"\x1F\x8B\x08", "a gzip archive that was packed twice: unpack it once with `gunzip` first"),
    (b"\x28\xB5\x2F\xFD", "a Zstandard archive: unpack it with `zstd -d` first"),
    (b"\xFD7zXZ\0", "an xz archive: unpack it with `unxz` first"),
    (b"BZh", "a bzip2 archive: unpack it with `bunzip2` first"),
    (b"PK\x03\x04", "a ZIP archive: unpack it first"),
    (b"#ROSBAG V", "a ROS 1 bag: record the scanner's bytes with `rowscan record` or tcpdump instead"),
    (
        b"SQLite format 3\0",
        "an SQLite database, as ROS 2 bags are: `ros2 bag convert` it, or record the scanner's bytes",
    ),
    (b"\x89PNG\r\n", "a PNG picture"),
    (b"\xFF\xD8\xFF", "a JPEG picture"),
    (b"\x7FELF", "a program"),
    (b"%PDF-", "a PDF document"),
    (b"LASF", "a LAS point cloud: points are no scans"),
    (b"PAR1", "a Parquet table: `rowscan export` writes such files and does not read them"),
    (b"\x93NUMPY", "a NumPy array: `rowscan export` writes such files and does not read them"),
    (b"\x89HDF\r\n", "an HDF5 file"),
];

/// What a file is that is no recording of any kind, in words, if it begins like one that is known.
pub(super) fn foreign(head: &[u8]) -> Option<&'static str> {
    OTHERS.iter().find(|(magic, _)| head.starts_with(magic)).map(|(_, what)| *what)
}

impl Format {
    /// True if such a file says when its packets came, and who sent them.
    pub fn has_times(self) -> bool {
        match self {
            Self::Mcap
            | Self::Capture
            | Self::Candump
            | Self::Ranges
            | Self::Carmen
            | Self::WiresharkJson => true,
            Self::Telegrams | Self::Hex | Self::Raw => false,
        }
    }

    /// What begins with these bytes: a file's first 64 KiB, or all of a shorter one.
    pub fn of(head: &[u8]) -> Self {
        if head.starts_with(MCAP) {
            return Self::Mcap;
        }
        if CAPTURES.iter().any(|magic| head.starts_with(magic)) {
            return Self::Capture;
        }
        if !is_text(head) {
            return Self::Raw;
        }
        let text = String::from_utf8_lossy(head);
        let mut lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
        let first = lines.clone().next().unwrap_or_default();
        let content = lines.find(|line| !line.starts_with([';', '#'])).unwrap_or_default();
        if first.starts_with(ranges::TITLE) {
            Self::Ranges
        } else if CandumpLine::parse(first).is_some() {
            Self::Candump
        } else if carmen::is_log(first) || carmen::is_log(content) {
            Self::Carmen
        } else if wireshark::is_export(&text) {
            Self::WiresharkJson
        } else if words::is_telegram(content) {
            Self::Telegrams
        } else {
            Self::Hex
        }
    }
}

/// Frames hold control characters, so no recorded bytes are taken for text.
fn is_text(bytes: &[u8]) -> bool {
    let printable = |b: &u8| matches!(b, b'\t' | b'\n' | b'\r' | b' '..=b'~' | 0x80..);
    bytes.iter().all(printable)
        && match std::str::from_utf8(bytes) {
            Ok(_) => true,
            // The head of a longer text may end inside a letter.
            Err(error) => error.error_len().is_none(),
        }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Mcap => "MCAP",
            Self::Capture => "network capture",
            Self::Candump => "candump log",
            Self::Ranges => "CSV of ranges",
            Self::Telegrams => "telegrams as text",
            Self::Carmen => "CARMEN log",
            Self::WiresharkJson => "Wireshark JSON",
            Self::Hex => "hex text",
            Self::Raw => "raw bytes",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn content_decides() {
        for (head, expected) in [
            (&b"\x89MCAP0\r\n"[..], Format::Mcap),
            (b"\xD4\xC3\xB2\xA1\x02\0\x04\0", Format::Capture),
            (b"\x0A\x0D\x0D\x0A\x1C\0\0\0", Format::Capture),
            (b"(1700000000.000001) can0 18FEF100#0102\n", Format::Candump),
            (b"# rowscan ranges 1; model lms111\n", Format::Ranges),
            (b"02 73 03", Format::Hex),
            (b"; notes\n02 73 03", Format::Hex),
            (b"# notes\nsRN DeviceIdent\n", Format::Telegrams),
            (b"<STX>sRA STlms 7 0 8 12:00:00 8 01.01.2020 0 0 0<ETX>\n", Format::Telegrams),
            (b"# CARMEN Logfile\n# file format is one message per line\n", Format::Carmen),
            (b"# notes\nFLASER 180 1.0 1.0", Format::Carmen),
            (b"\x02sRN DeviceIdent\x03", Format::Raw),
            (b"\x02\x02\x02\x02\0\0\0\x07sMN Run\x19", Format::Raw),
            (b"\xFF\xD8\xFF\xE0", Format::Raw),
        ] {
            assert_eq!(Format::of(head), expected, "{head:?}");
        }
        assert!(foreign(b"PK\x03\x04more").is_some_and(|what| what.contains("unpack")));
        assert_eq!(foreign(b"\x02\x02\x02\x02"), None);
    }
}
