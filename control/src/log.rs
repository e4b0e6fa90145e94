//! What has happened, for whoever asks later.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde::Serialize;
use serde_json::Value;

/// Entries kept; older ones are forgotten, and that is told.
const KEPT: usize = 4096;

/// The last events, numbered from 1. Clones share them.
#[derive(Clone, Debug, Default)]
pub struct Log(Arc<Mutex<Entries>>);

#[derive(Debug, Default)]
struct Entries {
    last: u64,
    kept: VecDeque<Entry>,
}

/// One event.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Entry {
    number: u64,
    #[serde(flatten)]
    event: Value,
}

/// A part of the log.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Page {
    /// Events of this part that have been forgotten.
    forgotten: u64,
    /// Number of the last event there is.
    last: u64,
    events: Vec<Entry>,
}

impl Log {
    /// Keeps an event: a JSON object.
    pub fn keep(&self, event: &impl Serialize) {
        // What cannot be written as JSON is nothing that could be answered.
        let Ok(event) = serde_json::to_value(event) else { return };
        let mut entries = self.entries();
        entries.last += 1;
        let number = entries.last;
        if entries.kept.len() == KEPT {
            entries.kept.pop_front();
        }
        entries.kept.push_back(Entry { number, event });
    }

    /// What came after event number `since`.
    pub(crate) fn after(&self, since: u64) -> Page {
        let entries = self.entries();
        let events: Vec<Entry> = entries.kept.iter().filter(|entry| entry.number > since).cloned().collect();
        let wanted = entries.last.saturating_sub(since);
        let forgotten = wanted.saturating_sub(events.len() as u64);
        Page { forgotten, last: entries.last, events }
    }

    fn entries(&self) -> MutexGuard<'_, Entries> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn the_last_events_are_kept_and_lost_ones_are_counted() {
        let log = Log::default();
        for number in 1..=KEPT as u64 + 5 {
            log.keep(&json!({ "event": "fault", "value": number }));
        }
        let page = log.after(3);
        assert_eq!((page.forgotten, page.events.len()), (2, KEPT));
        let page = log.after(page.last - 1);
        assert_eq!((page.forgotten, page.events.len()), (0, 1));
        let text = serde_json::to_string(&page.events).unwrap();
        assert_eq!(text, r#"[{"number":4101,"event":"fault","value":4101}]"#);
        assert!(log.after(u64::MAX).events.is_empty());
    }
}
