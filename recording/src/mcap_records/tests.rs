use std::io::Cursor;

use mcap::{WriteOptions, records::MessageHeader};

use super::*;
use crate::read::Resumed;

const MESSAGES: u32 = 60;

/// A message's bytes: zeros, small numbers and records' heads among them, as scans have them.
fn content(number: u32) -> Vec<u8> {
    let head = [&[(number % 16) as u8, 18][..], &[0; 40]].concat();
    [&number.to_le_bytes()[..], &head, &[5, 30, 0, 0, 0, 0, 0, 0, 0, 9, 0], &head].concat()
}

fn file(options: WriteOptions) -> Vec<u8> {
    let mut writer = options.create(Cursor::new(Vec::new())).unwrap();
    let channel = writer.add_channel(0, "/scanner", "bytes", &Default::default()).unwrap();
    for sequence in 0..MESSAGES {
        let header = MessageHeader { channel_id: channel, sequence, log_time: 7, publish_time: 7 };
        writer.write_to_known_channel(&header, &content(sequence)).unwrap();
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

fn plain() -> [Vec<u8>; 2] {
    let chunks = WriteOptions::new().compression(None).chunk_size(Some(1000));
    [file(WriteOptions::new().use_chunks(false)), file(chunks)]
}

/// The numbers of the messages that were read as they were written, how many were not, and what is missing.
fn read(file: &[u8]) -> (Vec<u32>, usize, Option<Torn>) {
    let mut records = Records::new(file, 64 * 1024 * 1024);
    let (mut whole, mut changed) = (Vec::new(), 0);
    while let Some(record) = records.next_record().unwrap() {
        let Record::Message { header, data } = record else { continue };
        if *data == content(header.sequence) { whole.push(header.sequence) } else { changed += 1 }
    }
    (whole, changed, records.torn().cloned())
}

/// Where the first of the messages begins: behind the record of their channel.
fn first_message(file: &[u8]) -> usize {
    let at = file.windows(content(0).len()).position(|bytes| bytes == content(0)).unwrap();
    at - 22 - HEAD
}

#[test]
fn a_whole_file_is_whole() {
    for file in plain() {
        assert_eq!(read(&file), ((0..MESSAGES).collect(), 0, None));
    }
}

/// The rule: a hole, wherever it is, costs the messages that it touches and no other, and it is told.
#[test]
fn a_hole_costs_what_it_touches() {
    for file in plain() {
        let begin = first_message(&file);
        let end = begin + (file.len() - begin) / 2;
        for (fill, len) in [(0, 1), (0, 9), (0, 300), (0xFF, 9), (0xFF, 300), (0x05, 300)] {
            for at in (begin..end).step_by(7) {
                let mut damaged = file.clone();
                damaged[at..at + len].fill(fill);
                if damaged == file {
                    continue;
                }
                // What a hole touches: a message, and a chunk's head before it.
                let touched = len / (content(0).len() + 31) + 2;
                let (whole, _, torn) = read(&damaged);
                assert!(
                    whole.len() + touched >= MESSAGES as usize,
                    "{len} of {fill} at {at}: {} left, {torn:?}",
                    whole.len()
                );
                assert!(whole.is_sorted(), "{len} of {fill} at {at}");
                let told = torn.expect("it is told").to_string();
                assert!(told.starts_with("damaged at byte "), "{told}");
            }
        }
    }
}

/// A file that is cut has no hole: it breaks off, and what it holds at its end is taken for no record.
#[test]
fn a_cut_file_breaks_off_where_its_last_record_begins() {
    for file in plain() {
        for cut in first_message(&file)..file.len() {
            let (whole, changed, torn) = read(&file[..cut]);
            let torn = torn.expect("it is told");
            assert_eq!((torn.resumed, changed), (None, 0), "cut at {cut}: {torn}");
            assert!(torn.offset <= cut as u64 && whole.iter().copied().eq(0..whole.len() as u32));
        }
    }
}

#[test]
fn a_hole_and_a_cut_are_both_told() {
    let [mut file, _] = plain();
    let begin = first_message(&file);
    file[begin + 200..begin + 500].fill(0);
    file.truncate(file.len() / 2);
    let (_, _, torn) = read(&file);
    let torn = torn.expect("it is told");
    assert!(matches!(torn.resumed, Some(Resumed { holes: 1, bytes: 200..=600, ends_at: Some(_) })), "{torn}");
}

#[cfg(feature = "compressed")]
#[test]
fn a_hole_in_a_compressed_chunk_costs_no_chunk_but_it() {
    for compression in [mcap::Compression::Zstd, mcap::Compression::Lz4] {
        let options = WriteOptions::new().compression(Some(compression)).chunk_size(Some(1000));
        let file = file(options);
        assert_eq!(read(&file).0.len(), MESSAGES as usize);
        let chunk = file.windows(9).position(|head| head[0] == op::CHUNK && head[3..] == [0; 6]).unwrap();
        let mut damaged = file.clone();
        damaged[chunk + 70..chunk + 90].fill(0);
        let (whole, _, torn) = read(&damaged);
        assert!(
            whole.contains(&(MESSAGES - 1)) && whole.len() + 12 > MESSAGES as usize,
            "{whole:?} {torn:?}"
        );
        assert!(torn.is_some_and(|torn| torn.to_string().contains("a chunk that cannot be unpacked")));
    }
}
