//! What a crash leaves of a recording: whole records and at most one torn one, wherever the file breaks off.

use std::io::{self, Cursor, Seek, SeekFrom, Write};

use rowscan_protocol::frame::{Dialect, encode};
use rowscan_recording::{About, Copied, Decoded, McapWriter, Packet, Recording, Side, StreamKind, copy};

/// A file in memory that remembers where each write ended, and how many packets were in it by then.
#[derive(Debug, Default)]
struct Traced {
    file: Cursor<Vec<u8>>,
    boundaries: Vec<usize>,
    room: Option<usize>,
}

impl Write for Traced {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = match self.room {
            Some(room) if self.file.get_ref().len() >= room => return Err(io::ErrorKind::StorageFull.into()),
            Some(room) => self.file.write(&bytes[..bytes.len().min(room - self.file.get_ref().len())])?,
            None => self.file.write(bytes)?,
        };
        self.boundaries.push(self.file.get_ref().len());
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for Traced {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

fn scan(counter: u16) -> Vec<u8> {
    let body = format!(
        "sSN LMDscandata 1 1 16F4C7A 0 0 {counter:X} {counter:X} {:X} {:X} 0 0 4 0 0 1388 168 0 1 DIST1 3F800000 00000000 FFF92230 1388 3 3E8 0 \
         7D0 0 0 0 0 0 0",
        u32::from(counter) * 20_000,
        u32::from(counter) * 20_000 + 250
    );
    let mut bytes = Vec::new();
    encode(Dialect::A, body.as_bytes(), &mut bytes);
    bytes
}

fn sample() -> Vec<(Side, u64, Vec<u8>)> {
    let mut packets = vec![(Side::Host, 1000, b"\x02sEN LMDscandata 1\x03".to_vec())];
    packets.push((Side::Device, 2000, b"\x02sEA LMDscandata 1\x03".to_vec()));
    packets.extend((0..60).map(|i| (Side::Device, 3000 + u64::from(i) * 20_000_000, scan(i))));
    packets
}

/// The whole file, the places its writes ended at, and how many packets were handed over before each.
fn written(decoded: Decoded) -> (Vec<u8>, Vec<(usize, usize)>) {
    let mut writer = McapWriter::new(Traced::default(), &About::default(), decoded).unwrap();
    let stream = writer.add_stream("scanner", StreamKind::Cola).unwrap();
    let mut marks = Vec::new();
    for (number, (from, at_ns, bytes)) in sample().into_iter().enumerate() {
        writer.write(stream, from, at_ns, 0, &bytes).unwrap();
        writer.flush().unwrap();
        marks.push(number + 1);
    }
    writer.finish().unwrap();
    let traced = writer.into_inner();
    // A packet is in the file once the record behind which it stands is: find the end of each by reading prefixes.
    let file = traced.file.into_inner();
    let boundaries = traced.boundaries.iter().map(|&end| (end, read(&file[..end]).0.len())).collect();
    (file, boundaries)
}

fn read(file: &[u8]) -> (Vec<Packet>, bool) {
    let Ok(mut recording) = Recording::read(Box::new(Cursor::new(file.to_vec()))) else {
        return (Vec::new(), true);
    };
    let mut packets = Vec::new();
    while let Ok(Some(packet)) = recording.next_packet() {
        packets.push(packet);
    }
    (packets, recording.torn().is_some())
}

#[test]
fn cut_anywhere_it_opens_and_lacks_nothing_but_its_tail() {
    let (file, boundaries) =
        written(Decoded { scans: true, points: true, beside: true, ..Decoded::default() });
    let sample = sample();
    let check = |cut: usize, at_least: usize| {
        let (packets, torn) = read(&file[..cut]);
        assert!(packets.len() >= at_least, "{} of {at_least} packets in {cut} bytes", packets.len());
        for (packet, (from, at_ns, bytes)) in packets.iter().zip(&sample) {
            assert_eq!((packet.from, packet.at_ns, &packet.bytes), (Some(*from), Some(*at_ns), bytes));
        }
        assert!(torn || packets.len() == sample.len(), "cut at {cut}, and nobody says so");
    };
    boundaries.iter().for_each(|&(cut, packets)| check(cut, packets));
    // 1000 bytes, spread by a multiplier prime to the length.
    let mut place = 12_345_usize;
    for _ in 0..1000 {
        place = (place.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407)) >> 1;
        let cut = place % file.len();
        // What had been written by the last boundary before the cut is there.
        let before = boundaries.iter().filter(|(end, _)| *end <= cut).map(|(_, packets)| *packets).max();
        check(cut, before.unwrap_or_default());
    }
    let (packets, torn) = read(&file);
    assert_eq!((packets.len(), torn), (sample.len(), false));
}

#[test]
fn a_cut_summary_and_a_changed_byte_are_found() {
    let (file, _) = written(Decoded::default());
    for cut in [1, 8, 20, 60] {
        let (packets, torn) = read(&file[..file.len() - cut]);
        assert_eq!((packets.len(), torn), (sample().len(), true), "{cut} bytes are missing");
    }
    // A byte of a message in the middle: only the data section's checksum knows.
    let place = file.windows(4).rposition(|bytes| bytes == b"DIST").unwrap();
    let mut changed = file.clone();
    changed[place] ^= 1;
    assert_eq!(read(&changed), (read(&changed).0, true));
    assert!(!read(&file).1);
}

#[test]
fn a_repaired_file_is_whole_and_holds_what_was_left() {
    let (file, _) = written(Decoded::default());
    let cut = &file[..file.len() / 2];
    let (left, torn) = read(cut);
    assert!(torn && left.len() > 10);
    let mut out = Cursor::new(Vec::new());
    let recording = Recording::read(Box::new(Cursor::new(cut.to_vec()))).unwrap();
    let Copied { recorded, torn: tear, .. } =
        copy(recording, None, &mut out, About::default(), Decoded::default()).unwrap();
    assert!(tear.is_some(), "a copy tells what is missing");
    assert_eq!(recorded.packets, left.len() as u64);
    let (again, torn) = read(out.get_ref());
    assert_eq!((again, torn), (left, false));
}

#[test]
fn a_full_disk_is_an_error_and_what_was_written_opens() {
    for room in [200, 2000, 5000] {
        let full = Traced { room: Some(room), ..Traced::default() };
        let written = McapWriter::new(full, &About::default(), Decoded::default()).and_then(|mut writer| {
            let stream = writer.add_stream("scanner", StreamKind::Cola)?;
            for (from, at_ns, bytes) in sample() {
                writer.write(stream, from, at_ns, 0, &bytes)?;
            }
            Ok(writer)
        });
        let error = written.map(|_| ()).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::StorageFull, "{room}");
        let (file, _) = self::written(Decoded::default());
        let (packets, torn) = read(&file[..room]);
        assert!(torn && (room < 1000 || !packets.is_empty()), "{room}");
    }
}

