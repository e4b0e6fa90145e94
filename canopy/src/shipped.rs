//! Calibrations that ship with the crate, each made by the command its provenance names.

macro_rules! shipped {
    ($($name:literal),+ $(,)?) => {
        /// Name and TOML text, one line a calibration.
        static SHIPPED: &[(&str, &str)] = &[
            $(($name, include_str!(concat!("../calibrations/", $name, ".toml"))),)+
        ];
    };
}

shipped! {
    "mature-lms111",
    "mature-lms111-device",
    "mature-lms200",
    "mature-lms221",
    "mature-lms291",
    "mature-lms291-device",
    "mature-lms511",
    "mature-lms511-device",
    "mature-picoscan150",
    "mature-picoscan150-device",
    "mature-tim561-device",
    "paper-lms111",
    "paper-lms200",
    "paper-lms221",
    "paper-lms291",
    "paper-lms511",
    "spindle-lms111",
    "spindle-lms111-device",
    "spindle-lms200",
    "spindle-lms221",
    "spindle-lms291",
    "spindle-lms291-device",
    "spindle-lms511",
    "spindle-lms511-device",
    "spindle-picoscan150",
    "spindle-picoscan150-device",
    "spindle-tim561-device",
}

/// The names of all shipped calibrations.
pub fn names() -> impl Iterator<Item = &'static str> {
    SHIPPED.iter().map(|(name, _)| *name)
}

/// The TOML text of the shipped calibration `name`.
pub fn text(name: &str) -> Option<&'static str> {
    SHIPPED.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Calibration;
    use crate::calibration::Optics;

    #[test]
    fn every_shipped_calibration_is_sound_and_says_how_it_was_made() {
        for name in names() {
            let calibration: Calibration = toml::from_str(text(name).unwrap_or_default()).expect(name);
            calibration.validate().expect(name);
            let (rows, optics) = match name.strip_suffix("-device") {
                Some(rows) => (rows, Optics::Footprint),
                None => (name, Optics::Ideal),
            };
            let Some((preset, model)) = rows.split_once('-') else { panic!("{name} is not PRESET-MODEL") };
            assert_eq!(calibration.class.optics, optics, "{name}");
            assert_eq!(calibration.class.preset, preset);
            assert_eq!(calibration.class.scanner_model, model);
            assert!(calibration.provenance.command.contains(&format!("{preset} --model {model}")), "{name}");
            assert_eq!(calibration.provenance.seeds.len(), calibration.training.n as usize, "{name}");
            // Seeds 1 to 1000 are for trying estimates on.
            assert!(calibration.provenance.seeds.iter().all(|seed| *seed > 1000), "{name}");
        }
    }
}
