//! Packets as Wireshark exports them in JSON (`tshark -T json`), and as SICK's own driver keeps its recordings (`*.pcapng.json`): of each packet
//! its time and the hex of its TCP payload are read.
//!
//! ```text
//! [ { "_source": { "layers": {
//!     "frame": { "frame.time_epoch": "1614675600.0028" }, "tcp": { "tcp.payload": "02:73:52:4e:20:…:03" } } } }, … ]
//! ```
//! Such a file has the packets in the order in which they came; what was sent twice stands in it twice. Who sent a packet is told by its telegram.

use std::fmt;

use serde::Deserialize;
use serde::de::{DeserializeSeed, Deserializer, SeqAccess, Visitor};

use super::{ReadError, Torn, hex, sides};
use crate::{Joint, Packet, Side};

/// Whether a text begins so.
pub(super) fn is_export(head: &str) -> bool {
    head.trim_start().starts_with('[') && head.contains("\"_source\"") && head.contains("\"layers\"")
}

#[derive(Deserialize)]
struct Exported {
    #[serde(rename = "_source")]
    source: Source,
}

#[derive(Deserialize)]
struct Source {
    layers: Layers,
}

/// What of a packet is read; all else is passed over.
#[derive(Deserialize)]
struct Layers {
    #[serde(default)]
    frame: Frame,
    #[serde(default)]
    tcp: Tcp,
}

#[derive(Default, Deserialize)]
struct Frame {
    #[serde(rename = "frame.time_epoch")]
    epoch: Option<Seconds>,
    #[serde(rename = "frame.time_relative")]
    relative: Option<Seconds>,
}

#[derive(Default, Deserialize)]
struct Tcp {
    #[serde(rename = "tcp.payload")]
    payload: Option<String>,
}

/// Seconds, which stand there as a text.
#[derive(Deserialize)]
#[serde(untagged)]
enum Seconds {
    Text(String),
    Number(f64),
}

impl Seconds {
    /// Nanoseconds; none where it is no time, such as a date of newer versions.
    fn ns(&self) -> Option<u64> {
        match self {
            // A double would lose the nanoseconds of an epoch.
            Self::Text(text) => {
                let (seconds, fraction) = text.trim().split_once('.').unwrap_or((text.trim(), ""));
                let digits: String = fraction.chars().chain("000000000".chars()).take(9).collect();
                seconds.parse::<u64>().ok()?.checked_mul(1_000_000_000)?.checked_add(digits.parse().ok()?)
            }
            Self::Number(seconds) => (0.0..1e10).contains(seconds).then(|| (seconds * 1e9).round() as u64),
        }
    }
}

/// The packets with bytes, and where the file breaks off.
pub(super) fn packets(text: &str) -> Result<(Vec<Packet>, Option<Torn>), ReadError> {
    let mut packets = Vec::new();
    let mut json = serde_json::Deserializer::from_str(text);
    let ended = Packets(&mut packets).deserialize(&mut json).and_then(|()| json.end());
    let torn = match ended {
        Ok(()) => None,
        // All packets before it are read.
        Err(error) if error.is_eof() && !packets.is_empty() => Some(Torn {
            offset: text.len() as u64,
            expected: "the end of the packet, and of the list",
            found: "the end of the file".to_owned(),
            resumed: None,
        }),
        Err(error) => {
            return Err(ReadError::Line {
                line: error.line(),
                expected: "packets as Wireshark exports them in JSON, with `_source.layers`".to_owned(),
                found: error.to_string().chars().take(120).collect(),
            });
        }
    };
    Ok((packets, torn))
}

/// Takes the packets of a list one by one, so that those before an error are kept.
struct Packets<'a>(&'a mut Vec<Packet>);

impl<'de> DeserializeSeed<'de> for Packets<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_seq(self)
    }
}

