//! Which stream of a recording is read where none is named.

use std::collections::{BTreeMap, BTreeSet};

use crate::scan_reader::{MAX_PAYLOAD, ScanReader};
use crate::{ReadError, Recording, Side};

/// Packets that are looked at: minutes of one scanner, and many seconds of several.
const MOST_AHEAD: usize = 4096;

/// Names of a recording's streams that hold scans, as far as its first packets tell, in the order of their names: which scanner connected first is the
/// host's doing. Where none is named the first one is read.
///
/// # Errors
/// As [`Recording::next_packet`].
pub fn streams_with_scans(mut recording: Recording) -> Result<BTreeSet<String>, ReadError> {
    let mut readers: BTreeMap<usize, Option<ScanReader>> = BTreeMap::new();
    let mut found = BTreeSet::new();
    for _ in 0..MOST_AHEAD {
        let Some(packet) = recording.next_packet()? else { break };
        let Some(stream) = recording.streams().get(packet.stream) else { continue };
        if packet.from == Some(Side::Host) || found.contains(&stream.name) {
            continue;
        }
        let reader =
            readers.entry(packet.stream).or_insert_with(|| ScanReader::new(stream.kind, MAX_PAYLOAD));
        if let Some(reader) = reader {
            reader.push(std::time::Duration::ZERO, &packet);
            if reader.next_scan().is_some() {
                found.insert(stream.name.clone());
            }
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;
    use crate::{About, Decoded, McapWriter, StreamKind};

    const SCAN: &[u8] = b"\x02sSN LMDscandata 1 1 16F4C7A 0 0 7 9 3E8 4B0 0 0 4 0 0 1388 168 0 1 DIST1 3F800000 00000000 FFF92230 1388 3 3E8 0 7D0 0 0 0 0 0 0\x03";

    /// Streams that are declared, and bring packets, in this order.
    fn names(packets: &[(&str, &[u8])]) -> Vec<String> {
        let mut writer =
            McapWriter::new(Cursor::new(Vec::new()), &About::default(), Decoded::default()).unwrap();
        for (at_ns, (name, bytes)) in (1..).zip(packets) {
            let stream = writer.add_stream(name, StreamKind::Cola).unwrap();
            writer.write(stream, Side::Device, at_ns, 0, bytes).unwrap();
        }
        writer.finish().unwrap();
        let file = Cursor::new(writer.into_inner().into_inner());
        streams_with_scans(Recording::read(Box::new(file)).unwrap()).unwrap().into_iter().collect()
    }

    #[test]
    fn the_order_of_arrival_does_not_choose() {
        let answer: &[u8] = b"\x02sRA STlms 7\x03";
        for packets in [[("left", SCAN), ("right", SCAN)], [("right", SCAN), ("left", SCAN)]] {
            assert_eq!(names(&packets), ["left", "right"]);
        }
        assert_eq!(names(&[("left", answer), ("right", SCAN)]), ["right"], "one without scans is no choice");
        assert!(names(&[("left", answer)]).is_empty());
    }
}
