//! Choices that a tree's parameters offer.

use crate::parameters::choices;

choices! {
    /// Whether the first leaves of a growth unit are smaller.
    pub enum RankScale {
        /// All leaves alike.
        Off = "off",
        /// Area times rank / 8 for the first eight (MAppleT 2012).
        Preformed = "preformed",
        /// Area from 10 to 30 cm² over the first eight (MAppleT 2007), whatever the blade's own size.
        Linear = "linear",
    }
}

choices! {
    /// How long leaves stay.
    pub enum LeafLifetime {
        /// Every metamer of every season keeps its leaf.
        EveryYear = "every_year",
        /// Only metamers of the last season have leaves.
        CurrentSeason = "current_season",
    }
}

choices! {
    /// Half-lines that shade is counted on: bearing every 45°, elevation every 15°.
    pub enum RaySet {
        /// The 90 distinct directions of the whole sphere.
        Distinct90 = "distinct90",
        /// Both loops with both ends: 9 × 13, doubles counted.
        Literal117 = "literal117",
        /// Bearings distinct, 8 × 13: each pole eight times.
        Literal104 = "literal104",
        /// The 49 distinct directions at or above the horizon.
        Upper49 = "upper49",
    }
}

choices! {
    /// Weight of a half-line.
    pub enum RayWeight {
        /// All alike.
        Count = "count",
        /// By the solid angle it stands for: the cosine of the elevation, at the poles the cap.
        Cos = "cos",
    }
}

choices! {
    /// Whose leaves shade.
    pub enum ShadeScope {
        /// The tree's own.
        Tree = "tree",
        /// Those of all trees, each once (no repetition of the row).
        Orchard = "orchard",
    }
}
