//! Frames out of byte streams: real, split, dirty and hostile ones.

use proptest::prelude::*;
use rowscan_protocol::frame::{Accept, Dialect, FrameCounts, FrameDecoder, encode};

const MAX_PAYLOAD: usize = 64 * 1024;

type Found = Vec<(Dialect, u64, usize, Vec<u8>)>;

fn drain(decoder: &mut FrameDecoder, found: &mut Found) {
    while let Some(frame) = decoder.next_frame() {
        found.push((frame.dialect, frame.offset, frame.len, frame.payload.to_vec()));
    }
}

fn decode(decoder: &mut FrameDecoder, stream: &[u8], piece: usize) -> Found {
    let mut found = Vec::new();
    for bytes in stream.chunks(piece) {
        decoder.push(bytes);
        drain(decoder, &mut found);
    }
    found
}

fn payloads(found: &Found) -> Vec<&[u8]> {
    found.iter().map(|(.., payload)| payload.as_slice()).collect()
}

fn framed(dialect: Dialect, payload: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    encode(dialect, payload, &mut out);
    out
}

#[test]
fn recorded_streams_split_where_their_index_says() {
    for recording in crate::facts::recordings() {
        for (from_device, stream) in [(true, &recording.device_to_host), (false, &recording.host_to_device)] {
            let expected: Vec<_> = recording
                .index
                .iter()
                .filter(|at| at.from_device == from_device)
                .map(|at| (Dialect::B, at.offset as u64, at.len, recording.payload(at).to_vec()))
                .collect();
            for piece in [1, 7, 1460, usize::MAX] {
                let mut decoder = FrameDecoder::new(Accept::Either, MAX_PAYLOAD);
                let found = decode(&mut decoder, stream, piece);
                assert!(found == expected, "{} in pieces of {piece}", recording.name);
                let frames = expected.len() as u64;
                assert_eq!(
                    decoder.counts(),
                    FrameCounts { frames, bad: 0, skipped_bytes: 0, ..FrameCounts::default() }
                );
            }
            let mut again = Vec::new();
            expected.iter().for_each(|(dialect, _, _, payload)| encode(*dialect, payload, &mut again));
            assert!(&again == stream, "{}: framing the payloads again gives other bytes", recording.name);
        }
    }
}

#[test]
fn a_checksum_error_costs_one_frame_even_when_the_next_follows_at_once() {
    let mut stream = framed(Dialect::B, b"sRN LMDscandata");
    *stream.last_mut().unwrap() ^= 1;
    stream.extend(framed(Dialect::B, b"sMN Run"));
    let mut decoder = FrameDecoder::new(Accept::Only(Dialect::B), MAX_PAYLOAD);
    let found = decode(&mut decoder, &stream, usize::MAX);
    assert_eq!(payloads(&found), [b"sMN Run"]);
    assert_eq!(
        decoder.counts(),
        FrameCounts { frames: 1, bad: 1, skipped_bytes: 24, ..FrameCounts::default() }
    );
}

#[test]
fn frames_hidden_in_the_bytes_a_broken_frame_claims_are_found() {
    let mut inner = Vec::new();
    for index in 0..20 {
        inner.extend(framed(Dialect::B, format!("sRN field{index:03}").as_bytes()));
    }
    let mut stream = framed(Dialect::B, &[b"s", inner.as_slice()].concat());
    *stream.last_mut().unwrap() ^= 0x40;
    let mut decoder = FrameDecoder::new(Accept::Only(Dialect::B), MAX_PAYLOAD);
    assert_eq!(decode(&mut decoder, &stream, usize::MAX).len(), 20);
    assert_eq!(decoder.counts().bad, 1);
}

