//! The result: every number with its unit in its name, `null` where it is unknown.

use rowscan_protocol::compact::SegmentCounts;
use rowscan_protocol::host::SettingNote;
use rowscan_protocol::model::AnyModel;
use serde::Serialize;

use crate::by_height::HeightProfile;
use crate::calibration::model::CalibrationClass;
use crate::clumping::Clumping;
use crate::cut::{CutMethod, FoundTree};
use crate::estimator::measure::Measure;
pub use crate::leaf::LeafAreaEstimator;
use crate::leaf::{PieceLeaf, RowLeaf};
use crate::odometry::AdvanceSource;
use crate::pieces::PieceReliability;
use crate::voxel_edge::EdgeBy;
use crate::warning::Warning;

/// What a stream of scans says about a row.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Estimate {
    /// Valid scan telegrams, repeated ones included.
    pub scans: u64,
    /// Telegrams that came again (same telegram counter); they add no advance and no area.
    pub scans_repeated: u64,
    /// Telegrams that came behind later ones: they are not lost, and add no advance and no area.
    pub scans_late: u64,
    /// Telegrams missing between the first and the last seen, by the telegram counter; unknown where the scanner has begun to count anew.
    pub scans_lost: Option<u64>,
    /// Turns of the mirror of which the scanner made no telegram, beyond its output interval: a virtual scanner's host was too slow.
    pub turns_left_out: u64,
    /// Scan telegrams left out: the device reports an error or a window too dirty to measure through, or its beams point where they cannot. By
    /// cause in the warnings.
    pub scans_excluded: u64,
    /// Frames refused by checksum or length. The caller knows them; 0 here.
    pub telegrams_bad: u64,
    /// Parts of scans that were lost on their way, where scans come in parts (picoScan): what their beams met is unknown. The caller knows them; 0 here.
    pub segments_lost: u64,
    /// Parts of scans that came again unchanged: they cost nothing. The caller knows them; 0 here.
    pub segments_doubled: u64,
    /// Parts of scans that came twice with different contents: neither is believed, their scans are left out as unreadable. The caller knows them; 0 here.
    pub segments_contradicting: u64,
    /// Beams of the latest scan.
    pub points_per_scan: Option<u32>,
    /// Telegrams a second, lost ones included, on the device clock.
    pub scan_frequency_hz: Option<f64>,
    /// Mirror turns a second, as the latest telegram states it.
    pub scan_frequency_nominal_hz: Option<f64>,
    /// First echoes of all scans but the repeated ones.
    pub ranges: RangeStatistics,
    /// Way from the first line to the last, metres.
    pub advance_m: Option<f64>,
    /// What the advance is taken from.
    pub advance_source: Option<AdvanceSource>,
    /// Metres of row that the lines stand for: the sum of their weights, long gaps left out.
    pub scanned_m: Option<f64>,
    /// Metres scanned of those metres of row that hold canopy, less those where trees are missing: the length that laws are applied to.
    pub canopy_m: Option<f64>,
    /// How deep across the row the crowns were seen, metres: the middle eight tenths of the canopy's returns from 0.5 m above the ground on; `None` of
    /// few returns. Less than the crowns' width, for what is hidden does not count.
    pub crown_depth_m: Option<f64>,
    /// I_T, the impacted area of all canopy returns, leaf and wood (paper eq. 4), m².
    pub impacted_total_area_m2: Option<f64>,
    /// The leaf area, one-sided: `leaf_area_m2`, `lai` and what belongs to them.
    #[serde(flatten)]
    pub leaf: RowLeaf,
    /// How the rig says that the scanner sits; left out without a rig.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mount: Option<MountReport>,
    /// How the contact frequency was sampled.
    pub contact: Option<ContactReport>,
    /// What came of joining a pass from the row's other side; `None` of one pass.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub other_side: Option<SidesReport>,
    /// Returns by where they were put.
    pub returns: Option<ReturnCounts>,
    /// The calibration's class.
    pub calibration: Option<CalibrationClass>,
    /// What a reader must know beside the numbers.
    pub warnings: Vec<Warning>,
    /// How much the differences between its trees and between its metres say; `None` where leaf areas are withheld.
    pub pieces: Option<PieceReliability>,
    /// By tree, in the order of travel; empty without a tree spacing.
    pub trees: Vec<TreeEstimate>,
    /// By metre of row, in the order of travel.
    pub slices: Vec<SliceEstimate>,
    /// The canopy by height, of the row and of each tree; left out where it was not asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub profile: Option<HeightProfile>,
    /// Trees found in the data, by every requested method.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub trees_found: Vec<TreesFound>,
    /// What each requested estimator reports for the row; empty if none was.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub measures: Vec<Measure>,
}

