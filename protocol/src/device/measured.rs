//! One mirror turn's raw measurement, as the host program hands it in.

use alloc::vec::Vec;

use crate::angle::BeamGrid;
use crate::optics::DAZZLED;

/// One mirror turn's raw measurement on the mirror's full grid.
#[derive(Clone, Copy, Debug)]
pub struct MeasuredLine<'a> {
    /// The beams it was measured with. A client may set another scan mode before the line reaches the device; the telegram
    /// has the angles of this grid in any case.
    pub grid: BeamGrid,
    /// First echo first.
    pub echoes: &'a [MeasuredEcho],
}

/// One echo of every beam.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MeasuredEcho {
    /// Millimetres, 0 where there was none.
    pub range_mm: Vec<u16>,
    /// Remission, 16-bit scale; 8-bit telegrams carry the upper byte. Of a first echo without a range it is [`DAZZLED`] where the receiver is dazzled.
    pub remission: Vec<u16>,
}

impl MeasuredLine<'_> {
    /// True if a beam has no range because its receiver is dazzled.
    pub(super) fn is_dazzled(&self, beam: usize) -> bool {
        let at = |values: &[u16]| values.get(beam).copied();
        self.echoes
            .first()
            .is_some_and(|echo| (at(&echo.range_mm), at(&echo.remission)) == (Some(0), Some(DAZZLED)))
    }

    /// The nearest of all first echoes.
    pub(super) fn nearest_mm(&self) -> Option<u16> {
        self.echoes.first()?.range_mm.iter().copied().filter(|&range_mm| range_mm > 0).min()
    }
}
