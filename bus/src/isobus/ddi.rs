//! The data dictionary: what numbers of process data mean, as far as a sprayer needs them.
//!
//! Numbers, names and units: AgIsoStack++, `isobus_standard_data_description_indices.hpp` and `isobus_data_dictionary.cpp`.

/// An entry of the data dictionary.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Its number.
    pub ddi: u16,
    /// Its name.
    pub name: &'static str,
    /// Its unit; empty where it is a state or a count.
    pub unit: &'static str,
}

/// Setpoint of the volume per area, 0.01 mm³/m²: 1 L/ha is 10 000.
pub const SETPOINT_RATE: u16 = 1;
/// The actual volume per area.
pub const ACTUAL_RATE: u16 = 2;
/// The actual working width, mm.
pub const ACTUAL_WIDTH: u16 = 67;
/// What the tank holds, mL.
pub const TANK: u16 = 72;
/// Offset of an element along the way, mm; behind is negative.
pub const OFFSET_X: u16 = 134;
/// Offset across, mm; right is positive.
pub const OFFSET_Y: u16 = 135;
/// Offset upwards, mm; here it carries the height of a section.
pub const OFFSET_Z: u16 = 136;
/// Work state of an element.
pub const ACTUAL_WORK: u16 = 141;
/// Whether prescriptions are followed.
pub const PRESCRIPTION_CONTROL: u16 = 158;
/// Nozzles of a section.
pub const SUB_UNITS: u16 = 159;
/// Whether sections follow the task controller.
pub const SECTION_CONTROL: u16 = 160;
/// Work states of sections 1 to 16; the next 15 numbers follow on.
pub const ACTUAL_SECTIONS: u16 = 161;
/// From a command to product on the target, ms.
pub const TURN_ON_TIME: u16 = 205;
/// From a command to no product any more, ms.
pub const TURN_OFF_TIME: u16 = 206;
/// Setpoint of a boom's work state: the master switch.
pub const SETPOINT_WORK: u16 = 289;
/// Setpoints of sections 1 to 16; the next 15 numbers follow on.
pub const SETPOINT_SECTIONS: u16 = 290;
/// Height of the canopy, mm.
pub const CANOPY_HEIGHT: u16 = 520;
/// Asks a client for what it tells by itself.
pub const DEFAULT_SET: u16 = 0xDFFF;

/// Sections that one condensed work state tells of.
pub const SECTIONS: u16 = 16;
/// Words of condensed work states.
pub const WORDS: u16 = 16;

/// Every entry used here. A new one is its line.
pub const TABLE: &[Entry] = &[
    entry(SETPOINT_RATE, "setpoint volume per area", "0.01 mm3/m2"),
    entry(ACTUAL_RATE, "actual volume per area", "0.01 mm3/m2"),
    entry(ACTUAL_WIDTH, "actual working width", "mm"),
    entry(TANK, "actual volume content", "ml"),
    entry(OFFSET_X, "device element offset X", "mm"),
    entry(OFFSET_Y, "device element offset Y", "mm"),
    entry(OFFSET_Z, "device element offset Z", "mm"),
    entry(ACTUAL_WORK, "actual work state", ""),
    entry(PRESCRIPTION_CONTROL, "prescription control state", ""),
    entry(SUB_UNITS, "number of sub-units per section", ""),
    entry(SECTION_CONTROL, "section control state", ""),
    entry(ACTUAL_SECTIONS, "actual condensed work state", ""),
    entry(TURN_ON_TIME, "section control turn-on time", "ms"),
    entry(TURN_OFF_TIME, "section control turn-off time", "ms"),
    entry(SETPOINT_WORK, "setpoint work state", ""),
    entry(SETPOINT_SECTIONS, "setpoint condensed work state", ""),
    entry(CANOPY_HEIGHT, "actual canopy height", "mm"),
    entry(DEFAULT_SET, "request default process data", ""),
];

