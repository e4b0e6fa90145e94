//! The scenes that come with the program.

/// Name of the scene used when none is given.
pub const DEFAULT: &str = "spindle";

const SCENES: &[(&str, &str)] = &[
    ("spindle", include_str!("../scenes/spindle.toml")),
    ("mature", include_str!("../scenes/mature.toml")),
    ("paper", include_str!("../scenes/paper.toml")),
];

/// Names of the built-in scenes, [`DEFAULT`] first.
pub fn names() -> impl Iterator<Item = &'static str> {
    SCENES.iter().map(|(name, _)| *name)
}

/// TOML text of a built-in scene.
pub fn text(name: &str) -> Option<&'static str> {
    SCENES.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}
