//! What was measured of one band of height.

use crate::leaf::Count;

/// What was measured of one band of a stretch of row.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BandSums {
    /// Raw leaf area by contact frequency, and by the shares of spots, m².
    pub(super) contact_m2: f64,
    pub(super) share_m2: f64,
    pub(super) impacted_m2: f64,
    /// Canopy space, and of that what enough beams entered, m³.
    pub(super) volume_m3: f64,
    pub(super) visited_m3: f64,
    /// Σ line weight over passages through the canopy space, and over beams that end there.
    pub(super) passages: f64,
    pub(super) ended: f64,
    /// Σ line weight over beams aimed at the band of the row plane, and over those that pass.
    pub(super) aimed: f64,
    pub(super) through: f64,
    /// Voxels that enough beams entered, anywhere in the band.
    pub(super) reached: f64,
}

impl BandSums {
    /// Raw leaf area, m².
    pub(super) fn raw_m2(&self, count: Count) -> f64 {
        count.of(self.contact_m2, self.share_m2)
    }

    pub(super) fn add(&mut self, other: &Self) {
        self.contact_m2 += other.contact_m2;
        self.share_m2 += other.share_m2;
        self.impacted_m2 += other.impacted_m2;
        self.volume_m3 += other.volume_m3;
        self.visited_m3 += other.visited_m3;
        self.passages += other.passages;
        self.ended += other.ended;
        self.aimed += other.aimed;
        self.through += other.through;
        self.reached += other.reached;
    }
}
