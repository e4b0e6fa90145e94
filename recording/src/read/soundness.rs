//! How much of a recording can be read: every packet passes here on its way to whoever reads the file.

use std::collections::BTreeMap;

use crate::finder::Finder;
use crate::{Joint, Packet, Side, StreamKind};

/// What was found so far in a recording, of all its streams.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Soundness {
    /// Telegrams, and packets of streams that are not telegrams of a scanner.
    pub sound: u64,
    /// Frames with a wrong checksum or length, and frames that hold no command.
    pub bad: u64,
    /// Bytes of all packets.
    pub bytes: u64,
}

impl Soundness {
    /// The words for telegrams that cannot be read, if there are any.
    pub fn damage(&self) -> Option<String> {
        let Self { sound, bad, .. } = self;
        let all = sound + bad;
        (*bad > 0)
            .then(|| format!("{bad} of {all} telegrams cannot be read (wrong checksum, length or command)"))
    }

    /// Adds what `finder` finds after `change`.
    fn count(&mut self, finder: &mut Finder, change: impl FnOnce(&mut Finder)) {
        let bad = finder.bad();
        change(finder);
        while let Some(found) = finder.next() {
            // Bytes of noise may look like a frame of CoLa A.
            if found.is_telegram { self.sound += 1 } else { self.bad += 1 }
        }
        self.bad += finder.bad() - bad;
    }
}

/// Counts while packets pass.
#[derive(Debug, Default)]
pub(super) struct Watch {
    found: Soundness,
    /// Who looks for frames in each direction of each stream.
    finders: BTreeMap<(usize, Option<Side>), Finder>,
}

impl Watch {
    /// What was found so far.
    pub(super) fn found(&self) -> Soundness {
        self.found
    }

    /// Looks at the next packet, of a stream of this kind.
    pub(super) fn see(&mut self, kind: StreamKind, packet: &Packet) {
        self.found.bytes += packet.bytes.len() as u64;
        if !kind.is_scanner() {
            self.found.sound += 1;
            return;
        }
        let way = (packet.stream, packet.from);
        if packet.joint != Joint::Seamless
            && let Some(mut finder) = self.finders.remove(&way)
        {
            // What was unfinished stays so.
            self.found.count(&mut finder, Finder::finish);
        }
        let finder = self.finders.entry(way).or_insert_with(|| Finder::new(kind, packet.from));
        self.found.count(finder, |finder| finder.push(&packet.bytes));
    }

    /// No more packets come.
    pub(super) fn end(&mut self) {
        for mut finder in std::mem::take(&mut self.finders).into_values() {
            self.found.count(&mut finder, Finder::finish);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;
    use crate::{Recording, account};
    use rowscan_protocol::frame::{Dialect, encode};

    fn found(bytes: Vec<u8>) -> (u64, u64) {
        let mut recording = Recording::read(Box::new(Cursor::new(bytes))).expect("it opens");
        account(&mut recording).expect("it reads");
        let Soundness { sound, bad, .. } = recording.soundness();
        (sound, bad)
    }

    #[test]
    fn a_flipped_bit_is_one_bad_telegram_and_noise_is_none() {
        let mut one = Vec::new();
        encode(Dialect::B, b"sRN DeviceIdent", &mut one);
        let whole = one.repeat(5);
        assert_eq!(found(whole.clone()), (5, 0));
        let mut flipped = whole.clone();
        if let Some(byte) = flipped.get_mut(one.len() + 12) {
            *byte ^= 1;
        }
        assert_eq!(found(flipped), (4, 1));
        // The last frame claims more than there is, and no telegram stands in it.
        let mut cut = whole;
        cut.truncate(cut.len() - 3);
        assert_eq!(found(cut).0, 4);
        // A frame of CoLa A by its looks.
        assert_eq!(found(b"\x00\x02s\x91\x03\xFF".to_vec()), (0, 1));
    }
}
