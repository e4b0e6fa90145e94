//! When the drive starts.

use std::fmt;
use std::str::FromStr;

use crate::clock::TimeScale;

/// What sets the tractor going. A taker is a scan subscription, a poll or an LMS2xx that streams; in a rig without scanners, a client or
/// file that takes CAN frames or GNSS sentences.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StartWhen {
    /// The first scanner that has a taker.
    First,
    /// Every scanner of the rig has a taker.
    All,
    /// The start of simulated time.
    Now,
}

impl StartWhen {
    /// All choices with the words that name them.
    pub const CHOICES: [(&'static str, Self); 3] =
        [("first", Self::First), ("all", Self::All), ("now", Self::Now)];

    /// What holds at this time scale unless told otherwise: a paced drive waits for nobody but its first taker; where nothing may be lost,
    /// all takers see it from its start.
    pub fn default_at(scale: TimeScale) -> Self {
        match scale {
            TimeScale::Paced(_) => Self::First,
            TimeScale::Max => Self::All,
        }
    }
}

/// A word that names no start.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("expected `first`, `all` or `now`, found `{0}`")]
pub struct StartWhenError(String);

impl FromStr for StartWhen {
    type Err = StartWhenError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let found = Self::CHOICES.iter().find(|(name, _)| *name == text);
        found.map(|(_, start)| *start).ok_or_else(|| StartWhenError(text.to_owned()))
    }
}

impl fmt::Display for StartWhen {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = Self::CHOICES.iter().find(|(_, start)| start == self).map_or("", |(name, _)| name);
        f.write_str(name)
    }
}
