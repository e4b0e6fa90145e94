//! When a fault begins and how long it lasts.

use std::time::Duration;

use rowscan_settings::{Located, TomlError, suggestion};

use rowscan_settings::fault_table::{read_number, read_text, read_whole};

/// The moment a fault begins, or is over.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum At {
    /// At once.
    #[default]
    Start,
    /// Seconds on the faults' clock.
    Time(Duration),
    /// The scan telegram of this number on a connection, from 1.
    Scan(u64),
    /// The client sends this command, on any connection: its kind and name as in CoLa A, or an LMS2xx's request in hex digits.
    Command(String),
    /// After a fault's begin or end.
    After {
        /// The other fault.
        id: String,
        /// Its end, else its begin.
        end: bool,
        /// Later by this.
        plus: Duration,
    },
    /// The tractor is so far along the row, metres.
    RowM(f64),
    /// The tractor is beside this tree, from 1.
    Tree(u32),
}

/// How long a fault lasts, or from one beginning to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lasts {
    /// So long.
    Time(Duration),
    /// So many scan telegrams of its stream.
    Scans(u64),
}

const AT_KEYS: &[&str] = &["s", "scan", "command", "row_m", "tree", "after", "plus_s"];
const LASTS_KEYS: &[&str] = &["s", "scans"];
/// A century, in seconds: more is a mistake, and would overflow.
const LONGEST_S: f64 = 3.2e9;

fn seconds(found: &Located) -> Result<Duration, TomlError> {
    read_number(found, 0.0, LONGEST_S).map(Duration::from_secs_f64)
}

fn unknown(line: usize, key: &str, valid: &[&str]) -> TomlError {
    TomlError { line, message: format!("unknown key `{key}`{}", suggestion(key, valid)) }
}

fn positive(found: &Located) -> Result<u64, TomlError> {
    read_whole(found, 1, i64::MAX).map(i64::unsigned_abs)
}

impl At {
    pub(crate) fn read(found: &Located) -> Result<Self, TomlError> {
        let line = found.line;
        let table = found.clone().into_table()?;
        let mut plus = None;
        let mut at = None;
        for (key, value) in &table.entries {
            let read = match key.as_str() {
                "s" => Self::Time(seconds(value)?),
                "scan" => Self::Scan(positive(value)?),
                "row_m" => Self::RowM(read_number(value, -1e6, 1e6)?),
                "tree" => {
                    Self::Tree(u32::try_from(read_whole(value, 1, i64::from(u32::MAX))?).unwrap_or(u32::MAX))
                }
                "after" => Self::after(read_text(value, "the id of a fault, or `ID.end`")?),
                "plus_s" => {
                    plus = Some((value.line, seconds(value)?));
                    continue;
                }
                "command" => Self::command(value)?,
                key => return Err(unknown(value.line, key, AT_KEYS)),
            };
            if at.replace(read).is_some() {
                let message = format!("expected one of {}, found several", AT_KEYS.join(", "));
                return Err(TomlError { line, message });
            }
        }
        match (at, plus) {
            (Some(Self::After { id, end, .. }), plus) => {
                Ok(Self::After { id, end, plus: plus.map_or(Duration::ZERO, |(_, plus)| plus) })
            }
            (_, Some((line, _))) => {
                Err(TomlError { line, message: "`plus_s` goes with `after`; leave it out".to_owned() })
            }
            (Some(at), None) => Ok(at),
            (None, None) => {
                Err(TomlError { line, message: format!("expected one of {}", AT_KEYS.join(", ")) })
            }
        }
    }

    fn command(found: &Located) -> Result<Self, TomlError> {
        const EXPECTED: &str = "a command such as \"sWN LMDscandatacfg\", or \"20\" of an LMS2xx";
        let command = read_text(found, EXPECTED)?.trim();
        if command.is_empty() {
            return Err(TomlError {
                line: found.line,
                message: format!("expected {EXPECTED}, found an empty text"),
            });
        }
        Ok(Self::Command(command.to_owned()))
    }

    fn after(text: &str) -> Self {
        let (id, end) = match (text.strip_suffix(".end"), text.strip_suffix(".begin")) {
            (Some(id), _) => (id, true),
            (None, Some(id)) => (id, false),
            (None, None) => (text, false),
        };
        Self::After { id: id.to_owned(), end, plus: Duration::ZERO }
    }

    /// True if what passes on a stream is what it waits for.
    pub(crate) fn needs_stream(&self) -> bool {
        matches!(self, Self::Scan(_) | Self::Command(_))
    }

    /// True if it needs to know where the tractor is.
    pub fn needs_row(&self) -> bool {
        matches!(self, Self::RowM(_) | Self::Tree(_))
    }
}

impl Lasts {
    pub(crate) fn read(found: &Located) -> Result<Self, TomlError> {
        let line = found.line;
        let table = found.clone().into_table()?;
        let mut entries = table.entries.iter();
        let (Some((key, value)), None) = (entries.next(), entries.next()) else {
            return Err(TomlError { line, message: "expected one of `s`, `scans`".to_owned() });
        };
        match key.as_str() {
            "s" => seconds(value).map(Self::Time),
            "scans" => positive(value).map(Self::Scans),
            key => Err(unknown(value.line, key, LASTS_KEYS)),
        }
    }
}
