//! Calibrations that ship with the crate, each made by the command its provenance names.

/// Name and TOML text, one line a calibration.
static SHIPPED: &[(&str, &str)] = &[];

/// The names of all shipped calibrations.
pub fn names() -> impl Iterator<Item = &'static str> {
    SHIPPED.iter().map(|(name, _)| *name)
}

/// The TOML text of the shipped calibration `name`.
pub fn text(name: &str) -> Option<&'static str> {
    SHIPPED.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}
