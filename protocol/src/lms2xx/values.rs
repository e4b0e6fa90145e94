//! Measured values: units, measuring modes with their flag bits, codes at the top of the range, and the telegrams that carry them.

use alloc::vec::Vec;

pub use super::output::{MAX_PARTS, Output, Parts, Span, When};
use super::words::{put_words, read_words, word};
use crate::optics::DAZZLED;
use crate::scan::{self, NO_ECHO};

/// Unit of the values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Unit {
    /// Centimetres.
    Cm = 0,
    /// Millimetres.
    #[default]
    Mm = 1,
}

impl Unit {
    /// The unit of this code, in the configuration block, the status and the count word.
    pub fn of(code: u8) -> Option<Self> {
        match code {
            0 => Some(Self::Cm),
            1 => Some(Self::Mm),
            _ => None,
        }
    }

    /// Digits a metre.
    pub fn per_metre(self) -> f64 {
        match self {
            Self::Cm => 100.0,
            Self::Mm => 1000.0,
        }
    }

    /// Millimetres in this unit.
    pub fn digits(self, range_mm: u16) -> u16 {
        match self {
            Self::Cm => (range_mm + 5 * u16::from(range_mm < u16::MAX - 5)) / 10,
            Self::Mm => range_mm,
        }
    }
}

/// What the bits of a value mean: byte D of the configuration block.
///
/// | mode | range | upper bits |
/// |---|---|---|
/// | 0 | 13 bits | fields A, B, dazzle |
/// | 1 | 13 bits | reflectivity 0..7 |
/// | 2 | 13 bits | fields A, B, C |
/// | 3 | 14 bits | reflectivity 0..3 |
/// | 4 | 14 bits | fields A, B |
/// | 5 | 15 bits | reflector |
/// | 6 | 15 bits | field A |
/// | 0F | 15 bits | none |
/// | 0D, 0E | 15 bits, assumed | none; remission beside the range (`F5`), normalised or direct |
/// | 3F | – | the value is a reflectivity |
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MeasuringMode(pub u8);

/// Reasons to have no range: how far below the top of the field their code lies. The same in every width, as recorded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u16)]
#[non_exhaustive]
pub enum NoRange {
    /// Not valid.
    NotValid = 0,
    /// Dazzled.
    Dazzled = 1,
    /// The value does not fit.
    Overflow = 2,
    /// Signal too weak: what a beam without an echo reads.
    Weak = 4,
    /// Error reading a channel.
    Channel = 5,
    /// Above the range.
    Above = 8,
}

impl NoRange {
    const ALL: [Self; 6] =
        [Self::NotValid, Self::Dazzled, Self::Overflow, Self::Weak, Self::Channel, Self::Above];
}

impl MeasuringMode {
    /// 32 m, one flag for field A: what public clients set for millimetres.
    pub const RANGE_32_M: Self = Self(6);
    /// Remission beside the range, normalised: what a public client sets for that. The listing has it as reserved, and SICK's Quick Manual
    /// prints a device in it.
    pub const WITH_REMISSION: Self = Self(0x0D);

    /// True if a device has it.
    pub fn is_known(self) -> bool {
        matches!(self.0, 0..=6 | 0x0D..=0x0F | 0x3F)
    }

    /// Bits of the range.
    pub fn range_bits(self) -> u32 {
        match self.0 {
            3 | 4 => 14,
            5 | 6 | 0x0D..=0x0F => 15,
            0x3F => 16,
            _ => 13,
        }
    }

    fn top(self) -> u16 {
        u16::MAX >> (16 - self.range_bits())
    }

    /// The bits of the fields A, B and C in a value, lowest first; none where the mode does not tell of that field.
    pub fn field_bits(self) -> [u16; 3] {
        const BIT_13: u16 = 1 << 13;
        const BIT_14: u16 = 1 << 14;
        const BIT_15: u16 = 1 << 15;
        match self.0 {
            0 => [BIT_13, BIT_14, 0],
            2 => [BIT_13, BIT_14, BIT_15],
            4 => [BIT_14, BIT_15, 0],
            6 => [BIT_15, 0, 0],
            _ => [0; 3],
        }
    }

    /// The code of this reason.
    pub fn code(self, reason: NoRange) -> u16 {
        self.top() - reason as u16
    }

