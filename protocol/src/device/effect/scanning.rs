//! Laser and mirror: on and off, how fast, how fine.

use alloc::vec;

use crate::device::condition::Activity;
use crate::device::context::{Callable, Context, Readable};
use crate::device::state::Device;
use crate::model::ScanMode;
use crate::telegram::SopasError;
use crate::telegram::lmc_meas::{ACCEPTED, Standby, StartMeasurement, StopMeasurement};
use crate::telegram::lmp_output_range::Sector;
use crate::telegram::lmp_scancfg::{
    INVALID_AREA, INVALID_FREQUENCY, INVALID_FREQUENCY_AND_RESOLUTION, INVALID_RESOLUTION, OK, OTHER_ERROR,
    ScanConfig, SetScanConfig, SetScanConfigReply,
};

impl Callable for StartMeasurement {
    fn call(self, context: &mut Context<'_>) -> Result<u8, SopasError> {
        context.access.delay = context.device.takes(context.device.model.times.start_reply);
        context.device.start_measurement(context.now);
        Ok(ACCEPTED)
    }
}

impl Callable for StopMeasurement {
    fn call(self, context: &mut Context<'_>) -> Result<u8, SopasError> {
        context.device.stop_measurement(Activity::Stopped);
        Ok(ACCEPTED)
    }
}

impl Callable for Standby {
    fn call(self, context: &mut Context<'_>) -> Result<u8, SopasError> {
        context.device.stop_measurement(Activity::Standby);
        Ok(ACCEPTED)
    }
}

impl Readable for ScanConfig {
    fn get(context: &Context<'_>) -> Self {
        in_force(context.device)
    }
}

fn in_force(device: &Device) -> ScanConfig {
    let ScanMode { frequency_centihz, step } = device.settings.mode;
    let sector = Sector { step: step.into(), start: device.model.start_angle, stop: device.model.stop_angle };
    ScanConfig { frequency_centihz, sectors: vec![sector] }
}

impl Callable for SetScanConfig {
    fn call(self, context: &mut Context<'_>) -> Result<SetScanConfigReply, SopasError> {
        let code = set_mode(context.device, &self.config);
        Ok(SetScanConfigReply { code, config: in_force(context.device) })
    }
}

/// Takes a mode that the model has.
pub(super) fn switch_mode(device: &mut Device, mode: ScanMode) {
    if device.settings.mode != mode {
        device.condition.mode_changed = true;
        device.settings.mode = mode;
        device.settings.written_step = None;
    }
}

/// The angles must be sent and are ignored, as the manual has it for LMS1xx and LMS5xx.
pub(in crate::device) fn set_mode(device: &mut Device, config: &ScanConfig) -> u8 {
    let &[Sector { step, .. }] = config.sectors.as_slice() else {
        return OTHER_ERROR;
    };
    // No step is that coarse: what does not fit is as unknown as the largest number.
    let step = u16::try_from(step).unwrap_or(u16::MAX);
    let mode = ScanMode { frequency_centihz: config.frequency_centihz, step };
    if device.check_mode(mode).is_ok() {
        // Of a coarser grid the output range may hold no beam.
        if !device.settings.output_range.has_beams(device.model, mode) {
            return INVALID_AREA;
        }
        switch_mode(device, mode);
        return OK;
    }
    device.fixed += u32::from(device.recorded.is_some() && device.model.modes.contains(&mode));
    let known = |matches: fn(&ScanMode, &ScanMode) -> bool| {
        device.legal_modes().iter().any(|other| matches(other, &mode))
    };
    match (known(|a, b| a.frequency_centihz == b.frequency_centihz), known(|a, b| a.step == b.step)) {
        (false, false) => INVALID_FREQUENCY_AND_RESOLUTION,
        (false, true) => INVALID_FREQUENCY,
        // Also where each is known, but not this pair.
        (true, _) => INVALID_RESOLUTION,
    }
}
