//! The model and the device of a recorded LMS2xx.

use rowscan_protocol::lms2xx::Variant;
use rowscan_protocol::lms2xx::device::{Device, Options, Recorded};
use rowscan_protocol::lms2xx::model::{MODELS, Model, by_type_text};
use rowscan_protocol::lms2xx::values::{MeasuringMode, Unit};

use super::ReplayError;
use super::survey::{Part, Survey};

/// The model of a part: the one asked for, the one the file or the device names, else the first that has a scan of so many values.
pub fn lms2xx_model_of(
    survey: &Survey,
    part: &Part,
    asked: Option<&'static Model>,
) -> Result<&'static Model, ReplayError> {
    let by_name = |name: &str| MODELS.iter().copied().find(|model| model.name == name);
    if let Some(model) = asked.or_else(|| survey.about.model_of(&part.name).and_then(by_name)) {
        return Ok(model);
    }
    if let Some(text) = part.lms2xx.type_text() {
        return by_type_text(text).ok_or_else(|| ReplayError::UnknownModel { found: format!("`{text}`") });
    }
    let count = part.lms2xx.count();
    let measures = |model: &&Model| model.variants.iter().any(|variant| variant.count() == count);
    MODELS
        .iter()
        .copied()
        .find(measures)
        .ok_or_else(|| ReplayError::UnknownModel { found: format!("nameless and sends {count} values") })
}

/// The device that answers, set as the recorded one was found.
pub fn lms2xx_device_of(part: &Part, model: &'static Model, options: Options) -> Device {
    let mut device = Device::new(model, options);
    let told = &part.lms2xx;
    let Some(values) = &told.values else { return device };
    let of_count = |variant: &&Variant| variant.count() == told.count();
    let variant = told.variant.or_else(|| model.variants.iter().find(of_count).copied());
    // Where nobody asked, the values say enough of what they were measured with.
    let measured = told.measured.unwrap_or_else(|| {
        let unit = values.word.unit.unwrap_or(Unit::Mm);
        let mode = if unit == Unit::Mm { MeasuringMode::RANGE_32_M } else { MeasuringMode::default() };
        let mut configuration = model.configuration;
        configuration.set_unit(unit);
        configuration.set_measuring_mode(mode);
        configuration.set_real_time_index(values.real_time_index.is_some());
        configuration
    });
    device.play_back(Recorded {
        type_text: told.type_text.clone(),
        variant: variant.unwrap_or(model.default_variant),
        output: values.output,
        found: told.found.unwrap_or(measured),
        measured,
    });
    device
}
