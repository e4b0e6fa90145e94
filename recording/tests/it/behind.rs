//! What stands behind the end of a file is none of it, and is told.

use std::io::Cursor;

use rowscan_recording::{About, Decoded, McapWriter, Recording, Side, StreamKind};

fn file(packets: u64) -> Vec<u8> {
    let mut writer = McapWriter::new(Cursor::new(Vec::new()), &About::default(), Decoded::default()).unwrap();
    let stream = writer.add_stream("left", StreamKind::Cola).unwrap();
    for at_ns in 0..packets {
        writer.write(stream, Side::Device, at_ns, 0, b"\x02sRA STlms 7\x03").unwrap();
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

/// Packets, and what is told of the rest.
fn read(bytes: Vec<u8>) -> (u64, Option<String>) {
    let mut recording = Recording::read(Box::new(Cursor::new(bytes))).unwrap();
    let mut packets = 0;
    while recording.next_packet().unwrap().is_some() {
        packets += 1;
    }
    (packets, recording.torn().map(ToString::to_string))
}

/// What is left of a file that was cut does not go on in the next one.
#[test]
fn a_file_joined_to_one_that_was_cut_is_none_of_it() {
    let (one, other) = (file(40), file(7));
    for cut in [one.len() * 6 / 10, one.len() * 8 / 10] {
        let alone = read(one[..cut].to_vec());
        let (packets, told) = read([&one[..cut], &other[..]].concat());
        assert_eq!(packets, alone.0);
        assert!(told.unwrap().contains("broken off"), "at {cut}");
    }
}

#[test]
fn bytes_behind_the_end_are_told_and_a_whole_file_is_whole() {
    let one = file(9);
    assert_eq!(read(one.clone()), (9, None));
    for behind in [file(4), vec![0; 1], vec![7; 3_000_000]] {
        let (packets, told) = read([one.clone(), behind.clone()].concat());
        let told = told.unwrap();
        let place = format!("at byte {}: expected the end of the file", one.len());
        assert!(packets == 9 && told.contains(&place), "{told}");
        assert!(told.contains(&format!("{} bytes are lost", behind.len())), "{told}");
    }
}
