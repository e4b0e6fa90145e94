//! The generator of hidden Markov trees: growth, wood, leaves and fruit in turn.

use super::parameters::TreeParameters;
use super::skeleton::Grower;
use super::{foliage, fruit, wood};
use crate::generator::draft::{Age, Draft, Segment};
use crate::generator::error::GrowError;
use crate::generator::planting::{Generator, Planting};
use crate::generator::remark::Remark;
use crate::parameters::ParameterError;
use crate::seed::Purpose;

/// Hidden Markov trees.
pub(crate) struct Hmt {
    grower: Grower,
    seed: u64,
}

impl Hmt {
    pub(crate) fn new(parameters: TreeParameters, seed: u64) -> Result<Self, ParameterError> {
        Ok(Self { grower: Grower::new(parameters)?, seed })
    }
}

impl Generator for Hmt {
    fn draft(&self, &Planting { row, tree, .. }: &Planting) -> Result<Draft, GrowError> {
        let parameters = self.grower.parameters();
        let mut stream = Purpose::Growth.stream(self.seed, row, tree);
        let units = self.grower.grow(&mut stream).map_err(|exploded| GrowError::Exploded {
            row,
            tree,
            season: exploded.season,
            limit: parameters.max_metamers,
        })?;
        let radii = wood::radii(&units, parameters);
        let mut stream = Purpose::Foliage.stream(self.seed, row, tree);
        let blades = foliage::grow_blades(&units, &radii, parameters, &mut stream);
        let segments = units.iter().zip(radii).map(|(unit, radius_m)| Segment {
            bearer: unit.bearer,
            bearer_m: f64::from(unit.bearer_node) * parameters.internode_m,
            base: unit.base,
            direction: unit.direction,
            length_m: f64::from(unit.internodes) * parameters.internode_m,
            radius_m,
            is_trunk: unit.order == 0,
            age: if unit.season == parameters.iterations { Age::Current } else { Age::Older },
        });
        let fruits = fruit::hang(&units, parameters);
        Ok(Draft { segments: segments.collect(), blades, fruits, ..Draft::default() })
    }

    fn is_pruned(&self) -> bool {
        true
    }

    fn remarks(&self) -> Vec<Remark> {
        let rows = self.grower.parameters().renormalised_rows();
        rows.into_iter().map(|(key, row, sum)| Remark::Renormalised { key, row, sum }).collect()
    }
}
