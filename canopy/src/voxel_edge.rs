//! How large a voxel must be, and no larger: by what beams and leaves allow, never by what comes out.
//!
//! A voxel's density is a ratio of sums over N independent looks into it; such a ratio is too high by 1/(2N) (`contact.rs`). Looks are
//! independent if they are not stopped by one leaf, so N is the smaller of two numbers:
//! - how often a leaf's projection G·a fits into the voxel's face e²;
//! - how many beams pass the face: e² over beam spacing × line spacing at the row axis.
//!
//! [`LOOKS`] of either keep the error below 1 %, and if the crown lets a fifth of the beams through to its axis, ten of them are left, which is
//! `min_beams`. Larger voxels would only mix canopy and air: beams meet clumps of leaves, so the edge is the smallest that both allow, on
//! a step of 5 cm so that small changes of speed do not change it.

use serde::Serialize;

use crate::footprint::LeafShape;

/// Looks into a voxel: 1/(2 · 50) is 1 %.
pub const LOOKS: f64 = 50.0;
/// Edges are multiples of this, metres.
const STEP_M: f64 = 0.05;
/// Smallest and largest edge that the rule gives, metres.
const RANGE_M: (f64, f64) = (0.05, 1.0);

/// What the rule asks of scanner and canopy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampling {
    /// Distance between beams, and between lines, at the row axis, metres; `None` where it is not known.
    pub spacing_m: Option<[f64; 2]>,
    /// One-sided area of a leaf, m².
    pub leaf_area_m2: f64,
    /// Leaf projection function G.
    pub projection: f64,
}

impl Default for Sampling {
    fn default() -> Self {
        Self { spacing_m: None, leaf_area_m2: LeafShape::default().area_m2, projection: 0.5 }
    }
}

/// What set the voxel edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum EdgeBy {
    /// The size of the leaves.
    #[default]
    Leaves,
    /// The distance between beams and lines.
    Beams,
    /// The rig.
    Given,
}

impl Sampling {
    /// The edge, metres, and what set it.
    pub fn voxel_edge(&self) -> (f64, EdgeBy) {
        let least = |face_m2: f64| (LOOKS * face_m2).sqrt();
        let by_leaves_m = least(self.projection * self.leaf_area_m2);
        let by_beams_m = self.spacing_m.map_or(0.0, |[beams_m, lines_m]| least(beams_m * lines_m));
        let by = if by_beams_m > by_leaves_m { EdgeBy::Beams } else { EdgeBy::Leaves };
        let edge_m = by_leaves_m.max(by_beams_m);
        let steps = (edge_m / STEP_M - 1e-9).ceil();
        // Steps as a division, so that 5 of them are the number 0.25.
        let edge_m = steps / (1.0 / STEP_M).round();
        let (low_m, high_m) = RANGE_M;
        (if edge_m.is_finite() { edge_m.clamp(low_m, high_m) } else { high_m }, by)
    }
}

/// What contact differs by, relative, over the logarithm of the ratio of two edges: small voxels leave the gaps between leaves out. Spindles of LAI 1.6 read
/// 1.55 times as much in 0.1 m as in 0.25 m, and 0.75 times in 0.6 m; by an LMS111's spots 1.45 and 0.6 times.
const SD_BY_EDGE: f64 = 0.5;
/// Edges so much apart, as the logarithm of their ratio, count as one.
const SAME_EDGE: f64 = 0.02;
/// So much apart a calibration tells nothing any more: more than one and a half times.
const FAR_EDGE: f64 = 0.41;

/// Voxels of another edge than a calibration was fitted in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct OtherEdge {
    pub(crate) edge_m: f64,
    pub(crate) calibrated_m: f64,
    /// Relative standard deviation of the leaf area for it; `None` where it is so far off that none is told.
    pub(crate) relative_sd: Option<f64>,
}

impl OtherEdge {
    /// `None` where they are the same, or the calibration does not say.
    pub(crate) fn of(edge_m: f64, calibrated_m: Option<f64>) -> Option<Self> {
        let calibrated_m = calibrated_m?;
        let apart = (edge_m / calibrated_m).ln().abs();
        let relative_sd = (apart <= FAR_EDGE).then_some(SD_BY_EDGE * apart);
        (apart > SAME_EDGE).then_some(Self { edge_m, calibrated_m, relative_sd })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_edge_than_the_calibrations_widens_and_far_off_tells_nothing() {
        let sd = |edge_m, of| OtherEdge::of(edge_m, of).map(|other| other.relative_sd);
        assert_eq!(sd(0.25, None), None);
        assert_eq!(sd(0.25, Some(0.25)), None);
        assert!(sd(0.3, Some(0.25)).flatten().is_some_and(|sd| (0.09..0.1).contains(&sd)));
        assert_eq!(sd(0.25, Some(0.3)), sd(0.3, Some(0.25)));
        for far_m in [0.1, 0.15, 0.4, 1.0] {
            assert_eq!(sd(far_m, Some(0.25)), Some(None), "{far_m}");
        }
    }

    #[test]
    fn the_edge_is_the_smallest_with_fifty_looks_of_either_kind() {
        let edge = |beam_m: f64, line_m: f64, leaf_cm2: f64| {
            let sampling = Sampling {
                spacing_m: Some([beam_m, line_m]),
                leaf_area_m2: leaf_cm2 * 1e-4,
                projection: 0.5,
            };
            sampling.voxel_edge()
        };
        for (beam_m, line_m, leaf_cm2) in [(0.0166, 0.02, 24.0), (0.0166, 0.2, 24.0), (0.005, 0.02, 60.0)] {
            let (edge_m, by) = edge(beam_m, line_m, leaf_cm2);
            let looks = |edge_m: f64| {
                (edge_m * edge_m / (0.5 * leaf_cm2 * 1e-4)).min(edge_m * edge_m / (beam_m * line_m))
            };
            assert!(looks(edge_m) >= LOOKS && looks(edge_m - STEP_M) < LOOKS, "{edge_m}");
            assert_eq!(by == EdgeBy::Beams, line_m == 0.2);
        }
        // Leaves of 24 cm² before an LMS111 at 1 m/s: a quarter of a metre.
        assert_eq!(edge(0.0166, 0.02, 24.0), (0.25, EdgeBy::Leaves));
        assert_eq!(Sampling::default().voxel_edge().0, 0.25);
    }

    #[test]
    fn wild_numbers_give_an_edge_that_can_be_used() {
        for spacing in [0.0, 1e9, f64::NAN, f64::INFINITY] {
            let sampling = Sampling { spacing_m: Some([spacing, 0.02]), ..Sampling::default() };
            assert!((0.05..=1.0).contains(&sampling.voxel_edge().0), "{spacing}");
        }
    }
}
