//! What a hit counts: one, or the share of its spot.

/// What a hit counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Count {
    /// One: contact frequency.
    Hits,
    /// The share of the spot that leaves took.
    Shares,
}

impl Count {
    /// What belongs to it, of what there is by hits and by shares.
    pub(crate) fn of<T>(self, by_hits: T, by_shares: T) -> T {
        match self {
            Self::Hits => by_hits,
            Self::Shares => by_shares,
        }
    }

    /// Its name in results.
    pub(crate) fn name(self) -> &'static str {
        self.of("contact", "share")
    }
}
