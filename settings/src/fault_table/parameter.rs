//! What a fault takes, as the table lists it.

/// One parameter of a fault.
#[derive(Clone, Copy, Debug)]
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
    /// A number in this range, and not 0: with that nothing would happen.
    Strength(f64, f64),
    /// An integer in this range.
    Whole(i64, i64),
    /// An integer in this range, or a list of them.
    Wholes(i64, i64),
    /// One of these words.
    Word(&'static [&'static str]),
    /// Bytes as hex digits.
    Hex,
    /// `true` or `false`.
    Flag,
    /// Any text; what it may be, in words.
    Text(&'static str),
    /// Two numbers in this range.
    Pair(f64, f64),
    /// A list of pairs of milliseconds and a number in this range.
    Timed(f64, f64),
}

impl Form {
    /// What it takes, in words.
    pub fn words(self) -> String {
        match self {
            Self::Number(low, high) => format!("number, {low} to {high}"),
            Self::Strength(low, high) => format!("number, {low} to {high}, not 0"),
            Self::Whole(low, high) => format!("integer, {low} to {high}"),
            Self::Wholes(low, high) => format!("integer or list of them, {low} to {high}"),
            Self::Word(words) => words.iter().map(|word| format!("`{word}`")).collect::<Vec<_>>().join(", "),
            Self::Hex => "hex digits".to_owned(),
            Self::Flag => "`true`, `false`".to_owned(),
            Self::Text(words) => words.to_owned(),
            Self::Pair(low, high) => format!("two numbers, {low} to {high}"),
            Self::Timed(low, high) => format!("list of [ms, number from {low} to {high}]"),
        }
    }
}

impl Parameter {
    /// A line of a fault's parameters.
    pub const fn new(key: &'static str, form: Form, default: &'static str, about: &'static str) -> Self {
        Self { key, form, default, about }
    }
}
