//! What one line's beams told: ranges, and the shares of their spots that came back.

use rowscan_protocol::angle::BeamGrid;

/// One line, beam by beam.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BeamLine<'a> {
    pub(crate) grid: BeamGrid,
    /// First echo, metres.
    pub(crate) range_m: &'a [f64],
    /// Share of the spot that full leaves would have to take to return as much; NaN where it is not known, empty where remission is not read.
    pub(crate) share: &'a [f64],
}

/// The same, kept.
#[derive(Clone, Debug, Default)]
pub(crate) struct KeptBeams {
    pub(crate) range_m: Vec<f64>,
    pub(crate) share: Vec<f64>,
}

impl KeptBeams {
    pub(crate) fn clear(&mut self) {
        self.range_m.clear();
        self.share.clear();
    }

    pub(crate) fn keep(&mut self, line: &BeamLine<'_>) {
        self.clear();
        self.range_m.extend_from_slice(line.range_m);
        self.share.extend_from_slice(line.share);
    }

    /// As a line of this grid.
    pub(crate) fn line(&self, grid: BeamGrid) -> BeamLine<'_> {
        BeamLine { grid, range_m: &self.range_m, share: &self.share }
    }
}
