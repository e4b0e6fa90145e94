//! How a scanner sends its turns as Compact telegrams over UDP.

use super::layer::Layer;
use crate::optics::Fact;

/// Variables that only scanners with several layers a turn have.
const OF_LAYERS: [&str; 2] = ["LFPlayerFilter", "ScanDataPreformatting"];

/// What a model's Compact output is. Data only.
#[derive(Debug)]
pub struct CompactOutput {
    /// The scan modes are these numbers of PerformanceProfileNumber, from 1 on.
    pub profiles: u8,
    /// Width of a segment, 1/10000°.
    pub segment: u32,
    /// The same at [`wide_from_centihz`](Self::wide_from_centihz) and faster.
    pub wide_segment: u32,
    /// Scan frequency from which segments are wide, 1/100 Hz.
    pub wide_from_centihz: u32,
    /// From a segment's first beam to the time of transmission that its telegram says, µs (`bench` profile).
    pub transmit_us: i32,
    /// The same, from the least to the most (`field` profile).
    pub transmit_within_us: [i32; 2],
    /// How far a segment's start and stop are off their even places, µs, at most (`field` profile).
    pub jitter_us: Fact,
    /// It has an inertial measurement unit: from one reading to the next, µs.
    pub imu_period_us: Option<u32>,
    /// It tells what the encoder at its inputs counts.
    pub encoder: bool,
    /// The layers whose lines each turn has, the highest first; none where a turn is one line.
    pub layers: &'static [Layer],
    /// How far the elevation of a unit's layer may be off, degrees: each unit tells the ones that its maker has measured.
    pub elevation_off_deg: Fact,
    /// Names of variables that others with Compact output have, and it has not.
    pub lacks: &'static [&'static str],
}

impl CompactOutput {
    /// Whether it has the variable `name`, if others with Compact output have it.
    pub fn has(&self, name: &str) -> bool {
        !self.lacks.contains(&name) && (!OF_LAYERS.contains(&name) || !self.layers.is_empty())
    }

    /// Width of a segment at this scan frequency, 1/10000°.
    pub fn segment_at(&self, frequency_centihz: u32) -> u32 {
        if frequency_centihz >= self.wide_from_centihz { self.wide_segment } else { self.segment }
    }
}
