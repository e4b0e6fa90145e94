//! How many of what, in messages: "1 gap", "2 gaps".

use core::fmt::{Display, Formatter, Result};

/// A number with what it counts.
#[derive(Clone, Copy, Debug)]
pub struct Plural<'a> {
    count: u64,
    one: &'a str,
    several: &'a str,
}

/// `count` of what `one` is called alone, and `several` together; a verb that goes with the number may follow.
///
/// ```
/// use rowscan_protocol::plural::plural;
///
/// let told = |count| format!("{} late", plural(count, "scan is", "scans are"));
/// assert_eq!([0, 1, 2].map(told), ["0 scans are late", "1 scan is late", "2 scans are late"]);
/// ```
pub fn plural<'a>(count: u64, one: &'a str, several: &'a str) -> Plural<'a> {
    Plural { count, one, several }
}

impl Display for Plural<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let Self { count, one, several } = self;
        write!(f, "{count} {}", if *count == 1 { one } else { several })
    }
}