#[test]
fn broken_frames_in_a_row_are_counted_one_by_one() {
    // Each holds what looks like the start of a frame that reaches far into the ones behind it.
    let false_start = [0, 0, 2, 2, 2, 2, 0, 0, 0x0F, 0xA0, b's', 0, 0];
    let mut stream = Vec::new();
    for number in 100..200u8 {
        let mut frame = framed(
            Dialect::B,
            &[&b"sSN LMDscandata "[..], &[number; 900], &false_start, &[number; 300]].concat(),
        );
        frame[40] ^= 0x10;
        stream.extend(frame);
    }
    stream.extend(framed(Dialect::B, b"sMN Run"));
    for piece in [100, 65_536, usize::MAX] {
        let mut decoder = FrameDecoder::new(Accept::Either, MAX_PAYLOAD);
        let mut found = decode(&mut decoder, &stream, piece);
        decoder.finish();
        drain(&mut decoder, &mut found);
        assert_eq!(payloads(&found), [b"sMN Run"]);
        assert_eq!(decoder.counts().bad, 100);
    }
}

#[test]
fn a_length_of_4_gb_is_refused_at_once() {
    let mut stream = vec![2, 2, 2, 2, 0xFF, 0xFF, 0xFF, 0xFF, b's'];
    stream.extend(framed(Dialect::B, b"sMN Run"));
    let mut decoder = FrameDecoder::new(Accept::Either, MAX_PAYLOAD);
    assert_eq!(payloads(&decode(&mut decoder, &stream, 1)), [b"sMN Run"]);
    assert_eq!(decoder.counts().bad, 1);
}

#[test]
fn a_megabyte_of_stx_is_one_broken_frame() {
    let mut stream = vec![2; 1 << 20];
    stream.extend(framed(Dialect::A, b"sMN Run"));
    for piece in [1, 1000, usize::MAX] {
        let mut decoder = FrameDecoder::new(Accept::Either, MAX_PAYLOAD);
        assert_eq!(payloads(&decode(&mut decoder, &stream, piece)), [b"sMN Run"]);
        let counts = decoder.counts();
        assert_eq!((counts.bad, counts.skipped_bytes), (1, 1 << 20));
    }
}

#[test]
fn half_a_frame_then_silence_keeps_waiting_until_the_end_is_declared() {
    let mut stream = framed(Dialect::B, &[b's'; 3000]);
    stream.truncate(1500);
    stream.extend(framed(Dialect::B, b"sMN Run"));
    let mut decoder = FrameDecoder::new(Accept::Either, MAX_PAYLOAD);
    assert!(decode(&mut decoder, &stream, 100).is_empty());
    assert_eq!(decoder.pending(), stream.len());
    decoder.finish();
    let mut found = Vec::new();
    drain(&mut decoder, &mut found);
    assert_eq!(payloads(&found), [b"sMN Run"]);
    assert_eq!(
        decoder.counts(),
        FrameCounts { frames: 1, bad: 1, skipped_bytes: 1500, ..FrameCounts::default() }
    );
}

#[test]
fn an_stx_inside_text_means_the_frame_before_it_lost_its_end() {
    let mut decoder = FrameDecoder::new(Accept::Either, MAX_PAYLOAD);
    let found = decode(&mut decoder, b"\x02sRN Dev\x02sRN SerialNumber\x03\x02sMN Run\x03", usize::MAX);
    assert_eq!(payloads(&found), [&b"sRN SerialNumber"[..], b"sMN Run"]);
    assert_eq!(
        decoder.counts(),
        FrameCounts { frames: 2, bad: 1, skipped_bytes: 8, ..FrameCounts::default() }
    );
}

#[test]
fn text_without_end_is_given_up_at_the_largest_payload() {
    let mut stream = b"\x02s".to_vec();
    stream.extend([b'x'; 3000]);
    let mut decoder = FrameDecoder::new(Accept::Either, 1000);
    assert!(decode(&mut decoder, &stream, 1).is_empty());
    assert_eq!(decoder.pending(), 0);
    assert_eq!(decoder.counts().bad, 1);
}

