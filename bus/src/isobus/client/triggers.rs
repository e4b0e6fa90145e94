//! What a task controller wants to hear without asking again.

use std::collections::BTreeMap;
use std::time::Duration;

use rowscan_protocol::time::SimTime;

/// An element and a DDI.
pub(super) type Key = (u16, u16);

/// When one value is told.
#[derive(Clone, Copy, Debug, Default)]
struct Trigger {
    /// So often, and when it is due.
    every: Option<(Duration, SimTime)>,
    /// When it has changed by so much.
    change: Option<i64>,
    /// What was told last.
    last: Option<i32>,
}

/// All of them; no more than there are values.
#[derive(Clone, Debug, Default)]
pub(super) struct Triggers(BTreeMap<Key, Trigger>);

/// The shortest interval that is kept, ms.
const SHORTEST_MS: u64 = 50;

impl Triggers {
    /// Nothing is told by itself any more.
    pub(super) fn clear(&mut self) {
        self.0.clear();
    }

    /// Every so many milliseconds; 0 ends it.
    pub(super) fn every(&mut self, at: SimTime, key: Key, ms: i32) {
        let trigger = self.0.entry(key).or_default();
        let ms = u64::try_from(ms).ok().filter(|ms| *ms > 0);
        trigger.every = ms.map(|ms| {
            let every = Duration::from_millis(ms.max(SHORTEST_MS));
            (every, at + every)
        });
    }

    /// On a change of at least `by`; 0 is any.
    pub(super) fn on_change(&mut self, key: Key, by: i32) {
        self.0.entry(key).or_default().change = Some(i64::from(by).max(1));
    }

    /// The value was told.
    pub(super) fn told(&mut self, key: Key, value: i32) {
        if let Some(trigger) = self.0.get_mut(&key) {
            trigger.last = Some(value);
        }
    }

    /// When an interval is over.
    pub(super) fn next(&self) -> Option<SimTime> {
        self.0.values().filter_map(|trigger| Some(trigger.every?.1)).min()
    }

    /// Values that are to be told now. `value` knows them; one that is not known is not told.
    pub(super) fn due(&mut self, at: SimTime, value: impl Fn(Key) -> Option<i32>) -> Vec<(Key, i32)> {
        let mut due = Vec::new();
        for (key, trigger) in &mut self.0 {
            let is_time = match &mut trigger.every {
                Some((every, next)) if *next <= at => {
                    *next = at + *every;
                    true
                }
                _ => false,
            };
            let Some(now) = value(*key) else { continue };
            let moved = trigger.last.map_or(i64::MAX, |last| (i64::from(now) - i64::from(last)).abs());
            if is_time || trigger.change.is_some_and(|by| moved >= by) {
                trigger.last = Some(now);
                due.push((*key, now));
            }
        }
        due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    #[test]
    fn values_come_by_time_and_on_change() {
        let mut triggers = Triggers::default();
        triggers.on_change((2, 161), 0);
        triggers.on_change((0, 520), 20);
        triggers.every(SimTime::ZERO, (3, 2), 100);
        let mut due = |ms: u64, sections: i32, canopy: Option<i32>| {
            let value = |key: Key| match key {
                (2, 161) => Some(sections),
                (0, 520) => canopy,
                _ => Some(7),
            };
            let due = triggers.due(SimTime(ms * MS), value);
            due.into_iter().map(|((_, ddi), value)| (ddi, value)).collect::<Vec<_>>()
        };
        assert_eq!(due(0, 5, None), [(161, 5)]);
        assert_eq!(due(10, 5, Some(1000)), [(520, 1000)]);
        assert_eq!(due(20, 4, Some(1019)), [(161, 4)]);
        assert_eq!(due(100, 4, Some(1020)), [(520, 1020), (2, 7)]);
        assert_eq!(due(150, 4, None), []);
        assert_eq!(triggers.next(), Some(SimTime(200 * MS)));
        triggers.every(SimTime::ZERO, (3, 2), 0);
        assert_eq!(triggers.next(), None);
    }
}
