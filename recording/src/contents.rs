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
    let mut counts: BTreeMap<[String; 2], u64> = BTreeMap::new();
    while let Some(frame) = frames.next_frame()? {
        *counts.entry(name(&frame)).or_default() += 1;
    }
    let mut counts: Vec<([String; 2], u64)> = counts.into_iter().collect();
    counts.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    let rest: u64 = counts.iter().skip(MAX_NAMES).map(|(_, count)| count).sum();
    counts.truncate(MAX_NAMES);
    let counted = |([one, several], count): ([String; 2], u64)| plural(count, &one, &several).to_string();
    let mut words: Vec<String> = counts.into_iter().map(counted).collect();
    if rest > 0 {
        words.push(plural(rest, "other", "others").to_string());
    }
    Ok((!words.is_empty()).then(|| words.join(", ")))
}

/// What one is called, and what several are: a telegram's name is the same for both.
fn name(frame: &RecordedFrame) -> [String; 2] {
    match frame.kind {
        StreamKind::Lms2xx => ["LMS2xx telegram that is no scan", "LMS2xx telegrams that are no scans"],
        StreamKind::Compact => [
            "Compact telegram that makes no whole turn of a scanner of one line",
            "Compact telegrams that make no whole turn of a scanner of one line",
        ],
        StreamKind::Nmea => ["NMEA packet", "NMEA packets"],
        StreamKind::Can => ["CAN frame", "CAN frames"],
        StreamKind::Bytes => ["packet of unknown content", "packets of unknown content"],
        StreamKind::Cola => match cola_name(frame.payload()) {
            Some("LMDscandata") => ["LMDscandata without a scan that can be read"; 2],
            Some(name) => [name; 2],
            None if frame.dialect == Some(Dialect::B) => {
                ["CoLa B frame that is no telegram", "CoLa B frames that are no telegrams"]
            }
            None => ["CoLa A frame that is no telegram", "CoLa A frames that are no telegrams"],
        },
    }
    .map(str::to_owned)
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
