//! When a rig's time ends by itself.

use std::time::Duration;

use rowscan_protocol::time::SimTime;
use rowscan_vehicle::Tractor;

/// Where time stops. Everything due until then is sent, and acknowledged in lockstep; nothing later is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EndWhen {
    /// So long after the drive has started.
    Driven(Duration),
    /// The tractor is so many metres along the row.
    RowM(f64),
    /// The tractor has driven so many metres.
    WayM(f64),
    /// So many instants at which scans went to a taker since the drive has started; scanners that turn together share an instant.
    Scans(u64),
}

impl EndWhen {
    /// True if what is due at `at` comes after the end, after so many instants with scans.
    pub(crate) fn is_before(self, at: SimTime, tractor: &Tractor, scan_instants: u64) -> bool {
        let Some(began) = tractor.began() else { return false };
        match self {
            Self::Driven(time) => at > began + time,
            Self::RowM(row_m) => tractor.motion(at).place.y_m > row_m,
            Self::WayM(way_m) => tractor.motion(at).way_m > way_m,
            Self::Scans(scans) => scan_instants >= scans,
        }
    }

    /// The end itself, to the nanosecond, where what is due at `at` comes after it and what was at `from` did not: whatever else acts in a rig, its time
    /// ends at the same instant. After so many scans it is that of the last one.
    pub(crate) fn instant(
        self,
        (from, at): (SimTime, SimTime),
        tractor: &Tractor,
        scan_instants: u64,
    ) -> SimTime {
        if let Self::Scans(_) = self {
            return from;
        }
        let (mut low, mut high) = (from.0, at.0.max(from.0));
        while high - low > 1 {
            let middle = low + (high - low) / 2;
            if self.is_before(SimTime(middle), tractor, scan_instants) { high = middle } else { low = middle }
        }
        SimTime(low)
    }
}

#[cfg(test)]
mod tests {
    use rowscan_vehicle::trajectory::Trajectory;

    use super::*;

    #[test]
    fn an_end_is_reached_only_by_a_drive_that_has_started() {
        let tractor = Tractor::new(Trajectory::straight(0.0, 2.0));
        let second = SimTime::ZERO + Duration::from_secs(1);
        let ends = [
            EndWhen::Driven(Duration::from_millis(500)),
            EndWhen::RowM(1.5),
            EndWhen::WayM(1.5),
            EndWhen::Scans(3),
        ];
        assert!(ends.iter().all(|end| !end.is_before(second, &tractor, 3)));
        tractor.begin(SimTime::ZERO);
        assert!(ends.iter().all(|end| end.is_before(second, &tractor, 3)));
        // What is due at the end itself is sent.
        assert!(!EndWhen::Driven(Duration::from_secs(1)).is_before(second, &tractor, 0));
        assert!(!EndWhen::RowM(2.0).is_before(second, &tractor, 0));
        assert!(!EndWhen::Scans(3).is_before(second, &tractor, 2));
    }

    #[test]
    fn time_ends_at_the_end_whatever_is_due_next() {
        let tractor = Tractor::new(Trajectory::straight(0.0, 2.0));
        tractor.begin(SimTime(100_000_000));
        for (from, at) in [(0, 1_000_000_000), (400_000_000, 600_000_001), (599_999_999, 9_000_000_000)] {
            for end in [EndWhen::Driven(Duration::from_millis(500)), EndWhen::RowM(1.0), EndWhen::WayM(1.0)] {
                let found = end.instant((SimTime(from), SimTime(at)), &tractor, 0);
                assert!(found.0.abs_diff(600_000_000) <= 1, "{end:?}: {found:?}");
            }
            let found = EndWhen::Scans(3).instant((SimTime(from), SimTime(at)), &tractor, 3);
            assert_eq!(found, SimTime(from));
        }
    }
}
