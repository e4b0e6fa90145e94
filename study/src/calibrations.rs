//! Calibrations by shipped name or by file.

use rowscan_canopy::{Calibration, CalibrationError, shipped};
use rowscan_protocol::rig::{BeamWidth, Rig};
use rowscan_scenes::files::{LoadError, SourceText};

use crate::fingerprint;

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
    /// Calibrations of this class ship for other scanner models only.
    #[error(
        "no calibration `{class}` ships for the scanner model {model}; expected one of {}, or a calibration file (`rowscan study calibration` makes one)",
        shipped.join(", ")
    )]
    OtherModels {
        /// The class that was named.
        class: String,
        /// The scanner's model.
        model: String,
        /// The calibrations of the class.
        shipped: Vec<&'static str>,
    },
}

/// The calibration a rig names, for the scanner model it carries and the beams it has: the shipped one of that name; else `NAME-MODEL-device` for beams with a width, where that is
/// shipped, else `NAME-MODEL`; none if calibrations of that name are shipped for other models only; else whatever `NAME` is.
pub fn load_calibration_for(
    name: &str,
    model: &str,
    beams: Option<BeamWidth>,
) -> Result<Option<Calibration>, ConfigError> {
    if shipped::text(name).is_some() {
        return load_calibration(name).map(Some);
    }
    let of_rays = format!("{name}-{model}");
    let of_device = format!("{of_rays}-device");
    if beams == Some(BeamWidth::Device) && shipped::text(&of_device).is_some() {
        load_calibration(&of_device).map(Some)
    } else if shipped::text(&of_rays).is_some() {
        load_calibration(&of_rays).map(Some)
    } else if of_class(name).next().is_some() {
        Ok(None)
    } else {
        load_calibration(name).map(Some)
    }
}

/// The calibration that a rig names for its first scanner.
///
/// # Errors
/// It cannot be read or trusted: such a row is not one without a calibration.
pub(crate) fn of_rig(rig: &Rig) -> Result<Option<Calibration>, ConfigError> {
    let named = rig.calibration.as_deref().zip(rig.scanners.first());
    named.map_or(Ok(None), |(name, mount)| load_calibration_for(name, &mount.model, rig.optics))
}

/// The calibration that someone asks for: a file, a shipped one's name, or a class, of which it is the scanner model's as in
/// [`load_calibration_for`].
///
/// # Errors
/// What cannot be read or trusted, and a class that has none for the model.
pub fn load_named_calibration(
    name: &str,
    model: &str,
    beams: Option<BeamWidth>,
) -> Result<Calibration, ConfigError> {
    load_calibration_for(name, model, beams)?.ok_or_else(|| ConfigError::OtherModels {
        class: name.to_owned(),
        model: model.to_owned(),
        shipped: of_class(name).collect(),
    })
}

/// The shipped calibrations of a class.
fn of_class(class: &str) -> impl Iterator<Item = &'static str> {
    let family = format!("{class}-");
    shipped::names().filter(move |shipped| shipped.starts_with(&family))
}

/// A calibration by shipped name or file, validated.
fn load_calibration(name: &str) -> Result<Calibration, ConfigError> {
    let source = SourceText::find("calibration", name, shipped::text, shipped::names().collect())?;
    let calibration: Calibration = source.parse()?;
    as_it_was_made(&calibration)
        .and_then(|()| calibration.validate())
        .map_err(|cause| ConfigError::Calibration { place: source.place, cause })?;
    Ok(calibration)
}

/// A calibration as its file has it: with the fingerprint of its values.
pub fn sealed(calibration: &Calibration) -> Calibration {
    Calibration { fingerprint: Some(fingerprint_of(calibration)), ..calibration.clone() }
}

/// Refuses a calibration that was changed since it was made: no other value of it could be held against the one that is wrong.
fn as_it_was_made(calibration: &Calibration) -> Result<(), CalibrationError> {
    let found = fingerprint_of(calibration);
    match &calibration.fingerprint {
        Some(written) if *written != found => {
            Err(CalibrationError::Changed { written: written.clone(), found })
        }
        _ => Ok(()),
    }
}