#[test]
fn a_frame_of_the_largest_payload_passes_and_one_byte_more_does_not() {
    for dialect in [Dialect::A, Dialect::B] {
        for (size, frames) in [(1000, 1), (1001, 0)] {
            let mut decoder = FrameDecoder::new(Accept::Only(dialect), 1000);
            let stream = framed(dialect, &vec![b's'; size]);
            assert_eq!(decode(&mut decoder, &stream, 3).len(), frames, "{dialect}, {size} bytes");
            assert_eq!(decoder.counts().bad, 1 - frames as u64);
        }
    }
}

#[test]
fn nul_bytes_after_the_end_are_skipped() {
    let mut decoder = FrameDecoder::new(Accept::Only(Dialect::A), MAX_PAYLOAD);
    let found = decode(&mut decoder, b"\x02sMN Run\x03\0\x02sRN DeviceIdent\x03\0", 1);
    assert_eq!(found.len(), 2);
    assert_eq!(
        decoder.counts(),
        FrameCounts { frames: 2, bad: 0, skipped_bytes: 2, ..FrameCounts::default() }
    );
}

#[test]
fn the_dialect_that_is_not_accepted_is_junk() {
    for (accepted, other) in [(Dialect::A, Dialect::B), (Dialect::B, Dialect::A)] {
        let mut stream = framed(other, b"sMN Run");
        stream.extend(framed(accepted, b"sRN DeviceIdent"));
        let mut decoder = FrameDecoder::new(Accept::Either, MAX_PAYLOAD);
        decoder.accept_only(accepted);
        assert_eq!(payloads(&decode(&mut decoder, &stream, usize::MAX)), [b"sRN DeviceIdent"]);
    }
}

/// A decoder that sums every candidate anew needs some 10^11 steps for this.
#[test]
fn nested_false_headers_cost_linear_time_and_bounded_memory() {
    let max_payload = 1 << 20;
    let header = [2, 2, 2, 2, 0x00, 0x0F, 0xFF, 0xF1, b's'];
    let mut stream = header.repeat((2 << 20) / header.len());
    stream.extend(framed(Dialect::B, b"sMN Run"));
    stream.extend(vec![0; max_payload]);
    for piece in [64, 1 << 16] {
        let mut decoder = FrameDecoder::new(Accept::Only(Dialect::B), max_payload);
        let mut frames = 0;
        for bytes in stream.chunks(piece) {
            decoder.push(bytes);
            while decoder.next_frame().is_some() {
                frames += 1;
            }
            assert!(decoder.pending() <= max_payload + 9);
        }
        assert_eq!(frames, 1);
    }
}

fn payload() -> impl Strategy<Value = (Dialect, Vec<u8>)> {
    let text = "s[RWE]N [A-Za-z]{1,12}( [0-9A-F]{1,8}){0,6}".prop_map(|text| (Dialect::A, text.into_bytes()));
    // Few different bytes, so that false starts inside payloads are common.
    let bytes = prop::collection::vec(prop::sample::select(vec![0, 1, 2, 2, 2, 3, b's', 0xFF]), 0..200)
        .prop_map(|bytes| (Dialect::B, [b"s".as_slice(), &bytes].concat()));
    prop_oneof![text, bytes]
}

fn cuts() -> impl Strategy<Value = Vec<usize>> {
    prop::collection::vec(1usize..40, 1..50)
}

fn decode_cut(stream: &[u8], cuts: &[usize]) -> (Found, FrameCounts) {
    let mut decoder = FrameDecoder::new(Accept::Either, 1000);
    let mut found = Vec::new();
    let mut rest = stream;
    for cut in cuts.iter().cycle() {
        if rest.is_empty() {
            break;
        }
        let (piece, after) = rest.split_at((*cut).min(rest.len()));
        decoder.push(piece);
        drain(&mut decoder, &mut found);
        rest = after;
    }
    decoder.finish();
    drain(&mut decoder, &mut found);
    (found, decoder.counts())
}

