//! A quantity in a message: which bits of which frames it is, and what they are worth.

use crate::frame::{CanId, J1939Id};
use crate::pgn::MESSAGES;

/// Which frames, or messages put together of several, are meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Address {
    /// Those of this identifier.
    Id(CanId),
    /// Those of this J1939 parameter group, whoever sends them.
    Group(u32),
}

impl Address {
    /// True if a message of `id` is meant.
    pub fn fits(self, id: CanId) -> bool {
        match self {
            Self::Id(wanted) => wanted == id,
            Self::Group(group) => J1939Id::of(id).is_some_and(|id| id.pgn == group),
        }
    }
}

/// One signal: where it is, and what its bits are worth.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    /// Where it travels.
    pub address: Address,
    pub(crate) bits: Bits,
    pub(crate) scale: f64,
    pub(crate) offset: f64,
    pub(crate) kind: Kind,
    /// It is there only while this other field has that value.
    pub(crate) only_if: Option<(Bits, u64)>,
    /// The largest raw value says that there is none, as J1939 and NMEA 2000 have it.
    pub(crate) knows_missing: bool,
    /// Larger raw values say that there is an error, or are kept for other uses, as J1939 has it.
    pub(crate) largest_raw: Option<u64>,
    pub(crate) names: Vec<(f64, String)>,
    /// Its unit, empty where it has none.
    pub unit: String,
}

/// The largest raw value of an unsigned number of so many bits that is a value in J1939; none of other widths.
pub(crate) fn largest_raw(bits: u64) -> Option<u64> {
    match bits {
        8 => Some(0xFA),
        16 => Some(0xFAFF),
        32 => Some(0xFAFF_FFFF),
        _ => None,
    }
}

/// Bits of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Bits {
    pub(crate) start: u64,
    pub(crate) size: u64,
    pub(crate) big_endian: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Unsigned,
    Signed,
    #[cfg_attr(not(feature = "read-dbc"), expect(dead_code, reason = "only DBC files have them"))]
    Float,
}

impl Bits {
    /// Their value; none where the message is too short.
    fn of(self, bytes: &[u8]) -> Option<u64> {
        let bit = |at: u64| Some(u64::from(bytes.get(usize::try_from(at / 8).ok()?)? >> (at % 8) & 1));
        let mut value = 0;
        let mut at = self.start;
        for number in 0..self.size {
            if self.big_endian {
                // From the highest bit on: down the byte, then on to the next byte's top.
                value = value << 1 | bit(at)?;
                at = if at.is_multiple_of(8) { at + 15 } else { at - 1 };
            } else {
                value |= bit(self.start + number)? << number;
            }
        }
        Some(value)
    }

    /// The number of the last byte that any of them is in, from 0.
    #[cfg(feature = "read-dbc")]
    pub(crate) fn last_byte(self) -> u64 {
        match self.big_endian {
            // From the first bit down to its byte's end, and whole bytes from there on.
            true => self.start / 8 + (self.size + 7 - self.start % 8 - 1) / 8,
            false => (self.start + self.size - 1) / 8,
        }
    }

    fn ones(self) -> u64 {
        if self.size >= 64 { u64::MAX } else { (1 << self.size) - 1 }
    }
}

impl Field {
    /// Whole bytes of a J1939 parameter group, low byte first, from byte `first` on, counted from 0; `count` is 1 to 8.
    pub fn bytes_of(group: u32, first: u8, count: u8) -> Self {
        let bits =
            Bits { start: u64::from(first) * 8, size: u64::from(count.clamp(1, 8)) * 8, big_endian: false };
        Self {
            address: Address::Group(group),
            bits,
            scale: 1.0,
            offset: 0.0,
            kind: Kind::Unsigned,
            only_if: None,
            knows_missing: false,
            largest_raw: None,
            names: Vec::new(),
            unit: String::new(),
        }
    }

    /// A signal of a message of ours, both by their names in the table; one of more than eight bytes is put together of its fast packet.
    pub fn of_ours(message: &str, signal: &str) -> Option<Self> {
        let message = MESSAGES.iter().find(|known| known.name == message)?;
        let signal = message.signals.iter().find(|known| known.name == signal)?;
        let value = |raw: u64| raw as f64 * signal.scale + signal.offset;
        Some(Self {
            address: Address::Group(message.pgn),
            bits: Bits { start: signal.start.into(), size: signal.bits.into(), big_endian: false },
            scale: signal.scale,
            offset: signal.offset,
            kind: if signal.signed { Kind::Signed } else { Kind::Unsigned },
            only_if: None,
            knows_missing: true,
            largest_raw: largest_raw(signal.bits.into()).filter(|_| !signal.signed),
            names: signal.names.iter().map(|(raw, name)| (value(*raw), (*name).to_owned())).collect(),
            unit: signal.unit.to_owned(),
        })
    }

    /// True if a message of these bytes holds it: it is long enough, and the switch of a multiplexed one is set to it.
    pub fn is_in(&self, bytes: &[u8]) -> bool {
        let switched = |(bits, wanted): (Bits, u64)| bits.of(bytes) == Some(wanted);
        self.bits.of(bytes).is_some() && self.only_if.is_none_or(switched)
    }

    /// Its value in a message of these bytes; none where it is not in it, not available, or an error code.
    pub fn value(&self, bytes: &[u8]) -> Option<f64> {
        let raw = self.bits.of(bytes).filter(|_| self.is_in(bytes))?;
        let missing = if self.kind == Kind::Signed { self.bits.ones() >> 1 } else { self.bits.ones() };
        if self.knows_missing && self.bits.size > 1 && raw == missing {
            return None;
        }
        if self.largest_raw.is_some_and(|largest| raw > largest) {
            return None;
        }
        let unused = 64 - self.bits.size;
        let number = match self.kind {
            Kind::Unsigned => raw as f64,
            Kind::Signed => ((raw << unused) as i64 >> unused) as f64,
            Kind::Float if self.bits.size == 32 => f32::from_bits(raw as u32).into(),
            Kind::Float => f64::from_bits(raw),
        };
        Some(number * self.scale + self.offset)
    }

    /// The value called `name`, where its values have names.
    pub fn named(&self, name: &str) -> Option<f64> {
        self.names.iter().find(|(_, known)| known == name).map(|(value, _)| *value)
    }

    /// Its values that have names, with those.
    pub fn named_values(&self) -> &[(f64, String)] {
        &self.names
    }

    /// The names of its values.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.names.iter().map(|(_, name)| name.as_str())
    }
}