impl Estimate {
    /// Takes note of what the link to the scanner knows: frames refused, and what became of parts of scans.
    pub fn heard_over(&mut self, telegrams_bad: u64, segments: SegmentCounts) {
        (self.telegrams_bad, self.segments_lost) = (telegrams_bad, segments.lost);
        (self.segments_doubled, self.segments_contradicting) = (segments.doubled(), segments.contradicted);
        if segments.lost > 0 {
            let share = segments.lost_share();
            self.warnings.push(Warning::SegmentsLost { segments: segments.lost, share });
        }
    }

    /// Takes note of where its recording breaks off.
    pub fn broken_off(&mut self, place: String) {
        self.warnings.push(Warning::BrokenOff { place });
    }

    /// Takes note of the stream that its recording was read from, and of those that were left out, where several hold scans and none was named.
    pub fn streams_left_out(&mut self, read: String, left_out: Vec<String>) {
        self.warnings.push(Warning::StreamsLeftOut { read, left_out });
    }

    /// Takes note of the models that the scanner, or its recording, says it can be, where it was taken for another; of none that is modelled, nothing
    /// is known.
    pub fn named(&mut self, found: &[AnyModel], taken_for: AnyModel) {
        self.warnings.extend(Warning::other_model(found, taken_for));
    }

    /// Takes note of what became of the scanner's settings.
    pub fn set_up(&mut self, notes: impl IntoIterator<Item = SettingNote>) {
        self.warnings.extend(notes.into_iter().map(Warning::Setting));
    }

    /// True if the row's areas, or those of its leaves, are not told. With a rig, the reason is among the warnings.
    pub fn is_withheld(&self) -> bool {
        self.impacted_total_area_m2.is_none() || self.leaf.areas.best_m2().is_err()
    }
}

/// Range statistics of the first echo.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct RangeStatistics {
    /// Beams with an echo.
    pub returns: u64,
    /// Beams without one.
    pub misses: u64,
    /// Beams with an invalid range: not a number, not positive, or beyond 1000 m.
    pub invalid: u64,
    /// Nearest return, metres.
    pub min_m: Option<f64>,
    /// Farthest return, metres.
    pub max_m: Option<f64>,
    /// Mean range of the returns, metres.
    pub mean_m: Option<f64>,
}

/// The mount that scans were placed by: the rig's, which nothing here can check.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct MountReport {
    /// Mirror above the ground, metres.
    pub height_m: f64,
    /// Mirror to the row axis, metres.
    pub distance_m: f64,
    /// Mirror ahead of what the advance is measured of, metres.
    pub offset_y_m: f64,
    /// Beams at the row turned ahead, degrees.
    pub yaw_deg: f64,
    /// Top leant back, degrees.
    pub pitch_deg: f64,
    /// Top leant to the row, degrees.
    pub roll_deg: f64,
}

