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
    /// Its name in results.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Hits => "contact",
            Self::Shares => "share",
        }
    }
}
