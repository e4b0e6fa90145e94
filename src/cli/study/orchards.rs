//! The flags of a study that grows many orchards of one scene.

use rowscan_scenes::Scene;
use rowscan_scenes::files;

use crate::cli::Failure;
use crate::cli::output::say;

/// Which scene, which seed, how many trees.
#[derive(Debug, clap::Args)]
pub(super) struct OrchardArgs {
    /// A scene file or a built-in scene: layout and tree parameters of the orchards
    #[arg(value_name = "SCENE", default_value = "paper")]
    scene: String,
    /// Seed of the study instead of the scene's; every orchard's own is hash(study, seed, number)
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Trees in a row, instead of the scene's
    #[arg(long, value_name = "N")]
    trees: Option<u32>,
    /// Keep the lateral sensor at least so far from the canopy
    #[arg(long, value_name = "METRES", default_value_t = 0.5)]
    pub(super) clearance: f64,
}

impl OrchardArgs {
    /// The scene all orchards of the study are made from.
    pub(super) fn scene(&self) -> Result<Scene, Failure> {
        let mut scene = files::load_scene(&self.scene, say)?;
        scene.seed = self.seed.unwrap_or(scene.seed);
        scene.orchard.trees = self.trees.or(scene.orchard.trees);
        Ok(scene)
    }
}
