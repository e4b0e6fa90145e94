//! In which form measured values are sent.

use alloc::vec::Vec;

use super::words::word;

/// Which values a scan telegram carries, and how.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Output {
    /// `B0`: all.
    All,
    /// `B0` with the partial scan's index: one mirror turn of an interlaced scan a telegram.
    Partial,
    /// `B6`: the mean of so many scans.
    Mean {
        /// How many.
        scans: u8,
    },
    /// `B7`: these, counted from 1.
    Range(Span),
    /// `BF`: these, the mean of so many scans.
    MeanRange {
        /// How many.
        scans: u8,
        /// Which values.
        span: Span,
    },
    /// `C4`: all ranges, and the reflectivity of these.
    Reflectivity(Span),
    /// `B0`: every so many-th value, from the first on.
    Every(u8),
    /// `F5`: range and reflectivity of these parts.
    Parts(Parts),
    /// `B7`: these, one telegram a mirror turn of an interlaced scan.
    Direct(Span),
    /// `B7`: the smallest value of each of so many equal segments of these.
    Segments {
        /// How many.
        segments: u8,
        /// Which values.
        span: Span,
    },
    /// `BE`: these, each with the borders of the three fields.
    Fields(Span),
    /// `F6`: these, as X and Y.
    Cartesian(Span),
    /// `B0`: the smallest value of each segment of field A.
    Minima(When),
    /// `B0`: the smallest perpendicular distance in each field.
    Perpendicular(When),
    /// `B0`: what was taught in.
    Taught,
}

impl Output {
    /// True if its values are named by their numbers in a scan: what angles they are of, only the scan's angle and resolution tell.
    pub(super) fn names_values(self) -> bool {
        match self {
            Self::Range(_)
            | Self::MeanRange { .. }
            | Self::Every(_)
            | Self::Parts(_)
            | Self::Direct(_)
            | Self::Segments { .. }
            | Self::Fields(_)
            | Self::Cartesian(_) => true,
            Self::All
            | Self::Partial
            | Self::Mean { .. }
            | Self::Reflectivity(_)
            | Self::Minima(_)
            | Self::Perpendicular(_)
            | Self::Taught => false,
        }
    }
}

/// Which scans are sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum When {
    /// All.
    Always,
    /// Those with an object in a field.
    Infringed,
}

/// Up to five parts of a scan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Parts {
    spans: [Span; MAX_PARTS],
    count: u8,
}

/// Parts that one request can name.
pub const MAX_PARTS: usize = 5;

impl Parts {
    /// These parts; `None` unless there are one to five.
    pub fn new(spans: &[Span]) -> Option<Self> {
        let mut parts = Self { count: u8::try_from(spans.len()).ok()?, ..Self::default() };
        parts.spans.get_mut(..spans.len())?.copy_from_slice(spans);
        (!spans.is_empty()).then_some(parts)
    }

    /// Reads the number of parts and the parts.
    pub(super) fn parse(data: &[u8]) -> Option<Self> {
        let (count, rest) = data.split_first_chunk::<2>()?;
        let count = usize::from(word(*count));
        let spans = rest.as_chunks::<4>().0.get(..count).filter(|spans| spans.len() <= MAX_PARTS)?;
        let spans: Vec<Span> = spans.iter().map(|bytes| Span::of_bytes(*bytes)).collect();
        Self::new(&spans)
    }

    /// The parts.
    pub fn spans(&self) -> &[Span] {
        self.spans.get(..usize::from(self.count)).unwrap_or_default()
    }
}

/// Values counted from 1, both ends in it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Span {
    /// The first.
    pub first: u16,
    /// The last.
    pub last: u16,
}

impl Span {
    /// Two words.
    pub(super) fn of_bytes([a, b, c, d]: [u8; 4]) -> Self {
        Self { first: word([a, b]), last: word([c, d]) }
    }

    /// The same, to be written.
    pub(super) fn words(self) -> [u16; 2] {
        [self.first, self.last]
    }

    /// True if a scan of `count` values has them.
    pub fn lies_within(self, count: u16) -> bool {
        (1..=self.last).contains(&self.first) && self.last <= count
    }

    /// How many values it names.
    pub fn count(self) -> u16 {
        self.last.saturating_add(1).saturating_sub(self.first)
    }

    /// The part of `values` it names.
    pub fn of<T>(self, values: &[T]) -> &[T] {
        values.get(usize::from(self.first.max(1) - 1)..usize::from(self.last)).unwrap_or_default()
    }
}

/// Values of all parts of one `F5` together: those of the longest scan. That parts may not repeat values is assumed.
const MAX_PAIRS: u32 = 401;
/// Segments of a `20 2C`.
const MAX_SEGMENTS: u8 = 201;
/// Values of one `BE`, and of one `F6`.
const MAX_WITH_FIELDS: u16 = 100;
const MAX_CARTESIAN: u16 = 200;

/// Scans that go into a mean.
const MEAN_SCANS: core::ops::RangeInclusive<u8> = 2..=250;

impl Output {
    /// The values that it names, where it names one run of them.
    pub fn span(self) -> Option<Span> {
        match self {
            Self::Range(span)
            | Self::Direct(span)
            | Self::MeanRange { span, .. }
            | Self::Segments { span, .. }
            | Self::Fields(span)
            | Self::Cartesian(span)
            | Self::Reflectivity(span) => Some(span),
            _ => None,
        }
    }

    /// Scans that go into one telegram.
    pub fn scans(self) -> u8 {
        match self {
            Self::Mean { scans } | Self::MeanRange { scans, .. } => scans.max(1),
            _ => 1,
        }
    }

    /// The telegram's command.
    pub fn command(self) -> u8 {
        match self {
            Self::All
            | Self::Partial
            | Self::Every(_)
            | Self::Minima(_)
            | Self::Perpendicular(_)
            | Self::Taught => 0xB0,
            Self::Mean { .. } => 0xB6,
            Self::Range(_) | Self::Direct(_) | Self::Segments { .. } => 0xB7,
            Self::Fields(_) => 0xBE,
            Self::Cartesian(_) => 0xF6,
            Self::MeanRange { .. } => 0xBF,
            Self::Reflectivity(_) => 0xC4,
            Self::Parts(_) => 0xF5,
        }
    }

    /// True if a scan of `count` values can be sent in this form.
    pub fn is_possible(self, count: u16) -> bool {
        match self {
            Self::All | Self::Partial | Self::Minima(_) | Self::Perpendicular(_) | Self::Taught => true,
            Self::Every(step) => step >= 1,
            Self::Mean { scans } => MEAN_SCANS.contains(&scans),
            Self::Range(span) | Self::Direct(span) | Self::Reflectivity(span) => span.lies_within(count),
            Self::MeanRange { scans, span } => MEAN_SCANS.contains(&scans) && span.lies_within(count),
            Self::Parts(parts) => {
                let values: u32 = parts.spans().iter().map(|span| u32::from(span.count())).sum();
                values <= MAX_PAIRS && parts.spans().iter().all(|span| span.lies_within(count))
            }
            Self::Segments { segments, span } => {
                (1..=MAX_SEGMENTS).contains(&segments)
                    && span.lies_within(count)
                    && u16::from(segments) <= span.count()
            }
            Self::Fields(span) => span.lies_within(count) && span.count() <= MAX_WITH_FIELDS,
            Self::Cartesian(span) => span.lies_within(count) && span.count() <= MAX_CARTESIAN,
        }
    }
}
