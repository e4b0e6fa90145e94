//! J1939's transport protocol (J1939-21): messages of 9 to 1785 bytes, put together from frames that were overheard; fast packets of NMEA 2000 beside
//! them. It takes no part: it asks for nothing and confirms nothing.

use std::collections::BTreeMap;

use crate::fast_packet::{Packets, is_fast};
use crate::frame::{CanFrame, CanId, EVERYONE, J1939Id};

/// Connection management and data transfer.
const TP_CM: u32 = 0xEC00;
const TP_DT: u32 = 0xEB00;
/// Control bytes of connection management.
const RTS: u8 = 16;
const BAM: u8 = 32;
const ABORT: u8 = 255;
/// The longest message.
const LONGEST: usize = 1785;
/// Messages on their way at once; of more the oldest is given up.
const AT_ONCE: usize = 256;

/// Puts messages together.
#[derive(Clone, Debug, Default)]
pub struct Assembly {
    /// By sender and receiver.
    open: BTreeMap<(u8, u8), Partial>,
    number: u64,
    packets: Packets,
}

#[derive(Clone, Debug)]
struct Partial {
    number: u64,
    pgn: u32,
    priority: u8,
    len: usize,
    bytes: Vec<u8>,
    next: u8,
}

impl Assembly {
    /// Takes a frame; the message that is whole with it: the frame's own, or one of many frames under the identifier of its parameter group.
    pub fn take(&mut self, frame: &CanFrame) -> Option<(CanId, Vec<u8>)> {
        let data = frame.data();
        let Some(id) = J1939Id::of(frame.id) else { return Some((frame.id, data.to_vec())) };
        let key = (id.source, id.destination);
        match id.pgn {
            TP_CM => {
                self.manage(key, id.priority, data);
                None
            }
            TP_DT => self.transfer(key, data),
            pgn if is_fast(pgn) => Some((frame.id, self.packets.take(id.source, pgn, data)?)),
            _ => Some((frame.id, data.to_vec())),
        }
    }

    fn manage(&mut self, key: (u8, u8), priority: u8, data: &[u8]) {
        let &[control, low, high, _, _, p0, p1, p2] = data else { return };
        let len = usize::from(u16::from_le_bytes([low, high]));
        let is_whole = (9..=LONGEST).contains(&len);
        match control {
            RTS | BAM if is_whole && (control == RTS || key.1 == EVERYONE) => {
                if self.open.len() >= AT_ONCE
                    && let Some(oldest) =
                        self.open.iter().min_by_key(|(_, open)| open.number).map(|(key, _)| *key)
                {
                    self.open.remove(&oldest);
                }
                self.number += 1;
                let pgn = u32::from_le_bytes([p0, p1, p2, 0]);
                let partial = Partial { number: self.number, pgn, priority, len, bytes: Vec::new(), next: 1 };
                self.open.insert(key, partial);
            }
            ABORT => {
                // Either side may give up.
                self.open.remove(&key);
                self.open.remove(&(key.1, key.0));
            }
            _ => {}
        }
    }

