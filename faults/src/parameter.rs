//! What a fault takes, as the table lists it.

/// One parameter of a fault.
#[derive(Debug)]
pub struct Parameter {
    /// Its key, with the unit.
    pub key: &'static str,
    /// What it takes.
    pub form: Form,
    /// What holds where it is absent, in words.
    pub default: &'static str,
    /// What it says.
    pub about: &'static str,
}

/// What a parameter takes.
#[derive(Clone, Copy, Debug)]
pub enum Form {
    /// A number in this range.
    Number(f64, f64),
    /// An integer in this range.
    Whole(i64, i64),
    /// An integer in this range, or a list of them.
    Wholes(i64, i64),
    /// One of these words.
    Word(&'static [&'static str]),
    /// Bytes as hex digits.
    Hex,
}
