//! What a beam came back from.

use crate::organ::Surface;
use crate::support::SupportKind;

/// What kind of surface a beam met.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Class {
    /// A leaf blade.
    Leaf,
    /// A branch or trunk.
    Wood,
    /// The soil, or the plane below it.
    Ground,
    /// Nothing: the beam escaped.
    #[default]
    None,
    /// A fruit.
    Fruit,
    /// A post of the trellis.
    Post,
    /// A wire of the trellis.
    Wire,
    /// Grass, or the leaf of a weed.
    Grass,
}

impl From<Surface> for Class {
    fn from(surface: Surface) -> Self {
        match surface {
            Surface::Bark => Self::Wood,
            Surface::Fruit => Self::Fruit,
            Surface::Post => Self::Post,
            Surface::Wire => Self::Wire,
            Surface::Soil => Self::Ground,
            Surface::Grass => Self::Grass,
        }
    }
}

impl From<SupportKind> for Class {
    fn from(kind: SupportKind) -> Self {
        match kind {
            SupportKind::Post => Self::Post,
            SupportKind::Wire => Self::Wire,
        }
    }
}

impl Class {
    /// All classes.
    pub const ALL: &'static [Self] =
        &[Self::Leaf, Self::Wood, Self::Ground, Self::None, Self::Fruit, Self::Post, Self::Wire, Self::Grass];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Leaf => "leaf",
            Self::Wood => "wood",
            Self::Ground => "ground",
            Self::None => "none",
            Self::Fruit => "fruit",
            Self::Post => "post",
            Self::Wire => "wire",
            Self::Grass => "grass",
        }
    }
}

/// What one beam met first, with its truth labels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Return {
    /// Distance along the beam, metres; infinite where it met nothing.
    pub range_m: f64,
    /// What it met.
    pub class: Class,
    /// Number of the tree in [`crate::Orchard::trees`]; [`Return::NO_LABEL`] for ground, grass, misses, posts and wires.
    pub tree: u32,
    /// Number of the leaf or branch within its tree, facets counting on after branches; of a post or wire in
    /// [`crate::Orchard::supports`]; [`Return::NO_LABEL`] for ground, grass and misses.
    pub organ: u32,
    /// |beam · surface normal| there; 0 for a miss.
    pub cos_incidence: f32,
}

impl Return {
    /// Label of what belongs to no tree.
    pub const NO_LABEL: u32 = u32::MAX;

    /// A beam that met nothing.
    pub const MISS: Self = Self {
        range_m: f64::INFINITY,
        class: Class::None,
        tree: Self::NO_LABEL,
        organ: Self::NO_LABEL,
        cos_incidence: 0.0,
    };

    /// True where something was met.
    pub fn is_hit(&self) -> bool {
        self.class != Class::None
    }
}

impl Default for Return {
    fn default() -> Self {
        Self::MISS
    }
}
