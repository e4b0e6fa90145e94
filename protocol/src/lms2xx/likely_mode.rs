//! The measuring mode of a log that does not tell it.

use super::values::{MeasuringMode, NoRange, Unit};

/// So many beams without an echo, and this share of a scan's, tell how wide the field of ranges is.
const LEAST_MISSES: usize = 5;
const LEAST_SHARE: usize = 50;

/// The mode that values are most likely of, scan by scan: once enough beams without an echo have told it, it stays.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LikelyMode(Option<MeasuringMode>);

impl LikelyMode {
    /// The mode of a scan's values.
    pub(super) fn of(&mut self, unit: Unit, values: &[u16]) -> MeasuringMode {
        if let Some(known) = self.0 {
            return known;
        }
        // What has no echo lies in no field and has no remission: its word is the bare code.
        let misses = |mode: MeasuringMode| {
            let code = mode.code(NoRange::Weak);
            values.iter().filter(|value| **value == code).count()
        };
        let modes = [MeasuringMode::RANGE_32_M, MeasuringMode(4), MeasuringMode(0)];
        let most = modes.into_iter().map(|mode| (misses(mode), mode)).max_by_key(|(count, _)| *count);
        match most {
            Some((count, mode)) if count >= LEAST_MISSES.max(values.len() / LEAST_SHARE) => {
                self.0 = Some(mode);
                mode
            }
            _ => MeasuringMode::guess(unit, values),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    /// Ranges with field bits and remission above them, as a device sends them, and beams without an echo between them.
    fn sent(mode: MeasuringMode, misses: usize) -> Vec<u16> {
        let flags =
            [0, 1 << 13, 1 << 14, 1 << 15].map(|flag: u16| flag & !(u16::MAX >> (16 - mode.range_bits())));
        let met = (0..100u16).map(|i| mode.encode(Unit::Mm, 1600 + 7 * i, 0) | flags[usize::from(i % 4)]);
        let missed = core::iter::repeat_n(mode.code(NoRange::Weak), misses);
        met.chain(missed).collect()
    }

    #[test]
    fn beams_without_an_echo_tell_how_wide_the_ranges_are() {
        for mode in (0..=6).chain([0x0D, 0x0F]).map(MeasuringMode) {
            let mut likely = LikelyMode::default();
            let found = likely.of(Unit::Mm, &sent(mode, 20));
            assert_eq!(found.range_bits(), mode.range_bits(), "{mode:?}");
            // A scan that meets something everywhere is of the same mode.
            assert_eq!(likely.of(Unit::Mm, &sent(mode, 0)), found, "{mode:?}");
        }
    }

    #[test]
    fn few_such_beams_tell_nothing_for_good() {
        let mut likely = LikelyMode::default();
        let wall_at_8_m = [1200, 8187, 8187, 9000];
        assert_eq!(likely.of(Unit::Mm, &wall_at_8_m), MeasuringMode::RANGE_32_M);
        assert_eq!(likely.0, None);
    }
}