    /// A measured range, millimetres (0 for none, with the remission [`DAZZLED`] for that reason), as a value; `remission` on the 16-bit scale where the mode carries it.
    pub fn encode(self, unit: Unit, range_mm: u16, remission: u16) -> u16 {
        let levels = match self.0 {
            0x3F => return remission >> 8,
            1 | 3 => remission >> self.range_bits() << self.range_bits(),
            _ => 0,
        };
        let top = self.top();
        let farthest = self.farthest();
        levels
            | match unit.digits(range_mm) {
                _ if (range_mm, remission) == (0, DAZZLED) => top - NoRange::Dazzled as u16,
                _ if range_mm == 0 => top - NoRange::Weak as u16,
                digits if digits > farthest => top - NoRange::Above as u16,
                digits => digits,
            }
    }

    /// Why a value holds no range; `None` if it holds one.
    pub fn no_range(self, value: u16) -> Option<NoRange> {
        let below_top = self.top() - (value & self.top());
        NoRange::ALL.into_iter().find(|reason| *reason as u16 == below_top)
    }

    /// Metres, [`scan::DAZZLED`] where the receiver was dazzled, else [`NO_ECHO`] where the value holds none. All values above the farthest range are
    /// codes, also those without a name.
    pub fn decode_m(self, unit: Unit, value: u16) -> f64 {
        match value & self.top() {
            _ if self.no_range(value) == Some(NoRange::Dazzled) => scan::DAZZLED,
            range if range > self.farthest() => NO_ECHO,
            range => f64::from(range) / unit.per_metre(),
        }
    }

    /// The greatest value that is a range.
    fn farthest(self) -> u16 {
        self.top() - NoRange::Above as u16 - 1
    }

    /// The mode that `values` are most likely of, where a log does not say it: the narrowest field whose codes are among them and
    /// above which there is nothing; 15 bits without a code.
    pub fn guess(unit: Unit, values: &[u16]) -> Self {
        if unit == Unit::Cm {
            return Self(0);
        }
        let greatest = values.iter().copied().max().unwrap_or(0);
        let fits = |mode: &Self| greatest <= mode.top() && greatest > mode.farthest();
        [Self(0), Self(4)].into_iter().find(fits).unwrap_or(Self::RANGE_32_M)
    }
}

/// The word before the values: how many, which turn of an interlaced scan, which unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CountWord {
    /// Values that follow.
    pub count: u16,
    /// Which turn, in quarter degrees, where the telegram holds a part of an interlaced scan.
    pub partial: Option<u8>,
    /// Their unit; `None` for one that is not known.
    pub unit: Option<Unit>,
}

const COUNT: u16 = 0x03FF;
const PARTIAL: u16 = 0x2000;

impl CountWord {
    /// As it is sent; bits that mean nothing are 0, as clients differ in which they look at.
    pub fn encode(self) -> u16 {
        let partial = self.partial.map_or(0, |index| PARTIAL | u16::from(index & 3) << 11);
        self.count & COUNT | partial | (self.unit.unwrap_or_default() as u16) << 14
    }

    /// Reads one.
    pub fn decode(word: u16) -> Self {
        Self {
            count: word & COUNT,
            partial: (word & PARTIAL != 0).then_some((word >> 11 & 3) as u8),
            unit: Unit::of((word >> 14) as u8),
        }
    }
}

/// A scan telegram, before it is framed: what a device fills and a host reads.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Values {
    /// The form in which the values were sent.
    pub output: Output,
    /// Their number, part and unit.
    pub word: CountWord,
    /// The values.
    pub values: Vec<u16>,
    /// Reflectivities that come with them.
    pub reflectivity: Vec<u8>,
    /// Reflectivities of the parts of an `F5`, 0 to about 13 000; one a value.
    pub part_reflectivity: Vec<u16>,
    /// Counts mirror turns, where the configuration asks for it.
    pub real_time_index: Option<u8>,
    /// Counts telegrams of values; always beside the other index.
    pub telegram_index: Option<u8>,
    /// The device's status.
    pub status: u8,
}

/// Why a body is not a scan telegram.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ValuesError {
    /// Another command.
    #[error("expected a scan telegram (B0, B6, B7, BE, BF, C4, F5, F6), found {0:02X}")]
    Command(u8),
    /// It ends early.
    #[error("{expected} values announced, {found} bytes found")]
    Short {
        /// Announced.
        expected: u16,
        /// Left for them.
        found: usize,
    },
    /// The header ends early.
    #[error("the header of the values ends after {0} bytes")]
    Header(usize),
}

