//! What became of the parts of scans, where scans come in parts.

/// What became of segments.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SegmentCounts {
    /// Put into turns.
    pub taken: u64,
    /// Never came, or too late.
    pub lost: u64,
    /// Came again.
    pub repeated: u64,
    /// Of those that came again, segments whose copies say different things: at most one of them can be right, and which one is not known.
    pub contradicted: u64,
    /// Of turns that had begun before the stream was heard, or ended after it.
    pub cut: u64,
}

impl SegmentCounts {
    /// Those that came again unchanged.
    pub fn doubled(&self) -> u64 {
        self.repeated - self.contradicted.min(self.repeated)
    }

    /// Share of all segments, from the first to the last one that came, of which nothing is known.
    pub fn lost_share(&self) -> f64 {
        self.lost as f64 / (self.taken + self.lost).max(1) as f64
    }
}

impl core::ops::Add for SegmentCounts {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            taken: self.taken + other.taken,
            lost: self.lost + other.lost,
            repeated: self.repeated + other.repeated,
            contradicted: self.contradicted + other.contradicted,
            cut: self.cut + other.cut,
        }
    }
}