/// Of all values but the fingerprint, whatever order they stand in.
fn fingerprint_of(calibration: &Calibration) -> String {
    let own = Calibration { fingerprint: None, ..calibration.clone() };
    let mut values = serde_json::to_value(own).unwrap_or_default();
    values.sort_all_objects();
    fingerprint::of(&values)
}

#[cfg(test)]
mod tests {
    use toml::Value;

    use super::*;

    #[test]
    fn a_family_has_calibrations_for_some_models_and_a_wrong_name_has_none() {
        assert!(load_calibration_for("spindle", "lms111", None).is_ok_and(|found| found.is_some()));
        assert!(load_calibration_for("spindle", "no-such-model", None).is_ok_and(|found| found.is_none()));
        // One by its whole name is that, whatever the scanner; some begin as others do.
        let whole = load_calibration_for("spindle-picoscan150", "lms111", None).unwrap().unwrap();
        assert_eq!(whole.class.scanner_model, "picoscan150");
        let wrong = load_calibration_for("spindel", "lms111", None);
        assert!(matches!(wrong, Err(ConfigError::Load(LoadError::Missing { .. }))));
    }

    /// Every number and text of a file, one after the other, by a little.
    #[test]
    fn a_calibration_with_any_value_changed_is_refused_and_without_its_fingerprint_it_is_somebodys_own() {
        let shipped = shipped::text("spindle-lms511-device").unwrap();
        let whole: Value = toml::from_str(shipped).unwrap();
        let mut paths = Vec::new();
        paths_of(&whole, &mut Vec::new(), &mut paths);
        assert!(paths.len() > 60, "{}", paths.len());
        for path in paths {
            let mut changed = whole.clone();
            let value = path.iter().fold(&mut changed, |table, key| &mut table[key.as_str()]);
            match value {
                Value::Float(value) => *value *= 1.001,
                Value::Integer(value) => *value += 1,
                Value::String(value) if value.ends_with("lms511") => value.push('x'),
                Value::Array(values) => drop(values.pop()),
                // One of a few names, which another one belongs to another class.
                _ => continue,
            }
            if path == ["fingerprint"] {
                continue;
            }
            let changed: Calibration = changed.try_into().unwrap_or_else(|why| panic!("{path:?}: {why}"));
            let refused = as_it_was_made(&changed).expect_err(&path.join("."));
            assert!(refused.to_string().contains("take the line `fingerprint` out"), "{refused}");
            assert_eq!(as_it_was_made(&Calibration { fingerprint: None, ..changed }), Ok(()));
        }
        // Another order, another spelling of the same values.
        let same: Calibration = toml::from_str(&toml::to_string(&whole).unwrap()).unwrap();
        assert_eq!(as_it_was_made(&same), Ok(()));
    }

    fn paths_of(value: &Value, path: &mut Vec<String>, paths: &mut Vec<Vec<String>>) {
        let Value::Table(table) = value else { return paths.push(path.clone()) };
        for (key, value) in table {
            path.push(key.clone());
            paths_of(value, path, paths);
            path.pop();
        }
    }

    #[test]
    fn every_shipped_calibration_is_as_it_was_made() {
        for name in shipped::names() {
            let shipped = load_calibration(name).expect(name);
            assert!(shipped.fingerprint.is_some(), "{name}");
        }
    }

    #[test]
    fn who_asks_for_a_class_gets_that_of_the_model_or_hears_which_there_are() {
        let preset_of =
            |name, model| load_named_calibration(name, model, None).map(|found| found.class.scanner_model);
        assert_eq!(preset_of("spindle", "lms511").unwrap(), "lms511");
        // One by its whole name is that, whatever the scanner.
        assert_eq!(preset_of("spindle-lms511", "lms111").unwrap(), "lms511");
        let told = preset_of("paper", "mrs1000").unwrap_err().to_string();
        assert!(told.contains("paper-lms111, paper-lms200") && told.contains("mrs1000"), "{told}");
        assert!(matches!(preset_of("spindel", "lms111"), Err(ConfigError::Load(LoadError::Missing { .. }))));
    }
}