    fn transfer(&mut self, key: (u8, u8), data: &[u8]) -> Option<(CanId, Vec<u8>)> {
        let open = self.open.get_mut(&key)?;
        let (number, bytes) = data.split_first()?;
        if *number != open.next {
            // A packet that came again is asked for by the receiver; one that is missing ends it.
            if *number >= open.next {
                self.open.remove(&key);
            }
            return None;
        }
        open.next = open.next.wrapping_add(1);
        open.bytes.extend(bytes);
        if open.bytes.len() < open.len {
            return None;
        }
        let mut whole = self.open.remove(&key)?;
        whole.bytes.truncate(whole.len);
        let id = J1939Id { priority: whole.priority, pgn: whole.pgn, source: key.0, destination: key.1 };
        Some((id.id(), whole.bytes))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(pgn: u32, destination: u8, data: &[u8]) -> CanFrame {
        let id = J1939Id { priority: 7, pgn, source: 0x21, destination };
        CanFrame::new(id.id(), data).expect("eight bytes")
    }

    /// A message of 20 bytes, 0 to 19, of the group FF10: to everyone, or to address 0x30.
    fn frames(control: u8, to: u8) -> Vec<CanFrame> {
        let mut all = vec![frame(TP_CM, to, &[control, 20, 0, 3, 0xFF, 0x10, 0xFF, 0])];
        for (number, bytes) in (0..21).collect::<Vec<u8>>().chunks(7).enumerate() {
            let mut data = vec![number as u8 + 1];
            data.extend(bytes.iter().map(|byte| if *byte < 20 { *byte } else { 0xFF }));
            all.push(frame(TP_DT, to, &data));
        }
        all
    }

    #[test]
    fn a_message_of_many_frames_is_whole_with_its_last() {
        for (control, to) in [(BAM, EVERYONE), (RTS, 0x30)] {
            let mut assembly = Assembly::default();
            let mut whole: Vec<_> = frames(control, to).iter().map(|frame| assembly.take(frame)).collect();
            let (id, bytes) = whole.pop().flatten().expect("whole");
            assert!(whole.iter().all(Option::is_none));
            assert_eq!(bytes, (0..20).collect::<Vec<u8>>());
            let id = J1939Id::of(id).expect("29 bits");
            assert_eq!((id.pgn, id.source, id.priority), (0xFF10, 0x21, 7));
        }
    }

    #[test]
    fn the_position_of_our_receiver_is_put_together_as_it_was_sent() {
        let message = crate::pgn::MESSAGES.iter().find(|message| message.len > 8).expect("a fast packet");
        let raw: Vec<Option<f64>> = message
            .signals
            .iter()
            .map(|signal| Some((signal.raw_max() / 3) as f64 * signal.scale + signal.offset))
            .collect();
        let mut assembly = Assembly::default();
        let bytes = message.encode(&raw).bytes().to_vec();
        let mut heads = bytes.chunks(1);
        let mut frames: Vec<Vec<u8>> = Vec::new();
        let first: Vec<u8> = heads.by_ref().take(6).flatten().copied().collect();
        frames.push([&[0x40, message.len as u8], first.as_slice()].concat());
        let rest: Vec<u8> = heads.flatten().copied().collect();
        frames.extend(rest.chunks(7).enumerate().map(|(n, part)| [&[0x41 + n as u8], part].concat()));
        let whole: Vec<_> =
            frames.iter().filter_map(|data| assembly.take(&frame(message.pgn, EVERYONE, data))).collect();
        let [(id, found)] = whole.as_slice() else { panic!("one message: {whole:?}") };
        assert_eq!((J1939Id::of(*id).map(|id| id.pgn), found), (Some(message.pgn), &bytes));
        let signal = message.signals.last().expect("it has signals");
        let field = crate::field::Field::of_ours(message.name, signal.name).expect("known by its name");
        assert_eq!(field.value(found), message.decode(&bytes).last().copied().flatten());
    }

    #[test]
    fn a_message_with_a_hole_is_none_and_a_single_frame_is_its_own() {
        let mut assembly = Assembly::default();
        let all = frames(BAM, EVERYONE);
        let taken = [&all[0], &all[1], &all[3]].map(|frame| assembly.take(frame));
        assert!(taken.iter().all(Option::is_none));
        // The next one is read all the same.
        assert!(all.iter().filter_map(|frame| assembly.take(frame)).count() == 1);
        let single = frame(0xFF11, EVERYONE, &[1, 2]);
        assert_eq!(assembly.take(&single), Some((single.id, vec![1, 2])));
        let broken = frame(TP_CM, EVERYONE, &[BAM, 255, 255, 3, 0xFF, 0x10, 0xFF, 0]);
        assert_eq!((assembly.take(&broken), assembly.open.len()), (None, 0), "longer than any message");
    }

    #[test]
    fn no_stream_of_frames_fills_the_memory() {
        let mut assembly = Assembly::default();
        for source in 0..=255 {
            for destination in [1, 2, 3, EVERYONE] {
                let id = J1939Id { priority: 7, pgn: TP_CM, source, destination };
                let open = CanFrame::new(id.id(), &[RTS, 20, 0, 3, 0xFF, 0x10, 0xFF, 0]).expect("a frame");
                assembly.take(&open);
            }
        }
        assert_eq!(assembly.open.len(), AT_ONCE);
    }
}
