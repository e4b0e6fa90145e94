//! What is counted of a stream.

use crate::what::Count;

/// Counts of a stream at one time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Counts {
    pub(crate) scans: u64,
    pub(crate) scans_lost: u64,
    /// How often nobody can tell how many scans are lost.
    pub(crate) untold: u64,
    pub(crate) scans_repeated: u64,
    pub(crate) segments_lost: u64,
    pub(crate) telegrams_bad: u64,
    pub(crate) connections: u64,
    /// Scans that the device says it has not sent, between its first delivered one and the last one so far.
    pub(crate) not_sent: u64,
}

impl Counts {
    /// One of them.
    pub(crate) fn of(&self, count: Count) -> u64 {
        match count {
            Count::ScansLost => self.scans_lost,
            Count::ScansRepeated => self.scans_repeated,
            Count::SegmentsLost => self.segments_lost,
            Count::TelegramsBad => self.telegrams_bad,
            Count::Reconnects => self.connections.saturating_sub(1),
        }
    }

    /// The same without the scans, which change all the time.
    pub(super) fn rare(self) -> Self {
        Self { scans: 0, ..self }
    }
}
