//! Any bytes from a GNSS receiver, in any pieces: the same lines, held to their checksums, and a speed that is a number.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rowscan_bus::nmea::SpeedReader;
use rowscan_protocol::nmea::{Lines, checksum, sentence};

/// A byte of no sentence: the line so far gets the `$`, checksum and end that make it one.
const SEAL: u8 = 0xFE;

/// Bytes with checksums that are right, so that what reads fields is reached.
fn sealed(bytes: &[u8]) -> Vec<u8> {
    let mut text = Vec::new();
    for piece in bytes.split_inclusive(|byte| *byte == SEAL) {
        match piece.strip_suffix(&[SEAL]).and_then(|body| std::str::from_utf8(body).ok()) {
            Some(body) => text.extend(format!("${body}*{:02X}\r\n", checksum(body)).bytes()),
            None => text.extend_from_slice(piece),
        }
    }
    text
}

fn lines(bytes: &[u8], piece: usize) -> Vec<String> {
    let (mut reader, mut lines) = (Lines::default(), Vec::new());
    for bytes in bytes.chunks(piece) {
        reader.push(bytes);
        lines.extend(std::iter::from_fn(|| reader.next_line()));
    }
    lines
}

fuzz_target!(|data: &[u8]| {
    let Some((&piece, bytes)) = data.split_first() else { return };
    let mut reader = SpeedReader::default();
    for line in lines(&sealed(bytes), usize::from(piece).max(1)) {
        assert!(line.ends_with('\n') && line.matches('\n').count() == 1);
        if let Some(body) = sentence(&line) {
            assert!(line.contains(body));
        }
        if let Some(Some(speed_m_s)) = reader.line(line.trim_end()) {
            assert!(speed_m_s.is_finite());
        }
    }
});
