//! From parameters to the generator they name.

use super::error::GrowError;
use super::kind::GeneratorKind;
use super::planting::Generator;
use crate::analytic::Analytic;
use crate::growth::hmt::Hmt;
use crate::import::Imported;
use crate::lsystem::Sprouting;
use crate::orchard::parameters::OrchardParameters;
use crate::trained::Trained;

/// The generator that the parameters name.
pub(crate) fn make(parameters: &OrchardParameters, seed: u64) -> Result<Box<dyn Generator + '_>, GrowError> {
    Ok(match parameters.generator() {
        GeneratorKind::Hmt => Box::new(Hmt::new(parameters.tree_parameters(), seed)?),
        GeneratorKind::Trained => Box::new(Trained::new(
            parameters.training_parameters(),
            parameters.tree_parameters(),
            &parameters.trellis_parameters(),
            seed,
        )),
        GeneratorKind::LSystem => {
            Box::new(Sprouting::new(&parameters.lsystem_parameters(), parameters.tree_parameters(), seed)?)
        }
        GeneratorKind::Import => Box::new(Imported::new(&parameters.import, &parameters.layout())?),
        GeneratorKind::Analytic => {
            let cell_m = parameters.layout().tree_spacing_m;
            Box::new(Analytic::new(parameters.analytic_parameters(), cell_m, seed)?)
        }
    })
}
