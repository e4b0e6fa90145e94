//! What a build may leave out: the features of Cargo.toml, and what is said where one is missing.

/// A part of the program that not every build has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feature {
    /// Figures and pictures with letters as PNG and PDF.
    Figures,
    /// A server for Foxglove and Lichtblick.
    Foxglove,
    /// Completions for shells, and the manual.
    Manual,
    /// Maps as GeoPackage and GeoTIFF.
    Maps,
    /// Tables as LAS and Parquet.
    Tables,
}

impl Feature {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Figures, Self::Foxglove, Self::Manual, Self::Maps, Self::Tables];

    /// Its name for cargo.
    pub fn name(self) -> &'static str {
        match self {
            Self::Figures => "figures",
            Self::Foxglove => "foxglove",
            Self::Manual => "manual",
            Self::Maps => "maps",
            Self::Tables => "tables",
        }
    }

    /// True if this build has it.
    pub fn is_built(self) -> bool {
        match self {
            Self::Figures => cfg!(feature = "figures"),
            Self::Foxglove => cfg!(feature = "foxglove"),
            Self::Manual => cfg!(feature = "manual"),
            Self::Maps => cfg!(feature = "maps"),
            Self::Tables => cfg!(feature = "tables"),
        }
    }

    /// Refuses `what` in a build that leaves this out.
    ///
    /// # Errors
    /// It does.
    pub fn needed_by(self, what: &'static str) -> Result<(), MissingFeature> {
        if self.is_built() { Ok(()) } else { Err(self.missing(what)) }
    }

    /// How `what` is refused.
    pub(crate) fn missing(self, what: &'static str) -> MissingFeature {
        MissingFeature { what, feature: self }
    }
}

/// What was asked for is not in this build.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{what} needs the feature `{name}`, which this build leaves out: cargo build --release --features {name}",
    name = feature.name()
)]
pub struct MissingFeature {
    what: &'static str,
    feature: Feature,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_part_is_named_with_the_command_that_builds_it() {
        let said = Feature::Figures.missing("a figure as PDF").to_string();
        assert_eq!(
            said,
            "a figure as PDF needs the feature `figures`, which this build leaves out: cargo build --release --features figures"
        );
        for feature in Feature::ALL {
            assert_eq!(feature.needed_by("it").is_ok(), feature.is_built());
        }
    }

    #[test]
    fn every_part_is_a_feature_of_the_manifest_and_full_has_them_all() {
        let manifest: toml::Table = include_str!("../Cargo.toml").parse().expect("TOML");
        let features = manifest["features"].as_table().expect("features");
        let named = |feature: &str| -> Vec<&str> {
            features[feature].as_array().expect("a list").iter().filter_map(toml::Value::as_str).collect()
        };
        for feature in Feature::ALL {
            assert!(features.contains_key(feature.name()) && named("full").contains(&feature.name()));
        }
    }
}
