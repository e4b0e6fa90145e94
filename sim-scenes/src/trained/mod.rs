//! Trained trees: spindles, vases, palmettes and hedges, made as a grower makes them, by growth, tie and cut season after season.
//!
//! A tree is a set of axes (`axis`). Every season each living axis extends and last year's wood breaks into shoots and spurs
//! (`grow`); wood thickens by the pipe model (`thick`); all bends under its own load (`bend`). In winter young limbs are tied
//! and the tree is cut (`winter`). The last season is the one that is scanned: leaves stand on its shoots and on the rosettes of the
//! spurs (`organs`) and nowhere else. `seasons`, leaf, petiole, envelope and shears are those of `[orchard.tree]`; what is the
//! system's own stands in `[orchard.training]`.

mod axis;
mod bend;
mod frame;
mod grow;
mod organs;
mod parameters;
mod room;
mod thick;
mod winter;

pub use parameters::{Form, TrainingOverrides, TrainingParameters};

use crate::generator::draft::Draft;
use crate::generator::error::GrowError;
use crate::generator::planting::{Generator, Planting};
use crate::growth::TreeParameters;
use crate::seed::Purpose;
use crate::support::Trellis;
use axis::Plant;
use room::Room;

/// All that is given about the trees of an orchard.
pub(crate) struct System {
    training: TrainingParameters,
    tree: TreeParameters,
    room: Room,
    /// Heights of the wires that limbs are tied to, metres.
    wires_m: Vec<f64>,
}

/// Makes trained trees.
pub(crate) struct Trained {
    system: System,
    seed: u64,
}

impl Trained {
    /// For parameters that have been validated.
    pub(crate) fn new(
        training: TrainingParameters,
        tree: TreeParameters,
        trellis: &Trellis,
        seed: u64,
    ) -> Self {
        let room = Room::of(&training, &tree);
        let wires_m = trellis.wire_heights_m().collect();
        Self { system: System { training, tree, room, wires_m }, seed }
    }
}

impl Generator for Trained {
    fn draft(&self, &Planting { row, tree, .. }: &Planting) -> Result<Draft, GrowError> {
        let system = &self.system;
        let mut stream = Purpose::Growth.stream(self.seed, row, tree);
        let seasons = system.tree.iterations;
        let mut plant = Plant::default();
        for season in 1..=seasons {
            grow::season(&mut plant, season, system, &mut stream);
            thick::thicken(&mut plant, season, system);
            bend::sag(&mut plant, season, system);
            if season < seasons {
                winter::tie(&mut plant, season, system, &mut stream);
                winter::cut(&mut plant, season, system, &mut stream);
            }
            let metamers = plant.metamers(system.tree.internode_m);
            if metamers > f64::from(system.tree.max_metamers) {
                return Err(GrowError::Exploded { row, tree, season, limit: system.tree.max_metamers });
            }
        }
        let mut stream = Purpose::Foliage.stream(self.seed, row, tree);
        Ok(organs::grow_organs(&plant, system, &mut stream))
    }

    /// Summer shears, where `pruned` asks for them.
    fn is_pruned(&self) -> bool {
        true
    }
}
