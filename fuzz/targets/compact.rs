//! Compact: any bytes as a datagram and as a stream in any pieces. What is read is written again to the byte, every byte of a stream is told once,
//! and a telegram is the same in any pieces.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rowscan_protocol::compact::{Found, StreamDecoder, Telegram, crc32};

/// With a right checksum, so that what reads fields is reached.
fn sealed(bytes: &[u8]) -> Vec<u8> {
    let mut sealed = vec![2; 4];
    sealed.extend_from_slice(bytes);
    sealed.extend(crc32(&sealed).to_le_bytes());
    sealed
}

fn telegrams(bytes: &[u8], piece: usize) -> Vec<(u64, Telegram)> {
    let mut decoder = StreamDecoder::default();
    let (mut found, mut told) = (Vec::new(), 0);
    let mut take = |decoder: &mut StreamDecoder| {
        while let Some(next) = decoder.next_found() {
            let (Found::Telegram { offset, len, .. } | Found::Bad { offset, len, .. }) = next;
            assert!(offset == told && len > 0);
            told += len as u64;
            if let Found::Telegram { offset, telegram, .. } = next {
                found.push((offset, telegram));
            }
        }
    };
    for piece in bytes.chunks(piece) {
        decoder.push(piece);
        take(&mut decoder);
    }
    decoder.finish();
    take(&mut decoder);
    assert!(decoder.pending() == 0 && told == bytes.len() as u64);
    found
}

fn encoded(telegram: &Telegram) -> Vec<u8> {
    let mut bytes = Vec::new();
    telegram.encode(&mut bytes).expect("what was read can be written");
    bytes
}

fuzz_target!(|data: &[u8]| {
    let Some((&piece, bytes)) = data.split_first() else { return };
    let datagram = sealed(bytes);
    if let Ok(telegram) = Telegram::decode(&datagram) {
        assert_eq!(encoded(&telegram), datagram);
        telegram.visit(&mut ());
    }
    // Not by equality: a NaN is none with itself.
    let written = |piece: usize| -> Vec<(u64, Vec<u8>)> {
        telegrams(&datagram, piece).iter().map(|(at, telegram)| (*at, encoded(telegram))).collect()
    };
    assert_eq!(written(usize::from(piece).max(1)), written(datagram.len()));
});
