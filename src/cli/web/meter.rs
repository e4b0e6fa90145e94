//! The canopy by metre for the page, measured as `rowscan estimate` would.

use rowscan_canopy::{Estimate, Pipeline};
use rowscan_protocol::scan::Scan;
use rowscan_web::{Metre, Show};

/// Scans from one strip to the next.
const EVERY: u32 = 25;
/// Metres that the page keeps: the last.
const KEPT: usize = 200;

/// Measures one scanner's scans, and shows what came of them.
pub(in super::super) struct Meter {
    pipeline: Pipeline,
    /// As it was before the first scan.
    empty: Pipeline,
    show: Show,
    scanner: usize,
    scans: u32,
}

impl Meter {
    /// Scans of scanner number `scanner` of `show` go into `pipeline`.
    pub(in super::super) fn new(pipeline: Pipeline, show: Show, scanner: usize) -> Self {
        Self { empty: pipeline.clone(), pipeline, show, scanner, scans: 0 }
    }

    /// What comes was recorded before what has come: all is measured anew.
    pub(in super::super) fn begin_anew(&mut self) {
        self.pipeline = self.empty.clone();
        self.scans = 0;
        self.show.measured(self.scanner, Vec::new());
    }

    /// No more come, or none is known to come: what is not shown yet is.
    pub(in super::super) fn show_rest(&mut self) {
        if std::mem::take(&mut self.scans) > 0 {
            self.show.measured(self.scanner, metres(&self.pipeline.estimate()));
        }
    }

    /// One more.
    pub(in super::super) fn push(&mut self, scan: &Scan) {
        self.pipeline.push(scan);
        self.scans += 1;
        if self.scans >= EVERY {
            self.show_rest();
        }
    }
}

/// The last metres of an estimate.
pub(in super::super) fn metres(estimate: &Estimate) -> Vec<Metre> {
    let from = estimate.slices.len().saturating_sub(KEPT);
    let slices = estimate.slices.iter().skip(from);
    slices
        .map(|slice| Metre {
            y_from_m: slice.y_m - 0.5,
            y_to_m: slice.y_m + 0.5,
            scanned_m: slice.scanned_m,
            impacted_m2: Some(slice.impacted_total_area_m2),
            leaf_area_m2: slice.leaf.areas.best_m2().ok(),
        })
        .collect()
}
