//! The device's filters and its encoder.

use crate::device::context::{Context, Readable, Writable};
use crate::device::filter::{MEAN_SCANS, MEDIAN_BEAMS};
use crate::device::refusal::Fault;
use crate::telegram::SopasError;
use crate::telegram::lfp_filter::{MeanFilter, MedianFilter, ParticleFilter};
use crate::telegram::lic_encoder::{
    ENCODER, EncoderResolution, EncoderSetting, IncrementSource, InputsThreeAndFour, LEVEL,
};
use crate::telegram::ms_suppmode::{FOG, SuppressionMode};

/// Ticks a millimetre an encoder may have.
const RESOLUTIONS: core::ops::RangeInclusive<f32> = 0.001..=2000.0;

/// A variable that is one part of the settings, and the values it takes.
macro_rules! settings {
    ($($variable:ident: $($path:ident).+, $value:ident => $possible:expr, $fault:ident;)*) => {$(
        impl Readable for $variable {
            fn get(context: &Context<'_>) -> Self {
                context.device.settings.$($path).+
            }
        }

        impl Writable for $variable {
            fn set(self, context: &mut Context<'_>) -> Result<(), SopasError> {
                let $value = &self;
                if !$possible {
                    return Err(Fault::$fault.into());
                }
                context.device.settings.$($path).+ = self;
                Ok(())
            }
        }
    )*};
}

settings! {
    MeanFilter: filters.mean, it => MEAN_SCANS.contains(&it.scans) && it.reserved == 0, ImpossibleFilter;
    MedianFilter: filters.median, it => it.beams == MEDIAN_BEAMS, ImpossibleFilter;
    ParticleFilter: filters.particle, it => it.threshold_mm > 0, ImpossibleFilter;
    SuppressionMode: suppression, it => it.code <= FOG, NoSuchCode;
    IncrementSource: encoder.source, it => it.code <= ENCODER, NoSuchCode;
    EncoderSetting: encoder.setting, it => it.code <= LEVEL, NoSuchCode;
    EncoderResolution: encoder.resolution, it => RESOLUTIONS.contains(&it.ticks_per_mm), NoSuchCode;
    InputsThreeAndFour: encoder.inputs, _it => true, NoSuchCode;
}
