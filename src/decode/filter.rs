//! Which telegrams are shown.

use rowscan_protocol::telegram::Kind;

use super::{Entry, Verdict};

/// Chooses telegrams by name and kind. The default shows everything.
#[derive(Clone, Debug, Default)]
pub struct Filter {
    /// Show these names alone; all, where it is empty.
    pub only: Vec<String>,
    /// Hide these names.
    pub not: Vec<String>,
    /// Show events (`sSN`) alone.
    pub events: bool,
}

impl Filter {
    /// True if it shows everything.
    pub fn is_empty(&self) -> bool {
        self.only.is_empty() && self.not.is_empty() && !self.events
    }

    /// True if `entry` is shown. Damage whose name is not known is always shown: it may be what is looked for.
    pub fn shows(&self, entry: &Entry) -> bool {
        let Some(name) = &entry.name else {
            return entry.is == Verdict::Bad && entry.kind.is_none() || self.only.is_empty() && !self.events;
        };
        (self.only.is_empty() || self.only.contains(name))
            && !self.not.contains(name)
            && (!self.events || entry.kind == Some(Kind::Sn.letters()))
    }
}
