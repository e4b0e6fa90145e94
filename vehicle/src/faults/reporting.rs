//! What the receiver reports while it has faults.

use rowscan_protocol::time::SimTime;
use rowscan_settings::fault_table::vehicle::GnssFault;

use super::spans::Spans;
use crate::gnss::{Fix, FixQuality, Receiver};
use crate::trajectory::Motion;

/// Noise of RTK float, metres.
const FLOAT_M: f64 = 0.3;

/// What a receiver tells at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report {
    /// Where it reckons to be.
    pub fix: Fix,
    /// Its sentences have wrong checksums.
    pub bad_checksum: bool,
}

/// The faults of one receiver.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Reporting {
    spans: Spans<GnssFault>,
}

impl Reporting {
    pub(crate) fn begin(&mut self, key: u64, fault: GnssFault, at: SimTime) {
        self.spans.begin(key, fault, at);
    }

    /// False if there is none of this key.
    pub(crate) fn end(&mut self, key: u64, at: SimTime) -> bool {
        self.spans.end(key, at)
    }

    /// What `receiver` tells at `at` of a tractor whose motion is known at any instant.
    pub(crate) fn report(
        &self,
        receiver: &Receiver,
        at: SimTime,
        motion: impl Fn(SimTime) -> Motion,
    ) -> Report {
        // The last fix before the first one that holds it.
        let stale = self.spans.at(at).filter(|span| span.fault.stale).map(|span| span.from).min();
        let when = stale.unwrap_or(at);
        let active = || self.spans.at(at).map(|span| &span.fault);
        let float = active().any(|fault| fault.float).then_some((FixQuality::RtkFloat, FLOAT_M));
        let mut fix = receiver.fix_as(when, &motion(when), float);
        for fault in active() {
            let azimuth = fault.jump_deg.to_radians();
            let (sin, cos) = (libm::sin(azimuth), libm::cos(azimuth));
            receiver.shift(&mut fix, fault.jump_m * cos, fault.jump_m * sin);
            let (ahead_m, right_m) = fault.lever_arm_m;
            let heading = fix.heading_deg.to_radians();
            let (sin, cos) = (libm::sin(heading), libm::cos(heading));
            receiver.shift(&mut fix, ahead_m * cos - right_m * sin, ahead_m * sin + right_m * cos);
            fix.unix_s += fault.time_s;
        }
        if active().any(|fault| fault.lost) {
            fix = fix.lost();
        }
        Report { fix, bad_checksum: active().any(|fault| fault.bad_checksum) }
    }
}
