//! What scanners and their clients have said to each other, in words.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde::Serialize;

/// Entries kept; older ones are forgotten.
const KEPT: usize = 512;

/// One telegram.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Spoken {
    /// Seconds, as the lines have them.
    pub at_s: f64,
    /// The scanner's name.
    pub scanner: String,
    /// The scanner said it; else its client did.
    pub by_device: bool,
    /// The telegram's first three letters and its name.
    pub telegram: String,
    /// What it holds.
    pub words: String,
    /// It could not be read.
    pub is_bad: bool,
}

/// The last telegrams, numbered from 1. Clones share them.
#[derive(Clone, Debug, Default)]
pub struct TelegramLog(Arc<Mutex<Kept>>);

#[derive(Debug, Default)]
struct Kept {
    last: u64,
    entries: VecDeque<Entry>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Entry {
    number: u64,
    #[serde(flatten)]
    spoken: Spoken,
}

impl TelegramLog {
    /// Keeps one more.
    pub fn keep(&self, spoken: Spoken) {
        let mut kept = self.kept();
        kept.last += 1;
        let number = kept.last;
        if kept.entries.len() == KEPT {
            kept.entries.pop_front();
        }
        kept.entries.push_back(Entry { number, spoken });
    }

    /// The number of the last one.
    pub(crate) fn last(&self) -> u64 {
        self.kept().last
    }

    /// Those after number `since`.
    pub(crate) fn after(&self, since: u64) -> Vec<Entry> {
        self.kept().entries.iter().filter(|entry| entry.number > since).cloned().collect()
    }

    fn kept(&self) -> MutexGuard<'_, Kept> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_telegrams_are_kept_in_order() {
        let log = TelegramLog::default();
        for number in 1..=KEPT + 3 {
            let telegram = format!("sRN {number}");
            let scanner = "scanner0".to_owned();
            let words = String::new();
            log.keep(Spoken { at_s: 0.0, scanner, by_device: false, telegram, words, is_bad: false });
        }
        let all = log.after(0);
        assert_eq!((all.len(), all[0].number, log.last()), (KEPT, 4, KEPT as u64 + 3));
        assert_eq!(log.after(log.last() - 1)[0].spoken.telegram, format!("sRN {}", KEPT + 3));
    }
}
