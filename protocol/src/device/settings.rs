//! What a client can set, and what mEEwriteall keeps.

use alloc::string::String;

use super::filter;
use super::variable::Stored;
use crate::angle::BeamGrid;
use crate::model::{Model, RemissionWidth, ScanMode};
use crate::telegram::lfp_filter::{MeanFilter, MedianFilter, ParticleFilter};
use crate::telegram::lic_encoder::{
    self, EncoderResolution, EncoderSetting, IncrementSource, InputsThreeAndFour,
};
use crate::telegram::lmd_scandatacfg::{REMISSION_8_BIT, REMISSION_16_BIT, ScanDataConfig};
use crate::telegram::ms_suppmode::{self, SuppressionMode};
use crate::telegram::wire::LowHigh;
use crate::telegram::{Variable, fr_echo_filter};

/// Clients that compute in radians write an output range that is a few 1/10000° off; a beam this near to the edge is inside.
const EDGE_TOLERANCE: i32 = 10;
/// 1/10000° a degree.
const PER_DEGREE: f64 = 10_000.0;

/// All settings.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Settings {
    pub(super) mode: ScanMode,
    pub(super) output_range: OutputCut,
    /// The step that a client wrote with the output range, 1/10000°: it reads back and has no effect. The scan mode's where there is none.
    pub(super) written_step: Option<u32>,
    pub(super) scan_data: ScanDataConfig,
    pub(super) echo_filter: u8,
    pub(super) suppression: SuppressionMode,
    pub(super) location_name: String,
    pub(super) filters: filter::Active,
    pub(super) encoder: EncoderSettings,
    pub(super) applications: Applications,
    pub(super) layers: LayersSent,
    /// Of a scanner with Compact output, what its variables were set to.
    pub(super) variables: Stored,
}

/// How the way travelled is counted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct EncoderSettings {
    pub(super) source: IncrementSource,
    pub(super) setting: EncoderSetting,
    pub(super) resolution: EncoderResolution,
    pub(super) inputs: InputsThreeAndFour,
}

/// Which applications run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Applications {
    /// `RANG`: scans are made.
    pub(super) ranging: bool,
    /// `FEVL`: fields are evaluated.
    pub(super) evaluation: bool,
}

/// The layers that are sent: bit 0 for the lowest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct LayersSent(pub(super) u8);

impl LayersSent {
    fn all(model: &Model) -> Self {
        Self(((1_u16 << model.layers.len().min(8)) - 1) as u8)
    }

    /// True if scans of this layer go out. Codes count downwards, so the lowest layer has the greatest.
    pub(super) fn sends(self, model: &Model, layer: i16) -> bool {
        let below = model.layers.iter().filter(|other| **other > layer).count();
        self.0 >> below.min(7) & 1 == 1
    }
}

impl EncoderSettings {
    /// True if increments are counted.
    pub(super) fn counts(&self, model: &Model) -> bool {
        self.source.code == lic_encoder::ENCODER
            && self.setting.code != lic_encoder::OFF
            && (self.inputs.encoder || !model.has(<InputsThreeAndFour as Variable>::NAME))
    }
}

/// The part of the turn that is sent, 1/10000°.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct OutputCut {
    pub(super) start: i32,
    pub(super) stop: i32,
}

impl Settings {
    /// Out of the box. Contents of LMDscandata: first echo, no remission, no time, every scan (not verified).
    pub(super) fn new(model: &Model, location_name: &str) -> Self {
        Self {
            mode: model.default_mode,
            output_range: OutputCut { start: model.start_angle, stop: model.stop_angle },
            written_step: None,
            scan_data: ScanDataConfig {
                channels: LowHigh(1),
                resolution: match model.remission {
                    RemissionWidth::Bits8 => REMISSION_8_BIT,
                    RemissionWidth::Bits16 => REMISSION_16_BIT,
                },
                output_rate: 1,
                ..ScanDataConfig::default()
            },
            echo_filter: fr_echo_filter::ALL,
            suppression: SuppressionMode { code: ms_suppmode::GLITCH },
            location_name: location_name.into(),
            filters: filter::Active {
                mean: MeanFilter { active: false, scans: *filter::MEAN_SCANS.start(), reserved: 0 },
                median: MedianFilter { active: false, beams: filter::MEDIAN_BEAMS },
                particle: ParticleFilter { active: false, threshold_mm: 500 },
            },
            encoder: EncoderSettings {
                source: IncrementSource { code: lic_encoder::FIXED_SPEED },
                setting: EncoderSetting { code: lic_encoder::OFF },
                resolution: EncoderResolution { ticks_per_mm: 1.0 },
                inputs: InputsThreeAndFour::default(),
            },
            applications: Applications { ranging: true, evaluation: true },
            layers: LayersSent::all(model),
            variables: model.compact.map_or_else(Stored::default, |_| Stored::new()),
        }
    }
}

