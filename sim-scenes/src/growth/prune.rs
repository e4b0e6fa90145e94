//! The envelope prune: what a hedger and a tidy grower would cut.

use glam::DVec3;

use super::foliage::Blade;
use super::parameters::TreeParameters;
use super::skeleton::GrowthUnit;

/// A length below which a stump is not worth a cylinder, metres.
const SHORTEST_STUMP_M: f64 = 1e-6;

/// The room a pruned tree keeps to, in tree coordinates: |x| up to the half width, z between clear trunk and top.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Envelope {
    half_width_m: f64,
    bottom_m: f64,
    top_m: f64,
}

impl Envelope {
    /// The envelope of a tree; None where it is not pruned.
    pub(crate) fn of(parameters: &TreeParameters) -> Option<Self> {
        parameters.pruned.then_some(Self {
            half_width_m: parameters.envelope_half_width_m,
            bottom_m: parameters.clear_trunk_m,
            top_m: parameters.envelope_top_m,
        })
    }

    fn contains(&self, [x, _, z]: [f64; 3]) -> bool {
        x.abs() <= self.half_width_m && (self.bottom_m..=self.top_m).contains(&z)
    }

    /// How far one can go from `base` in `direction` before leaving; the bottom does not bound the trunk.
    fn reach_m(&self, base: DVec3, direction: DVec3, is_trunk: bool) -> f64 {
        let bottom_m = if is_trunk { f64::NEG_INFINITY } else { self.bottom_m };
        let slabs = [
            (base.x, direction.x, -self.half_width_m, self.half_width_m),
            (base.z, direction.z, bottom_m, self.top_m),
        ];
        slabs.iter().fold(f64::INFINITY, |reach, &(from, along, low, high)| {
            let here = if !(low..=high).contains(&from) {
                0.0
            } else if along > 0.0 {
                (high - from) / along
            } else if along < 0.0 {
                (low - from) / along
            } else {
                f64::INFINITY
            };
            reach.min(here)
        })
    }
}

/// Length (metres) of every growth unit that is left. A branch is cut where it leaves the envelope, and all that stands
/// beyond the cut falls with it, so that nothing floats.
pub(crate) fn kept_lengths(
    units: &[GrowthUnit],
    envelope: Option<Envelope>,
    parameters: &TreeParameters,
) -> Vec<f64> {
    let mut kept: Vec<f64> = Vec::with_capacity(units.len());
    for unit in units {
        let whole = f64::from(unit.internodes) * parameters.internode_m;
        let stands = unit.bearer.is_none_or(|bearer| {
            let at = f64::from(unit.bearer_node) * parameters.internode_m;
            kept.get(bearer).is_some_and(|kept| at <= *kept)
        });
        let length = match envelope {
            None => whole,
            Some(_) if !stands => 0.0,
            Some(envelope) => whole.min(envelope.reach_m(unit.base, unit.direction, unit.order == 0)),
        };
        kept.push(if length < SHORTEST_STUMP_M { 0.0 } else { length });
    }
    kept
}

/// Whether a leaf is left: its metamer is, and no vertex of it lies outside.
pub(crate) fn keeps_leaf(
    blade: &Blade,
    kept_m: &[f64],
    envelope: Option<Envelope>,
    internode_m: f64,
) -> bool {
    let Some(envelope) = envelope else { return true };
    let node_m = f64::from(blade.node) * internode_m;
    kept_m.get(blade.unit).is_some_and(|kept| node_m <= *kept)
        && blade.leaf.outline().iter().all(|vertex| envelope.contains(*vertex))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::growth::grow_lone_tree;
    use crate::orchard::Preset;

    #[test]
    fn nothing_but_the_trunk_leaves_the_envelope() {
        let parameters = TreeParameters { iterations: 9, ..Preset::Spindle.tree() };
        let mut cut = 0;
        for seed in 1..=6 {
            let tree = grow_lone_tree(&parameters, seed);
            let whole = grow_lone_tree(&TreeParameters { pruned: false, ..parameters.clone() }, seed);
            cut += whole.leaves.len() - tree.leaves.len();
            let inside =
                |[x, _, z]: [f64; 3]| x.abs() <= 1.1 + 1e-9 && (0.5 - 1e-9..=3.6 + 1e-9).contains(&z);
            assert!(tree.leaves.iter().flat_map(|leaf| leaf.outline()).all(|v| inside(*v)));
            // The trunk rises from the ground; all other wood lies within.
            assert_eq!(tree.wood[0].base(), [0.0; 3]);
            assert!(tree.wood[1..].iter().all(|piece| inside(piece.base()) && inside(piece.tip())));
            assert!(whole.leaves.len() >= tree.leaves.len() && whole.wood.len() >= tree.wood.len());
        }
        assert!(cut > 100, "the shears did something: {cut}");
    }

    #[test]
    fn wood_ends_at_its_crossing_and_what_it_bore_falls() {
        let envelope = Envelope { half_width_m: 1.0, bottom_m: 0.5, top_m: 3.0 };
        let unit = |bearer, node, order, base, direction| GrowthUnit {
            bearer,
            bearer_node: node,
            state: crate::growth::State::Long,
            order,
            season: 1,
            internodes: 20,
            first_node: 0,
            base,
            direction,
        };
        let parameters = TreeParameters { internode_m: 0.1, ..TreeParameters::default() };
        let units = [
            unit(None, 0, 0, DVec3::ZERO, DVec3::Z),
            unit(Some(0), 20, 1, DVec3::new(0.0, 0.0, 2.0), DVec3::X),
            unit(Some(1), 10, 2, DVec3::new(1.0, 0.0, 2.0), DVec3::NEG_X),
            unit(Some(1), 11, 2, DVec3::new(1.1, 0.0, 2.0), DVec3::NEG_X),
            unit(Some(0), 2, 1, DVec3::new(0.0, 0.0, 0.2), DVec3::X),
            unit(Some(0), 19, 1, DVec3::new(0.0, 0.0, 1.9), DVec3::Y),
        ];
        let kept = kept_lengths(&units, Some(envelope), &parameters);
        // Trunk whole; branch to x = 1; its last living node bears; one node on does not; below the clear height nothing; along
        // the row nothing is cut.
        assert_eq!(kept, [2.0, 1.0, 2.0, 0.0, 0.0, 2.0]);
        assert!(kept_lengths(&units, None, &parameters).iter().all(|length| *length == 2.0));
    }
}
