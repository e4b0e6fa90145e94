//! Whether bytes as they went over the wire end inside a telegram.

use super::torn::Torn;
use crate::StreamKind;
use crate::finder::Finder;
use crate::scan_reader::MAX_PAYLOAD;

/// The last bytes of a file: room for the longest telegram, and for one before it.
#[derive(Debug, Default)]
pub(super) struct Tail {
    kind: StreamKind,
    bytes: Vec<u8>,
    /// Bytes of the file so far.
    read: u64,
}

impl Tail {
    /// Of bytes of this kind.
    pub(super) fn new(kind: StreamKind) -> Self {
        Self { kind, ..Self::default() }
    }

    /// Takes the file's next bytes.
    pub(super) fn push(&mut self, bytes: &[u8]) {
        const KEPT: usize = 2 * MAX_PAYLOAD;
        self.read += bytes.len() as u64;
        self.bytes.extend_from_slice(bytes);
        if self.bytes.len() > 2 * KEPT {
            self.bytes.drain(..self.bytes.len() - KEPT);
        }
    }

    /// The telegram that the file breaks off in; none if it ends behind one.
    pub(super) fn torn(&self) -> Option<Torn> {
        let begun = begun(self.kind, &self.bytes)?;
        Some(Torn {
            offset: self.read.saturating_sub(begun as u64),
            expected: "the rest of a telegram",
            found: format!("the end of the file, {begun} bytes into it"),
            resumed: None,
        })
    }
}

/// Bytes of a telegram that is not whole, at the end of `bytes`.
fn begun(kind: StreamKind, mut bytes: &[u8]) -> Option<usize> {
    loop {
        let mut finder = Finder::new(kind, None);
        finder.push(bytes);
        while finder.next().is_some() {}
        let begun = finder.unfinished();
        if begun == 0 {
            return None;
        }
        // A damaged length may have swallowed whole telegrams.
        finder.finish();
        let mut end = None;
        while let Some(found) = finder.next() {
            end = usize::try_from(found.offset).ok().map(|at| at + found.len);
        }
        match end.and_then(|end| bytes.get(end..)) {
            Some(rest) => bytes = rest,
            None => return Some(begun),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_protocol::frame::{Dialect, encode};
    use rowscan_protocol::lms2xx;

    #[test]
    fn a_stream_is_torn_wherever_it_ends_inside_a_telegram() {
        let mut cola_a = Vec::new();
        encode(Dialect::A, b"sRA STlms 7 0", &mut cola_a);
        let mut cola_b = Vec::new();
        encode(Dialect::B, b"sRA STlms \x00\x07", &mut cola_b);
        let mut serial = Vec::new();
        lms2xx::frame::encode(lms2xx::frame::FROM_DEVICE, &[0xA0, 0, 0x10], &mut serial);
        for (kind, frame) in
            [(StreamKind::Cola, cola_a), (StreamKind::Cola, cola_b), (StreamKind::Lms2xx, serial)]
        {
            let whole = frame.repeat(3);
            for end in frame.len()..=whole.len() {
                let mut tail = Tail::new(kind);
                tail.push(&whole[..end]);
                let inside = end % frame.len();
                let expected = (inside > 0).then_some((end - inside) as u64);
                assert_eq!(tail.torn().map(|torn| torn.offset), expected, "{kind} cut at {end}");
            }
        }
    }

    #[test]
    fn damage_before_the_last_telegram_is_no_tear() {
        let mut bytes = Vec::new();
        encode(Dialect::B, b"sRA STlms \x00\x07", &mut bytes);
        // The first claims to be far longer than the file.
        let damaged = [&b"\x02\x02\x02\x02\x00\x00\x80\x00s"[..], &bytes, &bytes].concat();
        let mut tail = Tail::new(StreamKind::Cola);
        tail.push(&damaged);
        assert_eq!(tail.torn(), None);
        tail.push(&bytes[..5]);
        assert_eq!(tail.torn().map(|torn| torn.offset), Some(damaged.len() as u64));
    }

    #[test]
    fn a_long_file_is_judged_by_its_end() {
        let mut frame = Vec::new();
        encode(Dialect::B, &[&b"sSN LMDscandata "[..], &[7; 20_000]].concat(), &mut frame);
        let mut tail = Tail::new(StreamKind::Cola);
        (0..40).for_each(|_| tail.push(&frame));
        assert_eq!(tail.torn(), None);
        tail.push(&frame[..9_000]);
        assert_eq!(tail.torn().map(|torn| torn.offset), Some(40 * frame.len() as u64));
    }
}
