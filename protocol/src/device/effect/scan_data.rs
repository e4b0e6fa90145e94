//! What the scan telegrams hold: contents, range, echoes.

use alloc::vec;

use crate::device::context::{Context, Readable, Writable};
use crate::device::refusal::Fault;
use crate::device::settings::{LayersSent, OutputCut};
use crate::model::Model;
use crate::telegram::SopasError;
use crate::telegram::fr_echo_filter::{self, EchoFilter};
use crate::telegram::lmd_scandatacfg::{ANGLE_TABLE, REMISSION, REMISSION_16_BIT, ScanDataConfig};
use crate::telegram::lmp_output_range::{OutputRange, Sector};
use crate::telegram::scan_layer_filter::ScanLayerFilter;

/// Largest n of "every n-th scan".
const MAX_OUTPUT_RATE: u16 = 50_000;

impl Readable for ScanDataConfig {
    fn get(context: &Context<'_>) -> Self {
        context.device.settings.scan_data.clone()
    }
}

impl Writable for ScanDataConfig {
    /// What would have no effect is refused.
    fn set(self, context: &mut Context<'_>) -> Result<(), SopasError> {
        let echoes = 1u16 << context.device.model.echoes;
        let model = context.device.model;
        let has_echoes = self.channels.0 > 0 || model.takes_empty_echo_mask;
        let possible = has_echoes
            && self.channels.0 < echoes
            && self.remission <= possible_remission(model)
            && self.resolution <= REMISSION_16_BIT
            && self.unit == 0
            && self.encoders.0 < 1u16 << context.device.model.encoders
            && (1..=MAX_OUTPUT_RATE).contains(&self.output_rate);
        if !possible {
            return Err(Fault::ImpossibleContents.into());
        }
        context.device.settings.scan_data = self;
        Ok(())
    }
}

/// All bits that the remission may have.
fn possible_remission(model: &Model) -> u8 {
    if model.angle_table { REMISSION | ANGLE_TABLE } else { REMISSION }
}

impl Readable for OutputRange {
    fn get(context: &Context<'_>) -> Self {
        let device = &context.device;
        let OutputCut { start, stop } = device.settings.output_range;
        let step = device.settings.written_step.unwrap_or(device.settings.mode.step.into());
        Self { sectors: vec![Sector { step, start, stop }] }
    }
}

impl Writable for OutputRange {
    /// Reads back as it was written. The step of the beams comes from the scan mode.
    fn set(self, context: &mut Context<'_>) -> Result<(), SopasError> {
        let &[Sector { step, start, stop }] = self.sectors.as_slice() else {
            return Err(Fault::OutsideOutputRange.into());
        };
        let cut = OutputCut { start, stop };
        let model = context.device.model;
        if !cut.is_within(model) || !cut.has_beams(model, context.device.settings.mode) {
            return Err(Fault::OutsideOutputRange.into());
        }
        context.device.settings.output_range = cut;
        context.device.settings.written_step = Some(step);
        Ok(())
    }
}

impl Readable for EchoFilter {
    fn get(context: &Context<'_>) -> Self {
        Self { code: context.device.settings.echo_filter }
    }
}

impl Writable for EchoFilter {
    fn set(self, context: &mut Context<'_>) -> Result<(), SopasError> {
        if self.code > fr_echo_filter::LAST {
            return Err(Fault::NoSuchCode.into());
        }
        if context.device.lacks_the_echo() {
            context.device.fixed += 1;
            return Err(Fault::FixedByRecording.into());
        }
        context.device.settings.echo_filter = self.code;
        Ok(())
    }
}

impl Readable for ScanLayerFilter {
    fn get(context: &Context<'_>) -> Self {
        let LayersSent(mask) = context.device.settings.layers;
        Self { layers: (0..context.device.model.layers.len()).map(|layer| mask >> layer & 1 == 1).collect() }
    }
}

impl Writable for ScanLayerFilter {
    fn set(self, context: &mut Context<'_>) -> Result<(), SopasError> {
        let count = context.device.model.layers.len();
        if self.layers.len() != count || !self.layers.contains(&true) {
            return Err(Fault::NoSuchLayers.into());
        }
        let mask = (0..).zip(self.layers).map(|(layer, on): (u8, bool)| u8::from(on) << layer);
        context.device.settings.layers = LayersSent(mask.fold(0, |all, bit| all | bit));
        Ok(())
    }
}