proptest! {
    #[test]
    fn any_split_gives_the_same_frames(frames in prop::collection::vec(payload(), 0..12), cuts in cuts()) {
        let mut stream = Vec::new();
        frames.iter().for_each(|(dialect, payload)| encode(*dialect, payload, &mut stream));
        let (found, counts) = decode_cut(&stream, &cuts);
        let found: Vec<_> = found.into_iter().map(|(dialect, .., payload)| (dialect, payload)).collect();
        prop_assert_eq!(found, frames.clone());
        prop_assert_eq!(counts, FrameCounts { frames: frames.len() as u64, bad: 0, skipped_bytes: 0, ..FrameCounts::default() });
    }

    /// Junk without STX cannot hide a frame; every byte is either in a frame or counted.
    #[test]
    fn junk_between_frames_loses_none(
        frames in prop::collection::vec((payload(), prop::collection::vec(3u8.., 0..30)), 0..12),
        cuts in cuts(),
    ) {
        let mut stream = Vec::new();
        for ((dialect, payload), junk) in &frames {
            stream.extend(junk);
            encode(*dialect, payload, &mut stream);
        }
        let (found, counts) = decode_cut(&stream, &cuts);
        prop_assert_eq!(found.len(), frames.len());
        prop_assert_eq!(counts.skipped_bytes as usize, frames.iter().map(|(_, junk)| junk.len()).sum::<usize>());
    }

    #[test]
    fn random_bytes_give_the_same_frames_however_they_are_cut(
        stream in prop::collection::vec(prop::sample::select(vec![0, 0, 0, 1, 2, 2, 2, 2, 3, 5, b's', b'0']), 0..2000),
        cuts in cuts(),
    ) {
        let (found, counts) = decode_cut(&stream, &cuts);
        prop_assert_eq!(&decode_cut(&stream, &[stream.len().max(1)]), &(found.clone(), counts));
        let framed: u64 = found.iter().map(|(_, _, len, _)| *len as u64).sum();
        prop_assert_eq!(framed + counts.skipped_bytes, stream.len() as u64);
    }

    #[test]
    fn any_flipped_bit_in_a_binary_frame_is_caught(
        payload in prop::collection::vec(any::<u8>(), 1..200), bit in any::<prop::sample::Index>(),
    ) {
        let mut stream = framed(Dialect::B, &[b"s".as_slice(), &payload].concat());
        let bit = bit.index(stream.len() * 8);
        stream[bit / 8] ^= 1 << (bit % 8);
        let mut decoder = FrameDecoder::new(Accept::Only(Dialect::B), 1000);
        decoder.push(&stream);
        decoder.finish();
        let found = { let mut found = Vec::new(); drain(&mut decoder, &mut found); found };
        // A frame found inside the payload by chance is allowed; the whole is not.
        prop_assert!(found.iter().all(|(_, offset, ..)| *offset > 0));
        prop_assert!(decoder.counts().bad + decoder.counts().skipped_bytes > 0);
    }
}

/// What has lost its start is damaged once, as what fails its checksum is; what comes before the first frame may be the rest of one that nobody heard begin.
#[test]
fn each_damaged_stretch_between_frames_counts_once() {
    for dialect in [Dialect::A, Dialect::B] {
        let mut frame = Vec::new();
        encode(dialect, b"sRN DeviceIdent", &mut frame);
        let damaged = |broken: &[u8]| {
            let mut decoder = FrameDecoder::new(Accept::Either, 1024);
            for piece in [b"junk ", &frame[..], broken, &frame[..], &frame[..]] {
                decoder.push(piece);
                while decoder.next_frame().is_some() {}
            }
            decoder.finish();
            while decoder.next_frame().is_some() {}
            (decoder.counts().frames, decoder.counts().damaged())
        };
        assert_eq!(damaged(&[]), (3, 0), "{dialect}: junk before the first frame");
        assert_eq!(damaged(b"some junk"), (3, 1), "{dialect}: junk between frames");
        for (place, cases) in [(0, "its start"), (frame.len() - 1, "its end")] {
            let mut broken = frame.clone();
            broken[place] ^= 0x40;
            let (frames, found) = damaged(&broken);
            assert!((2..=3).contains(&frames) && found == 1, "{dialect}, {cases}: {frames} {found}");
        }
    }
}
