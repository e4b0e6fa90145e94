//! What a recording holds, in words: for a message about one that holds no scan.

use std::collections::BTreeMap;

use rowscan_protocol::frame::Dialect;
use rowscan_protocol::plural::plural;

use crate::frames::{FrameReader, RecordedFrame};
use crate::{ReadError, Recording, StreamKind};

/// Names that are told; a damaged file may hold any number.
const MAX_NAMES: usize = 8;

/// Counts what is in a recording by the telegrams' names, most frequent first: `412 LMDradardata, 3 DeviceIdent`. None if nothing is.
pub fn contents(recording: Recording) -> Result<Option<String>, ReadError> {
    let mut frames = FrameReader::new(recording);
    let mut counts: BTreeMap<String, u64> = BTreeMap::new();
    while let Some(frame) = frames.next_frame()? {
        *counts.entry(name(&frame)).or_default() += 1;
    }
    let mut counts: Vec<(String, u64)> = counts.into_iter().collect();
    counts.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    let rest: u64 = counts.iter().skip(MAX_NAMES).map(|(_, count)| count).sum();
    counts.truncate(MAX_NAMES);
    let mut words: Vec<String> = counts.into_iter().map(|(name, count)| counted(&name, count)).collect();
    if rest > 0 {
        words.push(plural(rest, "other", "others").to_string());
    }
    Ok((!words.is_empty()).then(|| words.join(", ")))
}

/// What has no name of its own: one, and several.
const NAMELESS: [(&str, &str); 7] = [
    ("LMS2xx telegram that is no scan", "LMS2xx telegrams that are no scans"),
    (
        "Compact telegram that makes no whole turn of a scanner of one line",
        "Compact telegrams that make no whole turn of a scanner of one line",
    ),
    ("NMEA packet", "NMEA packets"),
    ("CAN frame", "CAN frames"),
    ("packet of unknown content", "packets of unknown content"),
    ("CoLa B frame that is no telegram", "CoLa B frames that are no telegrams"),
    ("CoLa A frame that is no telegram", "CoLa A frames that are no telegrams"),
];

/// So many of what is called so, in words.
fn counted(name: &str, count: u64) -> String {
    match NAMELESS.into_iter().find(|(_, several)| *several == name) {
        Some((one, several)) => plural(count, one, several).to_string(),
        None => format!("{count} {name}"),
    }
}

fn name(frame: &RecordedFrame) -> String {
    let [lms2xx, compact, nmea, can, bytes, cola_b, cola_a] = NAMELESS.map(|(_, several)| several);
    let other = match frame.kind {
        StreamKind::Lms2xx => lms2xx,
        StreamKind::Compact => compact,
        StreamKind::Nmea => nmea,
        StreamKind::Can => can,
        StreamKind::Bytes => bytes,
        StreamKind::Cola => match cola_name(frame.payload()) {
            Some("LMDscandata") => "LMDscandata without a scan that can be read",
            Some(name) => name,
            None if frame.dialect == Some(Dialect::B) => cola_b,
            None => cola_a,
        },
    };
    other.to_owned()
}

/// The command in `sSN LMDscandata …`.
fn cola_name(payload: &[u8]) -> Option<&str> {
    let [b's', b'A'..=b'Z', b'A'..=b'Z', b' ', rest @ ..] = payload else { return None };
    let end =
        rest.iter().position(|byte| !byte.is_ascii_alphanumeric() && *byte != b'_').unwrap_or(rest.len());
    let name = std::str::from_utf8(rest.get(..end)?).ok()?;
    (1..=40).contains(&name.len()).then_some(name)
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;
    use rowscan_protocol::frame::encode;

    #[test]
    fn telegrams_that_are_no_scans_are_named() {
        let mut bytes = Vec::new();
        for payload in
            [&b"sSN LMDradardata \x01\x02"[..], b"sSN LMDradardata \x01\x03", b"sRA DeviceIdent \0\x03RMS"]
        {
            encode(Dialect::B, payload, &mut bytes);
        }
        let told = contents(Recording::read(Box::new(Cursor::new(bytes))).unwrap()).unwrap();
        assert_eq!(told.as_deref(), Some("2 LMDradardata, 1 DeviceIdent"));
        let noise = contents(Recording::read(Box::new(&b"\xFF\x02s\x03\x00"[..])).unwrap()).unwrap();
        assert_eq!(noise.as_deref(), Some("1 CoLa A frame that is no telegram"));
        assert_eq!(contents(Recording::read(Box::new(&b"\xFF\x00\x01"[..])).unwrap()).unwrap(), None);
    }
}
