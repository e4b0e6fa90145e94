//! The generators by name.

use crate::parameters::choices;

choices! {
    /// What makes the trees.
    pub enum GeneratorKind {
        /// Hidden Markov trees after Méndez et al. (2013): `[orchard.tree]`.
        Hmt = "hmt",
        /// Trees trained by growth, tie and cut of every season: `[orchard.training]`; seasons, leaf and room of `[orchard.tree]`.
        Trained = "trained",
        /// A bracketed L-system drawn by a turtle: `[orchard.lsystem]`; leaf, shade and shears of `[orchard.tree]`.
        LSystem = "lsystem",
        /// Trees from files, text or mesh: `[orchard.import]`.
        Import = "import",
        /// A scene whose answer is a formula: `[orchard.analytic]`.
        Analytic = "analytic",
    }
}
