//! A number with where it comes from.

use core::fmt;

/// A number and its evidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fact {
    /// The number, in the unit that the field's name says.
    pub value: f64,
    /// Where it comes from.
    pub tag: Tag,
}

/// Where a number comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tag {
    /// A document: manual, data sheet or paper.
    Source(&'static str),
    /// Measured in public recordings of static indoor scenes, 0.06 to 3 m.
    Recorded,
    /// A catalogue or paper number whose text was not found again.
    Memory,
    /// Assumed.
    Assumed,
    /// Derived from other numbers.
    Derived,
}

impl fmt::Display for Tag {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Source(document) => write!(f, "[{document}]"),
            Self::Recorded => f.write_str("[REC]"),
            Self::Memory => f.write_str("[MEM]"),
            Self::Assumed => f.write_str("[ASM]"),
            Self::Derived => f.write_str("[DER]"),
        }
    }
}

impl fmt::Display for Fact {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.value, self.tag)
    }
}

impl Fact {
    /// A number from a document.
    pub const fn from(document: &'static str, value: f64) -> Self {
        Self { value, tag: Tag::Source(document) }
    }

    /// A recorded number.
    pub const fn recorded(value: f64) -> Self {
        Self { value, tag: Tag::Recorded }
    }

    /// A number from memory.
    pub const fn memory(value: f64) -> Self {
        Self { value, tag: Tag::Memory }
    }

    /// An assumed number.
    pub const fn assumed(value: f64) -> Self {
        Self { value, tag: Tag::Assumed }
    }

    /// A derived number.
    pub const fn derived(value: f64) -> Self {
        Self { value, tag: Tag::Derived }
    }
}