/// Takes fields off the front of a body.
struct Cursor<'a>(&'a [u8]);

impl Cursor<'_> {
    fn byte(&mut self) -> Result<u8, ValuesError> {
        let (&byte, rest) = self.0.split_first().ok_or(ValuesError::Header(0))?;
        self.0 = rest;
        Ok(byte)
    }

    fn word(&mut self) -> Result<u16, ValuesError> {
        let (bytes, rest) = self.0.split_first_chunk::<2>().ok_or(ValuesError::Header(self.0.len()))?;
        self.0 = rest;
        Ok(word(*bytes))
    }

    fn span(&mut self) -> Result<Span, ValuesError> {
        Ok(Span { first: self.word()?, last: self.word()? })
    }
}

impl Values {
    /// Appends the body: command, header, values, status.
    pub fn encode(&self, out: &mut Vec<u8>) {
        out.push(self.output.command());
        match self.output {
            Output::Mean { scans } => out.push(scans),
            Output::Range(span)
            | Output::Direct(span)
            | Output::Segments { span, .. }
            | Output::Fields(span)
            | Output::Cartesian(span) => put_words(&span.words(), out),
            Output::MeanRange { scans, span } => {
                out.push(scans);
                put_words(&span.words(), out);
            }
            Output::Parts(parts) => return self.encode_parts(parts, out),
            Output::All
            | Output::Partial
            | Output::Reflectivity(_)
            | Output::Every(_)
            | Output::Minima(_)
            | Output::Perpendicular(_)
            | Output::Taught => {}
        }
        put_words(&[self.word.encode()], out);
        put_words(&self.values, out);
        if let Output::Reflectivity(span) = self.output {
            put_words(&[self.reflectivity.len() as u16, span.first, span.last], out);
            out.extend_from_slice(&self.reflectivity);
        }
        self.encode_end(out);
    }

    /// Part by part: its values in pairs of range and reflectivity.
    fn encode_parts(&self, parts: Parts, out: &mut Vec<u8>) {
        put_words(&[parts.spans().len() as u16], out);
        let mut pairs = self.values.iter().zip(&self.part_reflectivity);
        for span in parts.spans() {
            let count = CountWord { count: span.count(), partial: None, unit: self.word.unit };
            put_words(&[span.first, span.last, count.encode()], out);
            for (range, reflectivity) in pairs.by_ref().take(span.count().into()) {
                put_words(&[*range, *reflectivity], out);
            }
        }
        self.encode_end(out);
    }

    fn encode_end(&self, out: &mut Vec<u8>) {
        out.extend(self.real_time_index);
        out.extend(self.telegram_index);
        out.push(self.status);
    }

    /// Reads a body into `self`, whose buffers are used again.
    pub fn decode_into(&mut self, body: &[u8]) -> Result<(), ValuesError> {
        let mut cursor = Cursor(body);
        let command = cursor.byte()?;
        let output = match command {
            0xB0 => Output::All,
            0xB6 => Output::Mean { scans: cursor.byte()? },
            0xB7 => Output::Range(cursor.span()?),
            0xBF => Output::MeanRange { scans: cursor.byte()?, span: cursor.span()? },
            0xC4 => Output::Reflectivity(Span { first: 0, last: 0 }),
            0xBE => Output::Fields(cursor.span()?),
            0xF6 => Output::Cartesian(cursor.span()?),
            0xF5 => return self.decode_parts(cursor),
            other => return Err(ValuesError::Command(other)),
        };
        self.word = CountWord::decode(cursor.word()?);
        let Some((values, rest)) = cursor.0.split_at_checked(2 * usize::from(self.word.count)) else {
            return Err(ValuesError::Short { expected: self.word.count, found: cursor.0.len() });
        };
        cursor.0 = rest;
        self.values.clear();
        read_words(values, &mut self.values);
        self.reflectivity.clear();
        self.part_reflectivity.clear();
        self.output = match output {
            Output::Reflectivity(_) => {
                let count = cursor.word()?;
                let span = cursor.span()?;
                let Some((bytes, rest)) = cursor.0.split_at_checked(usize::from(count)) else {
                    return Err(ValuesError::Short { expected: count, found: cursor.0.len() });
                };
                self.reflectivity.extend_from_slice(bytes);
                cursor.0 = rest;
                Output::Reflectivity(span)
            }
            Output::All if self.word.partial.is_some() => Output::Partial,
            Output::Range(span) if self.word.partial.is_some() => Output::Direct(span),
            other => other,
        };
        self.decode_end(cursor)
    }

