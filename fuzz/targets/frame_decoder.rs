//! Any bytes in any pieces: the same frames as in one piece, every frame good, every byte accounted for.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rowscan_protocol::frame::{Accept, Dialect, FrameCounts, FrameDecoder, encode, fault};

const MAX_PAYLOAD: usize = 300;

fn frames(bytes: &[u8], piece: usize) -> (Vec<(Dialect, Vec<u8>, u64, usize)>, FrameCounts) {
    let mut decoder = FrameDecoder::new(Accept::Either, MAX_PAYLOAD);
    let mut frames = Vec::new();
    for bytes in bytes.chunks(piece) {
        decoder.push(bytes);
        while let Some(frame) = decoder.next_frame() {
            frames.push((frame.dialect, frame.payload.to_vec(), frame.offset, frame.len));
        }
    }
    decoder.finish();
    while let Some(frame) = decoder.next_frame() {
        frames.push((frame.dialect, frame.payload.to_vec(), frame.offset, frame.len));
    }
    (frames, decoder.counts())
}

fuzz_target!(|data: &[u8]| {
    let Some((&piece, bytes)) = data.split_first() else { return };
    let (whole, counts) = frames(bytes, bytes.len().max(1));
    assert_eq!(frames(bytes, usize::from(piece).max(1)), (whole.clone(), counts));
    let mut framed = 0;
    for (dialect, payload, offset, len) in &whole {
        let mut again = Vec::new();
        encode(*dialect, payload, &mut again);
        let offset = *offset as usize;
        assert_eq!(bytes[offset..offset + len], again);
        framed += len;
    }
    assert_eq!(counts.skipped_bytes as usize + framed, bytes.len());
    // What is wrong with bytes is told piece by piece, to the end.
    let mut rest = 0..bytes.len();
    while let Some(fault) = fault(bytes, rest.clone(), MAX_PAYLOAD) {
        assert!(fault.bytes.start == rest.start && !fault.bytes.is_empty());
        rest.start = fault.bytes.end;
    }
    assert!(rest.is_empty());
});
