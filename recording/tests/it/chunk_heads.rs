//! What a damaged head of a chunk says of its records is not needed: they lie in the file like others, behind the records of their channels.

use std::io::Cursor;

use rowscan_recording::{About, Decoded, McapWriter, Recording, Side, StreamKind};

/// Of one chunk without compression.
fn file(packets: u64) -> Vec<u8> {
    let mut writer =
        McapWriter::indexed(Cursor::new(Vec::new()), &About::default(), Decoded::default()).unwrap();
    let stream = writer.add_stream("left", StreamKind::Cola).unwrap();
    for at_ns in 0..packets {
        writer.write(stream, Side::Device, at_ns, 0, b"\x02sRA STlms 7\x03").unwrap();
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

fn packets(bytes: Vec<u8>) -> (u64, bool) {
    let mut recording = Recording::read(Box::new(Cursor::new(bytes))).unwrap();
    let mut packets = 0;
    while recording.next_packet().unwrap().is_some() {
        packets += 1;
    }
    (packets, recording.torn().is_some())
}

/// Where the chunk begins: records have a kind and a length.
fn chunk(bytes: &[u8]) -> usize {
    let mut at = 8;
    while bytes[at] != 0x06 {
        at += 9 + u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize;
    }
    at
}

#[test]
fn a_flipped_bit_in_the_lengths_of_a_chunks_head_costs_no_packet() {
    let whole = file(20);
    assert_eq!(packets(whole.clone()), (20, false));
    // Times, size and checksum of 28 bytes; then the length of the compression's name, and that of the records.
    let lengths = chunk(&whole) + 9 + 28;
    for bit in 8 * lengths..8 * (lengths + 12) {
        let mut flipped = whole.clone();
        flipped[bit / 8] ^= 1 << (bit % 8);
        let (found, _) = packets(flipped);
        assert_eq!(found, 20, "bit {bit}");
    }
}
