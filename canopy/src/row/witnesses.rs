//! What the row's own lines say against the air and the way.

use crate::air_witness::{AirWitness, InAir};
use crate::geometry::{BeamTable, Frame};
use crate::row::Row;
use crate::still_witness::{StillWitness, StoodStill};

/// Of all lines so far.
#[derive(Clone, Debug, Default)]
pub(super) struct Witnesses {
    air: AirWitness,
    still: StillWitness,
}

impl Witnesses {
    /// Adds a line that was taken there by the way, metres.
    pub(super) fn add(&mut self, frame: &Frame, table: &BeamTable, y_m: f64, range_m: &[f64]) {
        self.air.add(frame, table, y_m, range_m);
        self.still.add(frame, table, y_m, range_m);
    }
}

impl Row {
    /// What is in the air before the row.
    pub(crate) fn in_air(&self) -> Option<InAir> {
        self.witnesses.air.found(self.frame.distance_m)
    }

    /// Scans of one place that the way puts apart.
    pub(crate) fn stood_still(&self) -> Option<StoodStill> {
        self.witnesses.still.found()
    }
}
