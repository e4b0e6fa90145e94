//! Which frames an adapter hands to its host: the acceptance filter of the SJA1000, which the Lawicel commands `M`, `m` and `W` set.
//!
//! Code and mask are four registers each, written as eight digits, register 0 first. A mask bit of 1 compares nothing. Of a dual filter
//! either half may let a frame through (SJA1000 data sheet, acceptance filter in PeliCAN mode).

use crate::{CanFrame, CanId};

/// Code and mask of one chip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Acceptance {
    /// ACR0 to ACR3.
    pub(super) code: [u8; 4],
    /// AMR0 to AMR3.
    pub(super) mask: [u8; 4],
    /// One long filter; else two short ones.
    pub(super) single: bool,
}

/// Everything passes, as after power-up.
impl Default for Acceptance {
    fn default() -> Self {
        Self { code: [0; 4], mask: [0xFF; 4], single: false }
    }
}

impl Acceptance {
    /// Whether the host gets the frame.
    pub(super) fn takes(&self, frame: &CanFrame) -> bool {
        let remote = u8::from(frame.remote);
        // The filter's view of the frame, register by register, and the bits of each that have a counterpart in it.
        match (frame.id, self.single) {
            (CanId::Standard(id), true) => {
                let [high, low] = (id << 5).to_be_bytes();
                let seen = [high, low | remote << 4, byte(frame, 0), byte(frame, 1)];
                self.matches([0, 1, 2, 3], seen, [0xFF, 0xF0, present(frame, 0), present(frame, 1)])
            }
            (CanId::Extended(id), true) => {
                let [a, b, c, d] = (id << 3).to_be_bytes();
                self.matches([0, 1, 2, 3], [a, b, c, d | remote << 2], [0xFF, 0xFF, 0xFF, 0xFC])
            }
            (CanId::Standard(id), false) => {
                let [high, low] = (id << 5).to_be_bytes();
                let low = low | remote << 4;
                // The first half compares the first data byte too, its upper four bits in register 1, its lower in register 3.
                let (data, compared) = (byte(frame, 0), present(frame, 0));
                let seen = [high, low | data >> 4, data & 0x0F];
                self.matches([0, 1, 3], seen, [0xFF, 0xF0 | compared >> 4, compared & 0x0F])
                    || self.matches([2, 3], [high, low], [0xFF, 0xF0])
            }
            (CanId::Extended(id), false) => {
                let [high, low, ..] = (id << 3).to_be_bytes();
                self.matches([0, 1], [high, low], [0xFF; 2]) || self.matches([2, 3], [high, low], [0xFF; 2])
            }
        }
    }

    /// Compares what is seen with these registers, in these bits.
    fn matches<const N: usize>(&self, registers: [usize; N], seen: [u8; N], bits: [u8; N]) -> bool {
        registers.iter().zip(seen.iter().zip(bits)).all(|(&register, (seen, bits))| {
            let at = |registers: &[u8; 4]| registers.get(register).copied().unwrap_or(0);
            (seen ^ at(&self.code)) & !at(&self.mask) & bits == 0
        })
    }
}

fn byte(frame: &CanFrame, index: usize) -> u8 {
    frame.data().get(index).copied().unwrap_or(0)
}

/// All bits of a data byte that is there, none of one that is not.
fn present(frame: &CanFrame, index: usize) -> u8 {
    if index < frame.data().len() { 0xFF } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn standard(id: u16, data: &[u8]) -> CanFrame {
        CanFrame::new(CanId::Standard(id), data).unwrap()
    }

    #[test]
    fn everything_passes_at_first() {
        let filter = Acceptance::default();
        assert!(filter.takes(&standard(0x7FF, &[1])));
        assert!(filter.takes(&CanFrame::remote(CanId::Extended(0x1FFF_FFFF), 0).unwrap()));
    }

    #[test]
    fn two_halves_each_let_their_own_identifier_through() {
        // 123 without regard to data, and 456; neither as a remote frame.
        let filter =
            Acceptance { code: [0x24, 0x60, 0x8A, 0xC0], mask: [0x00, 0x0F, 0x00, 0x0F], single: false };
        assert!(filter.takes(&standard(0x123, &[0xA5])) && filter.takes(&standard(0x456, &[])));
        assert!(!filter.takes(&standard(0x122, &[])) && !filter.takes(&standard(0x457, &[])));
        assert!(!filter.takes(&CanFrame::remote(CanId::Standard(0x123), 0).unwrap()));
    }

    #[test]
    fn the_first_half_compares_the_first_data_byte() {
        let filter = Acceptance { code: [0x24, 0x6A, 0xFF, 0xE5], mask: [0, 0, 0, 0], single: false };
        assert!(filter.takes(&standard(0x123, &[0xA5, 7])));
        assert!(!filter.takes(&standard(0x123, &[0xA4, 7])) && !filter.takes(&standard(0x123, &[0xB5])));
        assert!(filter.takes(&standard(0x123, &[])), "no byte, nothing to compare");
    }

    #[test]
    fn a_single_filter_compares_two_data_bytes_or_all_of_a_long_identifier() {
        let filter = Acceptance { code: [0x24, 0x60, 0x11, 0x22], mask: [0, 0x0F, 0, 0], single: true };
        assert!(
            filter.takes(&standard(0x123, &[0x11, 0x22, 0x33])) && filter.takes(&standard(0x123, &[0x11]))
        );
        assert!(!filter.takes(&standard(0x123, &[0x11, 0x23])));
        let long = |id| CanFrame::new(CanId::Extended(id), &[]).unwrap();
        let filter = Acceptance { code: 0xC7F2_4780_u32.to_be_bytes(), mask: [0, 0, 0, 3], single: true };
        assert!(filter.takes(&long(0x18FE_48F0)) && !filter.takes(&long(0x18FE_48F1)));
    }
}