    fn decode_parts(&mut self, mut cursor: Cursor<'_>) -> Result<(), ValuesError> {
        self.values.clear();
        self.reflectivity.clear();
        self.part_reflectivity.clear();
        let count = cursor.word()?;
        let mut spans = Vec::new();
        for _ in 0..count {
            // More than a device sends: no telegram of values.
            if spans.len() == MAX_PARTS {
                return Err(ValuesError::Short { expected: count, found: MAX_PARTS });
            }
            spans.push(cursor.span()?);
            self.word = CountWord::decode(cursor.word()?);
            let Some((pairs, rest)) = cursor.0.split_at_checked(4 * usize::from(self.word.count)) else {
                return Err(ValuesError::Short { expected: self.word.count, found: cursor.0.len() });
            };
            cursor.0 = rest;
            for &[a, b, c, d] in pairs.as_chunks::<4>().0 {
                self.values.push(word([a, b]));
                self.part_reflectivity.push(word([c, d]));
            }
        }
        let parts = Parts::new(&spans).ok_or(ValuesError::Header(2))?;
        self.word.count = u16::try_from(self.values.len()).unwrap_or(u16::MAX);
        self.output = Output::Parts(parts);
        self.decode_end(cursor)
    }

    /// Whatever stands between the values and the status is indices, the real-time index first.
    fn decode_end(&mut self, cursor: Cursor<'_>) -> Result<(), ValuesError> {
        let Some((&status, indices)) = cursor.0.split_last() else { return Err(ValuesError::Header(0)) };
        self.status = status;
        self.real_time_index = indices.first().copied();
        self.telegram_index = indices.get(1).copied();
        Ok(())
    }
}

impl Default for Values {
    fn default() -> Self {
        Self {
            output: Output::All,
            word: CountWord { count: 0, partial: None, unit: Some(Unit::Mm) },
            values: Vec::new(),
            reflectivity: Vec::new(),
            part_reflectivity: Vec::new(),
            real_time_index: None,
            telegram_index: None,
            status: 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_above_the_farthest_range_is_a_code() {
        for (mode, top) in [(MeasuringMode(0), 8191), (MeasuringMode(4), 16_383), (MeasuringMode(6), 32_767)]
        {
            for value in (top - 8..=top).filter(|value| *value != top - 1) {
                assert_eq!(mode.decode_m(Unit::Mm, value), NO_ECHO, "{value} in mode {}", mode.0);
            }
            assert!(mode.decode_m(Unit::Mm, top - 1).is_nan(), "dazzled");
            assert_eq!(mode.decode_m(Unit::Mm, top - 9), f64::from(top - 9) / 1000.0);
        }
    }

    #[test]
    fn a_beam_that_is_dazzled_or_met_nothing_has_its_code() {
        for mode in [MeasuringMode(0), MeasuringMode(4), MeasuringMode::RANGE_32_M] {
            for unit in [Unit::Mm, Unit::Cm] {
                let reason = |range_mm, remission| mode.no_range(mode.encode(unit, range_mm, remission));
                assert_eq!(reason(0, DAZZLED), Some(NoRange::Dazzled));
                assert_eq!(reason(0, 0), Some(NoRange::Weak));
                // A reflector has that remission too.
                assert_eq!(reason(2000, DAZZLED), None);
            }
        }
    }

    #[test]
    fn codes_tell_the_mode_where_a_log_does_not() {
        assert_eq!(MeasuringMode::guess(Unit::Mm, &[1200, 8187, 8183]), MeasuringMode(0));
        assert_eq!(MeasuringMode::guess(Unit::Mm, &[1200, 9000, 16_383]), MeasuringMode(4));
        assert_eq!(MeasuringMode::guess(Unit::Mm, &[1200, 8187, 9000]), MeasuringMode::RANGE_32_M);
        assert_eq!(MeasuringMode::guess(Unit::Mm, &[1200, 1300]), MeasuringMode::RANGE_32_M);
        assert_eq!(MeasuringMode::guess(Unit::Cm, &[1200, 8187]), MeasuringMode(0));
    }
}
