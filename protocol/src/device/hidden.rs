//! Filters that leave nothing of a turn: they are taken, and no scan telegram is sent.

use alloc::vec::Vec;

use super::measured::MeasuredLine;
use super::seen::Seen;
use super::state::Device;
use super::turn::Turn;

impl Device {
    /// The variable of the filter because of which no turn has a scan telegram, though scans may be switched on; none where turns have some.
    pub fn hidden_by(&self) -> Option<&'static str> {
        // Recorded turns are sent as they are.
        let compact = self.model.compact.filter(|_| self.recorded.is_none())?;
        let seen = Seen::new(&self.settings.variables);
        if seen.is_all() {
            return None;
        }
        let mirrors = self.mirrors();
        let empty: Vec<_> =
            mirrors.iter().map(|mirror| MeasuredLine { grid: mirror.beams, echoes: &[] }).collect();
        let lines = Turn::lines(self, compact, &empty, &seen);
        if lines.is_empty() {
            return Some("LFPlayerFilter");
        }
        let leaves = lines.iter().any(|line| line.is_seen_by(&seen));
        (!leaves).then_some("LFPangleRangeFilter")
    }
}
