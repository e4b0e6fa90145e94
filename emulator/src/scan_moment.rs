//! Where the tractor truly is at each scan, for whoever scores what clients make of the scans.

use std::sync::mpsc::Sender;

use rowscan_protocol::time::SimTime;
use rowscan_vehicle::Tractor;
use rowscan_vehicle::trajectory::Motion;

/// A scan that went to a taker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScanMoment {
    /// When the mirror passed its zero index; of an LMS2xx, on the first turn that the scan is made of.
    pub at: SimTime,
    /// The number in its telegram; None of an LMS2xx.
    pub telegram_counter: Option<u16>,
    /// The tractor then: the true one, whatever encoder, GNSS and CAN tell.
    pub motion: Motion,
}

/// A scan as its scanner knows it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LastScan {
    pub(crate) at: SimTime,
    pub(crate) telegram_counter: Option<u16>,
}

/// Where the moments of the rig's first scanner go.
#[derive(Debug, Default)]
pub(crate) struct Moments(Option<Sender<ScanMoment>>);

impl Moments {
    pub(crate) fn to(moments: Sender<ScanMoment>) -> Self {
        Self(Some(moments))
    }

    /// Tells of a scan. Never waits; who no longer listens is told nothing.
    pub(crate) fn tell(&self, scan: Option<LastScan>, tractor: &Tractor) {
        let Some((moments, LastScan { at, telegram_counter })) = self.0.as_ref().zip(scan) else { return };
        let _ = moments.send(ScanMoment { at, telegram_counter, motion: tractor.motion(at) });
    }

    /// The first scanner is gone: another's scans are not its.
    pub(crate) fn end(&mut self) {
        self.0 = None;
    }
}
