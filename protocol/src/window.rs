//! Which telegrams have come, by their counters.

/// Counters below the newest one that are remembered.
pub(crate) const REMEMBERED: u64 = 64;
/// A counter so far ahead is another stream's.
#[cfg(feature = "telegrams")]
const FAR: u64 = 1 << 20;

/// What has come of a stream that is counted.
#[derive(Clone, Debug)]
pub(crate) struct Window {
    oldest: u64,
    newest: u64,
    /// Bit n: the one n before the newest has come.
    seen: u64,
    taken: u64,
}

/// A counter that is none of this stream.
#[cfg(feature = "telegrams")]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct FarOff;

impl Window {
    /// Before the first telegram is taken.
    pub(crate) fn new(first: u64) -> Self {
        Self { oldest: first, newest: first, seen: 0, taken: 0 }
    }

    /// True before the first telegram is taken.
    pub(crate) fn is_empty(&self) -> bool {
        self.taken == 0
    }

    pub(crate) fn newest(&self) -> u64 {
        self.newest
    }

    /// How far a counter is ahead of the newest; 0 if it is not.
    #[cfg(feature = "telegrams")]
    pub(crate) fn ahead(&self, counter: u64) -> Result<u64, FarOff> {
        match counter.checked_sub(self.newest) {
            Some(ahead) if ahead <= FAR => Ok(ahead),
            None if self.newest - counter < REMEMBERED => Ok(0),
            _ => Err(FarOff),
        }
    }

    /// True if this telegram has come before.
    pub(crate) fn has_seen(&self, counter: u64) -> bool {
        self.newest.checked_sub(counter).is_some_and(|age| age < REMEMBERED && self.seen >> age & 1 == 1)
    }

    /// The telegram nearest to this one that has come, of those behind it (`newer`) or before it, as far as they are remembered.
    pub(crate) fn nearest(&self, counter: u64, newer: bool) -> Option<u64> {
        let mut near = (1..REMEMBERED)
            .map_while(|n| if newer { counter.checked_add(n) } else { counter.checked_sub(n) });
        near.find(|near| self.has_seen(*near))
    }

    pub(crate) fn take(&mut self, counter: u64) {
        if let Some(ahead) = counter.checked_sub(self.newest) {
            self.seen = if ahead < REMEMBERED { self.seen << ahead } else { 0 } | 1;
            self.newest = counter;
        } else {
            self.seen |= 1 << (self.newest - counter).min(REMEMBERED - 1);
        }
        self.oldest = self.oldest.min(counter);
        self.taken += 1;
    }

    /// Telegrams since the oldest that have not come.
    pub(crate) fn missing(&self) -> u64 {
        (self.newest - self.oldest).saturating_add(1).saturating_sub(self.taken)
    }
}
