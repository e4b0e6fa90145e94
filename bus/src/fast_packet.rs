//! NMEA 2000 fast packets: messages of up to 223 bytes in frames of one identifier, put together from frames that were overheard.
//!
//! Byte 0 of each frame is a sequence (3 bits) and the frame's number in it (5 bits); byte 1 of frame 0 is the message's length.

use std::collections::BTreeMap;

/// The longest message: 6 bytes in the first frame, 7 in each of 31 more.
const LONGEST: usize = 6 + 31 * 7;
/// Messages on their way at once; of more the oldest is given up.
const AT_ONCE: usize = 256;

/// Parameter groups that the standard sends as fast packets, from the public lists of open decoders.
const GROUPS: &[u32] = &[
    126_208, 126_464, 126_720, 126_983, 126_984, 126_985, 126_986, 126_987, 126_988, 126_996, 126_998,
    127_233, 127_237, 127_489, 127_496, 127_497, 127_498, 127_503, 127_504, 127_506, 127_507, 127_509,
    127_510, 127_511, 127_512, 127_513, 127_514, 128_275, 128_520, 129_029, 129_038, 129_039, 129_040,
    129_041, 129_044, 129_045, 129_284, 129_285, 129_301, 129_302, 129_538, 129_540, 129_541, 129_542,
    129_545, 129_547, 129_549, 129_551, 129_556,
];

/// True if messages of this group come as fast packets: those above, and the makers' own.
pub(crate) fn is_fast(pgn: u32) -> bool {
    GROUPS.contains(&pgn) || (129_792..=129_812).contains(&pgn) || (130_816..=131_071).contains(&pgn)
}

/// Messages that have begun, by sender and group.
#[derive(Clone, Debug, Default)]
pub(crate) struct Packets {
    open: BTreeMap<(u8, u32), Partial>,
    number: u64,
}

#[derive(Clone, Debug)]
struct Partial {
    number: u64,
    /// The first byte that the next frame must have.
    next: u8,
    len: usize,
    bytes: Vec<u8>,
}

impl Packets {
    /// Takes a frame's bytes; the message that is whole with it.
    pub(crate) fn take(&mut self, source: u8, pgn: u32, data: &[u8]) -> Option<Vec<u8>> {
        let key = (source, pgn);
        let (&head, rest) = data.split_first()?;
        if head & 0x1F == 0 {
            let (&len, bytes) = rest.split_first()?;
            self.open.remove(&key);
            if usize::from(len) > LONGEST {
                return None;
            }
            self.make_room();
            self.number += 1;
            let next = head.wrapping_add(1);
            let partial = Partial { number: self.number, next, len: len.into(), bytes: bytes.to_vec() };
            self.open.insert(key, partial);
        } else {
            let open = self.open.get_mut(&key)?;
            if head != open.next {
                // A frame is missing, or of another message.
                self.open.remove(&key);
                return None;
            }
            open.next = head.wrapping_add(1);
            open.bytes.extend(rest);
        }
        self.open.get(&key).filter(|open| open.bytes.len() >= open.len)?;
        let whole = self.open.remove(&key)?;
        Some(whole.bytes.into_iter().take(whole.len).collect())
    }

    fn make_room(&mut self) {
        let oldest = self.open.iter().min_by_key(|(_, open)| open.number).map(|(key, _)| *key);
        if let Some(oldest) = oldest.filter(|_| self.open.len() >= AT_ONCE) {
            self.open.remove(&oldest);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A message of 20 bytes, 0 to 19, of this sequence.
    fn frames(sequence: u8) -> Vec<Vec<u8>> {
        let bytes: Vec<u8> = (0..20).collect();
        let head = sequence << 5;
        vec![
            [&[head, 20], &bytes[..6]].concat(),
            [&[head | 1], &bytes[6..13]].concat(),
            [&[head | 2], &bytes[13..]].concat(),
        ]
    }

    #[test]
    fn a_message_is_whole_with_its_last_frame_and_never_with_a_hole() {
        let mut packets = Packets::default();
        let mut take = |source: u8, data: &[u8]| packets.take(source, 129_029, data);
        let (first, second) = (frames(3), frames(4));
        // Two senders at once.
        let taken: Vec<_> = first.iter().zip(&second).map(|(a, b)| (take(1, a), take(2, b))).collect();
        let whole = Some((0..20).collect::<Vec<u8>>());
        assert_eq!(taken, [(None, None), (None, None), (whole.clone(), whole.clone())]);
        assert_eq!((take(1, &first[0]), take(1, &first[2]), take(1, &first[1])), (None, None, None));
        // The rest of another message is none of this one.
        assert_eq!((take(1, &first[0]), take(1, &second[1]), take(1, &first[2])), (None, None, None));
        assert_eq!(take(1, &[0x20, 2, 7, 8, 0xFF]), Some(vec![7, 8]), "in one frame");
        assert_eq!((take(1, &[]), take(1, &[0]), take(1, &[0, 255, 1])), (None, None, None));
    }

    #[test]
    fn no_stream_of_frames_fills_the_memory() {
        let mut packets = Packets::default();
        for source in 0..=255 {
            for pgn in [129_029, 129_540, 130_816] {
                packets.take(source, pgn, &[0, 20, 1, 2, 3, 4, 5, 6]);
            }
        }
        assert_eq!(packets.open.len(), AT_ONCE);
    }
}