impl Settings {
    /// Echoes that get a channel, bit 0 for the first.
    pub(super) fn delivered_echoes(&self, model: &Model) -> u16 {
        let all = (1_u16 << model.echoes) - 1;
        match self.echo_filter {
            // Where an empty mask is taken, one echo is sent.
            fr_echo_filter::ALL => self.scan_data.channels.0.max(1) & all,
            // The one echo that is left is sent whatever the mask says: no scan is without a channel.
            _ => 1,
        }
    }
}

impl OutputCut {
    /// True if it lies within the model's range, give or take the rounding of clients.
    pub(super) fn is_within(&self, model: &Model) -> bool {
        self.start < self.stop
            && self.start >= model.start_angle - EDGE_TOLERANCE
            && self.stop <= model.stop_angle + EDGE_TOLERANCE
    }

    /// True if it takes no beam away.
    pub(super) fn is_full(&self, model: &Model) -> bool {
        self.start <= model.start_angle + EDGE_TOLERANCE && self.stop >= model.stop_angle - EDGE_TOLERANCE
    }

    /// True if it leaves beams in every turn of this mode.
    pub(super) fn has_beams(&self, model: &Model, mode: ScanMode) -> bool {
        model.grids(mode).all(|grid| !self.beams(grid).1.is_empty())
    }

    /// The beams of `full` inside the cut: index of the first, and their grid. Beams are taken away, never moved.
    pub(super) fn beams(&self, full: BeamGrid) -> (usize, BeamGrid) {
        let step = full.step_deg() * PER_DEGREE;
        let steps_to = |angle: i32| (f64::from(angle) - f64::from(full.start)) / step;
        let first = ceil(steps_to(self.start.saturating_sub(EDGE_TOLERANCE))).min(full.len());
        let end = (floor(steps_to(self.stop.saturating_add(EDGE_TOLERANCE))) + 1).min(full.len());
        let start = full.start + (first as f64 * step + 0.5) as i32;
        (first, BeamGrid { start, step: full.step, count: end.saturating_sub(first) as u16 })
    }
}

/// Not below zero.
fn floor(value: f64) -> usize {
    value as usize
}

fn ceil(value: f64) -> usize {
    let whole = floor(value);
    whole + usize::from(value > whole as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::MODELS;

    #[test]
    fn a_range_a_few_ten_thousandths_short_is_the_full_one() {
        for model in MODELS {
            // What a client that computes in radians writes.
            let cut = OutputCut { start: model.start_angle + 3, stop: model.stop_angle - 3 };
            assert!(cut.is_full(model) && cut.is_within(model));
            let full = model.beams(model.default_mode);
            assert_eq!(cut.beams(full), (0, full));
        }
    }

    #[test]
    fn a_cut_keeps_the_beams_where_they_are() {
        let full = BeamGrid::spanning(-50_000, 1_850_000, 1667);
        let (first, beams) = OutputCut { start: 450_000, stop: 1_350_000 }.beams(full);
        assert_eq!((first, beams.start, beams.count), (300, 450_000, 541));
        // Between two beams: the next inside.
        let (first, beams) = OutputCut { start: 450_100, stop: 451_700 }.beams(full);
        assert_eq!((first, beams.start, beams.count), (301, 451_667, 1));
        for i in 0..beams.len() {
            assert!((beams.angle_deg(i) - full.angle_deg(first + i)).abs() < 1e-4);
        }
    }

    #[test]
    fn a_cut_between_two_beams_is_empty() {
        let full = BeamGrid::spanning(-450_000, 2_250_000, 5000);
        assert_eq!(OutputCut { start: 1000, stop: 4000 }.beams(full).1.count, 0);
    }
}