/// How the contact frequency was sampled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ContactReport {
    /// Projection function G taken.
    pub projection: f64,
    /// Voxel edge across the row and in height, metres.
    pub voxel_m: f64,
    /// What set that edge.
    pub voxel_by: EdgeBy,
    /// Length of a slice along the row, metres.
    pub slice_m: f64,
    /// How far apart lines lie, the mean over the row's length, metres.
    pub line_spacing_m: Option<f64>,
    /// Beams that ended in a voxel.
    pub hits: u64,
    /// Share of the hits whose voxel would hold more than 100 m² of leaves a m³: no foliage is so dense.
    pub too_dense: f64,
    /// Voxels that enough beams entered, summed over slices.
    pub voxels_visited: u64,
    /// Voxels that too few beams entered, summed over slices.
    pub voxels_unvisited: u64,
    /// The share of the raw leaf area that stands in unvisited voxels, by the fill rule; m². `None` where leaf areas are withheld.
    pub leaf_area_filled_m2: Option<f64>,
    /// How close together the leaves stand; `None` of rays, and where nothing was hit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clumping: Option<Clumping>,
}

/// What came of joining the passes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct SidesReport {
    /// The other pass saw the row from its other side.
    pub opposite: bool,
    /// Slices that both passes scanned.
    pub slices_joined: u64,
    /// Slices that this one alone scanned.
    pub slices_alone: u64,
    /// Voxels that too few beams of this pass entered, and that those of both did.
    pub voxels_revealed: u64,
    /// How alike what both passes saw is, where they are joined: the correlation of densities over voxels. `None` where they have too few in common.
    pub correlation: Option<f64>,
    /// The other pass fits better where it lies so much farther along the row, metres; `None` where it does not.
    pub shift_m: Option<f64>,
}

/// Returns within |θ| < 90°, by where they were put.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ReturnCounts {
    /// Canopy: leaf or wood of the scanned row.
    pub canopy: u64,
    /// Removed as ground: below the rig's ground clearance.
    pub ground: u64,
    /// Removed as the next row: beyond the row axis by more than half the row spacing.
    pub far: u64,
}

/// One tree's cell of the row.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct TreeEstimate {
    /// Index: tree `i` owns y in `[i, i + 1)` × tree spacing. Runs on beyond the rig's `trees`.
    pub tree: u32,
    /// Centre of the cell, metres.
    pub y_m: f64,
    /// False where less than the cell was scanned: at both ends of the stream, and at long gaps.
    pub complete: bool,
    /// Metres of the cell that were scanned.
    pub scanned_m: f64,
    /// I_T, m².
    pub impacted_total_area_m2: f64,
    /// Leaf areas; the index over row spacing × tree spacing (× metres scanned where the cell is not complete).
    #[serde(flatten)]
    pub leaf: PieceLeaf,
    /// Height that 99.5 % of the canopy returns stay below, metres; `None` without returns.
    pub height_m: Option<f64>,
    /// Crown volume from the side scanned, doubled, m³.
    pub volume_m3: f64,
    /// Canopy returns.
    pub returns: u64,
    /// What each requested estimator reports for the tree; empty if none was.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub measures: Vec<Measure>,
}

/// The trees that one way of cutting the row finds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TreesFound {
    /// How.
    pub method: CutMethod,
    /// The trees, in the order of travel.
    pub trees: Vec<FoundTree>,
}

/// One metre of row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct SliceEstimate {
    /// Centre of the metre.
    pub y_m: f64,
    /// Metres of it that were scanned.
    pub scanned_m: f64,
    /// I_T, m².
    pub impacted_total_area_m2: f64,
    /// Leaf areas.
    #[serde(flatten)]
    pub leaf: PieceLeaf,
    /// Canopy returns.
    pub returns: u64,
}

/// How far a stream has come; cheap, for progress bars.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Progress {
    /// Valid scan telegrams.
    pub scans: u64,
    /// Telegrams that came again.
    pub scans_repeated: u64,
    /// Telegrams missing.
    pub scans_lost: Option<u64>,
    /// Turns of the mirror of which the scanner made no telegram.
    pub turns_left_out: u64,
    /// Way from the first line to the last, metres; `None` without a rig.
    pub advance_m: Option<f64>,
    /// Y of the last line, metres; `None` without a rig.
    pub y_m: Option<f64>,
    /// I_T of the lines closed so far, m²; `None` without a rig.
    pub impacted_total_area_m2: Option<f64>,
}
