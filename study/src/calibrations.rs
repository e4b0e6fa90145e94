//! Calibrations by shipped name or by file.

use rowscan_canopy::{Calibration, CalibrationError, shipped};
use rowscan_protocol::rig::BeamWidth;
use rowscan_scenes::files::{LoadError, SourceText};

/// Why a calibration could not be used. Each message names the place and the remedy.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// A file that cannot be read.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// A calibration that cannot be trusted.
    #[error("{place}: {cause}")]
    Calibration {
        /// File or built-in name.
        place: String,
        /// What is wrong.
        cause: CalibrationError,
    },
}

/// The calibration a rig names, for the scanner model it carries and the beams it has: `NAME-MODEL-device` for beams with a width, where that is
/// shipped, else `NAME-MODEL`; none if calibrations of that name are shipped for other models only; else whatever `NAME` is.
pub fn load_calibration_for(
    name: &str,
    model: &str,
    beams: Option<BeamWidth>,
) -> Result<Option<Calibration>, ConfigError> {
    let of_rays = format!("{name}-{model}");
    let of_device = format!("{of_rays}-device");
    let family = format!("{name}-");
    if beams == Some(BeamWidth::Device) && shipped::text(&of_device).is_some() {
        load_calibration(&of_device).map(Some)
    } else if shipped::text(&of_rays).is_some() {
        load_calibration(&of_rays).map(Some)
    } else if shipped::names().any(|shipped| shipped.starts_with(&family)) {
        Ok(None)
    } else {
        load_calibration(name).map(Some)
    }
}

/// A calibration by shipped name or file, validated.
pub fn load_calibration(name: &str) -> Result<Calibration, ConfigError> {
    let source = SourceText::find("calibration", name, shipped::text, shipped::names().collect())?;
    let calibration: Calibration = source.parse()?;
    calibration.validate().map_err(|cause| ConfigError::Calibration { place: source.place, cause })?;
    Ok(calibration)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_family_has_calibrations_for_some_models_and_a_wrong_name_has_none() {
        assert!(load_calibration_for("spindle", "lms111", None).is_ok_and(|found| found.is_some()));
        assert!(load_calibration_for("spindle", "no-such-model", None).is_ok_and(|found| found.is_none()));
        let wrong = load_calibration_for("spindel", "lms111", None);
        assert!(matches!(wrong, Err(ConfigError::Load(LoadError::Missing { .. }))));
    }
}
