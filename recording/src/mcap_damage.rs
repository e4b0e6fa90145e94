//! What was found wrong with an MCAP file while it was read.

use crate::read::{END, Resumed, Torn};

const WHOLE: &str = "a whole record";

/// All damage of a file: the first of it in words, the rest by its bytes.
#[derive(Debug, Default)]
pub(crate) struct Damage {
    torn: Option<Torn>,
    /// Where the last damage ends: what touches it is the same one.
    ends: Option<u64>,
}

impl Damage {
    /// What is missing; none of a whole file.
    pub(crate) fn torn(&self) -> Option<&Torn> {
        self.torn.as_ref()
    }

    /// Bytes from `begins` to `ends` are lost.
    pub(crate) fn lose(&mut self, begins: u64, ends: u64, found: String) {
        let touches = self.ends == Some(begins);
        let resumed = Some(Resumed::default());
        let torn = self.torn.get_or_insert(Torn { offset: begins, expected: WHOLE, found, resumed });
        let resumed = torn.resumed.get_or_insert_default();
        resumed.holes += u64::from(!touches);
        resumed.bytes += ends - begins;
        self.ends = Some(ends);
    }

    /// Bytes from `begins` to `ends` stand behind the end of the file.
    pub(crate) fn lose_behind(&mut self, begins: u64, ends: u64, found: String) {
        self.lose(begins, ends, found);
        if let Some(torn) = self.torn.as_mut().filter(|torn| torn.offset == begins) {
            torn.expected = END;
        }
    }

    /// Nothing behind `offset` can be read.
    pub(crate) fn break_off(&mut self, offset: u64, found: String) {
        match self.torn.as_mut().and_then(|torn| torn.resumed.as_mut()) {
            Some(resumed) => resumed.ends_at = Some(offset),
            None => self.torn = Some(Torn { offset, expected: WHOLE, found, resumed: None }),
        }
    }

    /// Something before `offset` is not what was written, and nobody knows which byte; nothing is left out.
    pub(crate) fn doubt(&mut self, offset: u64, expected: &'static str, found: &str) {
        let resumed = Some(Resumed::default());
        self.torn.get_or_insert_with(|| Torn { offset, expected, found: found.to_owned(), resumed });
    }
}
