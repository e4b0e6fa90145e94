//! The scenes that come with the program.

/// Name of the scene used when none is given.
pub const DEFAULT: &str = "spindle";

const SCENES: &[(&str, &str)] = &[
    ("spindle", include_str!("../scenes/spindle.toml")),
    ("tall_spindle", include_str!("../scenes/tall_spindle.toml")),
    ("mature", include_str!("../scenes/mature.toml")),
    ("paper", include_str!("../scenes/paper.toml")),
    ("vase", include_str!("../scenes/vase.toml")),
    ("fruiting_wall", include_str!("../scenes/fruiting_wall.toml")),
    ("hedge", include_str!("../scenes/hedge.toml")),
    ("leafy", include_str!("../scenes/leafy.toml")),
    ("woody", include_str!("../scenes/woody.toml")),
    ("wall", include_str!("../scenes/wall.toml")),
    ("post", include_str!("../scenes/post.toml")),
    ("cylinder", include_str!("../scenes/cylinder.toml")),
    ("slab", include_str!("../scenes/slab.toml")),
    ("gap_wall", include_str!("../scenes/gap_wall.toml")),
    ("checker", include_str!("../scenes/checker.toml")),
];

/// Names of the built-in scenes, [`DEFAULT`] first.
pub fn names() -> impl Iterator<Item = &'static str> {
    SCENES.iter().map(|(name, _)| *name)
}

/// TOML text of a built-in scene.
pub fn text(name: &str) -> Option<&'static str> {
    SCENES.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}
