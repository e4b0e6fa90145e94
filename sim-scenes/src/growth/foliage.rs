//! Leaves: one a metamer.

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