impl<'de> Visitor<'de> for Packets<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a list of packets")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<(), A::Error> {
        while let Some(Exported { source: Source { layers } }) = list.next_element()? {
            let Some(bytes) = layers.tcp.payload.as_deref().and_then(payload) else { continue };
            let Frame { epoch, relative } = layers.frame;
            let at_ns = epoch.and_then(|time| time.ns()).or_else(|| relative.and_then(|time| time.ns()));
            // A piece from the middle of a telegram is the device's: hosts send none so long.
            let from = sides::sender([bytes.as_slice()]).unwrap_or(Side::Device);
            self.0.push(Packet { from: Some(from), at_ns, joint: Joint::Anew, bytes, ..Packet::default() });
        }
        Ok(())
    }
}

/// `02:73:03`, with or without what stands between; none if it is no hex, or nothing.
fn payload(text: &str) -> Option<Vec<u8>> {
    let digits: String = text.chars().filter(|c| !matches!(c, ':' | ' ')).collect();
    hex::pairs(&digits).filter(|bytes| !bytes.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Format, Recording};

    /// Two packets as tshark writes them, one without bytes, and one as SICK's converter does.
    const EXPORT: &str = r#"[
  { "_index": "packets", "_source": { "layers": {
      "frame": { "frame.time": "Mar  2, 2021", "frame.time_epoch": "1614675600.250000000", "frame.len": "70" },
      "ip": { "ip.src": "192.168.0.100" }, "tcp": { "tcp.srcport": "50000", "tcp.payload": "02:73:52:4e:20:53:54:6c:6d:73:03" } } } },
  { "_source": { "layers": { "frame": { "frame.time_epoch": "1614675600.251" }, "tcp": { "tcp.srcport": "2112", "tcp.len": "0" } } } },
  { "_source": { "layers": { "frame": { "frame.time_relative": 1.5 }, "tcp": { "tcp.description": "sFA", "tcp.payload": "02:73:46:41:20:33:03" } } } }
]"#;

    fn read(text: &str) -> Result<(Vec<Packet>, Option<Torn>), ReadError> {
        let mut recording = Recording::read(Box::new(std::io::Cursor::new(text.as_bytes().to_vec())))?;
        assert_eq!(recording.format(), Format::WiresharkJson);
        let packets = std::iter::from_fn(|| recording.next_packet().transpose()).collect::<Result<_, _>>()?;
        Ok((packets, recording.torn().cloned()))
    }

    #[test]
    fn each_packet_has_its_time_its_bytes_and_its_sender() {
        let (packets, torn) = read(EXPORT).unwrap();
        let [request, reply] = packets.as_slice() else { panic!("{packets:?}") };
        assert_eq!((request.from, request.at_ns), (Some(Side::Host), Some(1_614_675_600_250_000_000)));
        assert_eq!(request.bytes, b"\x02sRN STlms\x03");
        assert_eq!((reply.from, reply.at_ns), (Some(Side::Device), Some(1_500_000_000)));
        assert_eq!(reply.bytes, b"\x02sFA 3\x03");
        assert_eq!(torn, None);
    }

    #[test]
    fn a_file_that_is_cut_is_read_up_to_there() {
        for length in 0..EXPORT.len() {
            let Some(cut) = EXPORT.get(..length).filter(|cut| is_export(cut)) else { continue };
            match read(cut) {
                Ok((packets, torn)) => assert!(!packets.is_empty() && torn.is_some(), "{length}"),
                Err(ReadError::Line { expected, .. }) => assert!(expected.contains("Wireshark"), "{length}"),
                Err(error) => panic!("{length}: {error}"),
            }
        }
    }

    #[test]
    fn what_is_wrong_is_told_with_its_line() {
        let wrong = EXPORT.replace(
            "\"_source\": { \"layers\": { \"frame\": { \"frame.time_relative\": 1.5",
            "\"layers\": { \"x\": { \"y\": { \"z\": 1.5",
        );
        let error = read(&wrong).unwrap_err().to_string();
        assert!(error.starts_with("line 6: expected packets as Wireshark exports them"), "{error}");
    }
}