const fn entry(ddi: u16, name: &'static str, unit: &'static str) -> Entry {
    Entry { ddi, name, unit }
}

/// The word of a condensed work state, counted from 0, if `ddi` is one of those that begin at `first`.
pub fn word(ddi: u16, first: u16) -> Option<u16> {
    ddi.checked_sub(first).filter(|word| *word < WORDS)
}

/// What two bits of a work state say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Work {
    /// Off.
    Off,
    /// On.
    On,
    /// Something is wrong with it.
    Error,
    /// There is none; in a setpoint: leave it as it is.
    Absent,
}

impl Work {
    /// On or off.
    pub fn of(is_on: bool) -> Self {
        if is_on { Self::On } else { Self::Off }
    }

    /// On or off, if it is one of them.
    pub fn is_on(self) -> Option<bool> {
        match self {
            Self::Off => Some(false),
            Self::On => Some(true),
            Self::Error | Self::Absent => None,
        }
    }

    /// Its two bits.
    pub fn bits(self) -> u32 {
        match self {
            Self::Off => 0,
            Self::On => 1,
            Self::Error => 2,
            Self::Absent => 3,
        }
    }

    /// Of these two bits.
    pub fn from_bits(bits: u32) -> Self {
        match bits & 3 {
            0 => Self::Off,
            1 => Self::On,
            2 => Self::Error,
            _ => Self::Absent,
        }
    }
}

/// The condensed word of these sections, the first in the lowest two bits; those beyond them are absent.
pub fn condensed(sections: impl IntoIterator<Item = Work>) -> i32 {
    let places = sections.into_iter().take(usize::from(SECTIONS)).zip(0..);
    let word = places.fold(u32::MAX, |word, (work, place)| {
        let at = 2 * place;
        word & !(3 << at) | work.bits() << at
    });
    word as i32
}

/// The sections of a condensed word.
pub fn sections(word: i32) -> [Work; SECTIONS as usize] {
    std::array::from_fn(|place| Work::from_bits(word as u32 >> (2 * place)))
}

/// Litres per hectare as 0.01 mm³/m²; what is beyond the field is held at its end.
pub fn rate(litres_per_ha: f64) -> i32 {
    (litres_per_ha * 10_000.0).round() as i32
}

/// Litres per minute as mm³/s (DDI 36 and 37).
pub fn flow(litres_per_min: f64) -> i32 {
    (litres_per_min * 1e6 / 60.0).round() as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_those_of_the_dictionary() {
        assert_eq!((rate(1.0), rate(300.0)), (10_000, 3_000_000));
        assert_eq!(flow(1.0), 16_667);
        assert_eq!((rate(f64::INFINITY), rate(f64::NAN)), (i32::MAX, 0));
    }

    #[test]
    fn sections_stand_in_two_bits_from_the_lowest() {
        let four = [Work::On, Work::Off, Work::On, Work::Off];
        assert_eq!(condensed(four), 0xFFFF_FF11_u32 as i32);
        assert_eq!(sections(condensed(four))[..5], [four.as_slice(), &[Work::Absent]].concat());
        assert_eq!(condensed([]), -1);
        assert_eq!(condensed([Work::Error; 20]), 0xAAAA_AAAA_u32 as i32);
        for word in [0, -1, 0x1234_5678, i32::MIN] {
            assert_eq!(condensed(sections(word)), word);
        }
    }

    #[test]
    fn every_number_stands_once() {
        let mut numbers: Vec<u16> = TABLE.iter().map(|entry| entry.ddi).collect();
        numbers.dedup();
        numbers.sort_unstable();
        numbers.dedup();
        assert_eq!(numbers.len(), TABLE.len());
        assert_eq!((word(161, ACTUAL_SECTIONS), word(176, ACTUAL_SECTIONS)), (Some(0), Some(15)));
        assert_eq!((word(177, ACTUAL_SECTIONS), word(160, ACTUAL_SECTIONS)), (None, None));
    }
}
