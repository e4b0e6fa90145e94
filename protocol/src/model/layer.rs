//! Layers whose lines a scanner measures in the same turn.

/// One of them. Data only.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layer {
    /// Elevation by design, 1/100°, as Compact's phi counts it; a unit's own is near it.
    pub elevation_centideg: i16,
    /// Number of the module of a telegram that its lines are in, from 0.
    pub module: u8,
    /// Where its beams point when a turn begins, 1/100° beyond −180°.
    pub azimuth_centideg: u16,
    /// Angle between beams, 1/10000°.
    pub step: u16,
}