#[test]
fn lost_packets_leave_a_gap_that_is_seen() {
    let mut writer = McapWriter::new(Cursor::new(Vec::new()), &About::default(), Decoded::default()).unwrap();
    let stream = writer.add_stream("scanner", StreamKind::Cola).unwrap();
    writer.write(stream, Side::Device, 1, 0, &scan(1)).unwrap();
    writer.write(stream, Side::Device, 2, 3, &scan(5)).unwrap();
    writer.finish().unwrap();
    let file = writer.into_inner().into_inner();
    let mut recording = Recording::read(Box::new(Cursor::new(file))).unwrap();
    let report = rowscan_recording::account(&mut recording).unwrap().remove(0);
    assert_eq!((report.packets_lost, report.scans, report.scans_lost), (3, 2, Some(3)));
}

#[test]
fn an_mcap_file_of_somebody_else_names_its_channels() {
    let mut writer = mcap::WriteOptions::new().compression(None).create(Cursor::new(Vec::new())).unwrap();
    writer.add_channel(0, "/camera", "jpeg", &Default::default()).unwrap();
    writer.finish().unwrap();
    let mut recording = Recording::read(Box::new(Cursor::new(writer.into_inner().into_inner()))).unwrap();
    let error = recording.next_packet().unwrap_err().to_string();
    assert!(error.contains("without a recorded stream") && error.contains("/camera"), "{error}");
}

#[test]
fn damage_is_no_panic() {
    let (file, _) = written(Decoded::default());
    let mut place = 99_usize;
    for _ in 0..300 {
        place = place.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let mut damaged = file.clone();
        let at = (place >> 8) % damaged.len();
        damaged[at] ^= 1 << (place % 8);
        read(&damaged);
    }
}
