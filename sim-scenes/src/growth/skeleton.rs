//! Growth units: which season made them, what bears them, and where they lie.

use glam::DVec3;

use super::internodes::InternodeTable;
use super::markov::{State, TransitionMatrix};
use super::parameters::TreeParameters;
use super::rotation;
use super::rules::{Attachment, AxesLimit, ChildDraw, PowerRule, RuleStep, RuleTable};
use crate::parameters::ParameterError;
use crate::seed::Stream;

/// One season's growth of one axis: a straight chain of metamers.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct GrowthUnit {
    /// The unit it stands on: the one before it on its axis, or the one it forks from. Always earlier in the list.
    pub(crate) bearer: Option<usize>,
    /// Metamers of the bearer below the point where it stands.
    pub(crate) bearer_node: u32,
    pub(crate) state: State,
    /// 0 on the trunk, one more at every fork.
    pub(crate) order: u32,
    /// Season that made it, from 1.
    pub(crate) season: u32,
    pub(crate) internodes: u32,
    /// Metamers of its axis below it; leaf azimuths go on counting.
    pub(crate) first_node: u32,
    /// Tree coordinates: foot at the origin, X across the row, Y along it, Z up.
    pub(crate) base: DVec3,
    pub(crate) direction: DVec3,
}

/// Why growth stopped short: the season in which a tree passed its bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Exploded {
    pub(crate) season: u32,
}

/// What a tree's growth needs to know, with matrices raised and rules read.
#[derive(Clone, Debug)]
pub(crate) struct Grower {
    parameters: TreeParameters,
    powers: Vec<TransitionMatrix>,
    branching_powers: Option<Vec<TransitionMatrix>>,
    rules: RuleTable,
    internodes: InternodeTable,
}

/// An axis that still grows.
#[derive(Clone, Copy, Debug)]
struct Axis {
    last: usize,
    first_state: State,
    state: State,
    order: u32,
    /// Transitions made so far.
    transitions: usize,
}

impl Grower {
    pub(crate) fn new(parameters: TreeParameters) -> Result<Self, ParameterError> {
        parameters.validate()?;
        let key = |name: &str| format!("orchard.tree.{name}");
        let seasons = parameters.iterations as usize;
        let (transitions, branching) = parameters.matrices()?;
        let internodes = parameters.internodes.table().map_err(|error| error.at(key("internodes")))?;
        Ok(Self {
            powers: transitions.powers(seasons),
            branching_powers: branching.map(|matrix| matrix.powers(seasons)),
            internodes,
            rules: parameters.rules.rules().map_err(|error| error.at(key("rules")))?,
            parameters,
        })
    }

    pub(crate) fn parameters(&self) -> &TreeParameters {
        &self.parameters
    }

    /// Grows one tree from the given stream of random numbers.
    pub(crate) fn grow(&self, stream: &mut Stream) -> Result<Vec<GrowthUnit>, Exploded> {
        let parameters = &self.parameters;
        let first = self.unit(None, 0, parameters.initial_state, 0, 1, 0, DVec3::ZERO, DVec3::Z);
        let mut metamers = first.internodes;
        let mut units = vec![first];
        let mut axes = vec![Axis {
            last: 0,
            first_state: parameters.initial_state,
            state: parameters.initial_state,
            order: 0,
            transitions: 0,
        }];
        let mut grown = Vec::new();
        for season in 2..=parameters.iterations {
            for axis in &axes {
                let before = units.len();
                self.advance(*axis, season, stream, &mut units, &mut grown);
                let added = units.get(before..).unwrap_or(&[]).iter().map(|unit| unit.internodes);
                metamers = added.fold(metamers, u32::saturating_add);
                if metamers > parameters.max_metamers {
                    return Err(Exploded { season });
                }
            }
            std::mem::swap(&mut axes, &mut grown);
            grown.clear();
        }
        Ok(units)
    }

    /// One axis, one season: appends the growth units it makes and the axes that live on.
    fn advance(
        &self,
        axis: Axis,
        season: u32,
        stream: &mut Stream,
        units: &mut Vec<GrowthUnit>,
        live: &mut Vec<Axis>,
    ) {
        let Some(last) = units.get(axis.last) else { return };
        let (base, direction, nodes, first_node) =
            (last.base, last.direction, last.internodes, last.first_node);
        let Some(child) = self.draw(&self.powers, axis, stream, |_| true) else { return };
        match self.rules.step(axis.state, child) {
            RuleStep::Succession => {
                let tip = self.node(base, direction, nodes);
                let nodes_below = first_node + nodes;
                let (order, bearer) = (axis.order, Some(axis.last));
                live.push(Axis {
                    last: units.len(),
                    state: child,
                    transitions: axis.transitions + 1,
                    ..axis
                });
                units.push(self.unit(bearer, nodes, child, order, season, nodes_below, tip, direction));
            }
            RuleStep::Branching => {
                let child = self.redraw_for_branching(axis, stream).unwrap_or(child);
                let phi0_deg = stream.unit() * 360.0;
                for j in 0..self.new_axes(axis, child, nodes, season) {
                    let child = match self.parameters.child_draw {
                        ChildDraw::Each if j > 0 => self.draw_branch(axis, stream).unwrap_or(child),
                        _ => child,
                    };
                    let azimuth_deg = phi0_deg + f64::from(j) * self.parameters.phyllotaxis_deg;
                    let node = match self.parameters.attachment {
                        Attachment::LastNodes => nodes.saturating_sub(j).max(1),
                        Attachment::Tip => nodes,
                    };
                    let start = self.node(base, direction, node);
                    let turned = rotation::fork(direction, self.parameters.branching_angle_deg, azimuth_deg);
                    let order = axis.order + 1;
                    live.push(Axis {
                        last: units.len(),
                        first_state: child,
                        state: child,
                        order,
                        transitions: 0,
                    });
                    units.push(self.unit(Some(axis.last), node, child, order, season, 0, start, turned));
                }
            }
        }
    }

    /// Draws the next state of an axis among the children that are `allowed`.
    fn draw(
        &self,
        powers: &[TransitionMatrix],
        axis: Axis,
        stream: &mut Stream,
        allowed: impl Fn(State) -> bool,
    ) -> Option<State> {
        let power = match self.parameters.power_rule {
            PowerRule::Literal | PowerRule::Marginal => powers.get(axis.transitions),
            PowerRule::Plain => powers.first(),
        }?;
        let mut row = match self.parameters.power_rule {
            PowerRule::Literal | PowerRule::Plain => power.row(axis.state),
            PowerRule::Marginal => power.row(axis.first_state),
        };
        for (weight, child) in row.iter_mut().zip(State::ALL) {
            *weight = if allowed(*child) { *weight } else { 0.0 };
        }
        State::ALL.get(stream.weighted(&row)?).copied()
    }

    /// A state for a branching axis: the law of the succession draw given that it branches, or that of the branching matrix.
    /// With equal matrices both are the same law, so a slot of its own changes nothing but what it changes.
    fn draw_branch(&self, axis: Axis, stream: &mut Stream) -> Option<State> {
        let powers = self.branching_powers.as_ref().unwrap_or(&self.powers);
        self.draw(powers, axis, stream, |child| self.rules.step(axis.state, child) == RuleStep::Branching)
    }

    /// With a branching matrix of its own the state of new axes is drawn again; None without.
    fn redraw_for_branching(&self, axis: Axis, stream: &mut Stream) -> Option<State> {
        self.branching_powers.as_ref()?;
        self.draw_branch(axis, stream)
    }

    fn new_axes(&self, axis: Axis, child: State, bearer_nodes: u32, season: u32) -> u32 {
        if axis.state == State::Short {
            return 1;
        }
        let limit = match self.parameters.axes_limit {
            AxesLimit::BearingUnit => bearer_nodes,
            AxesLimit::ChildUnit => self.internodes(child, axis.order + 1, season),
        };
        self.parameters.max_new_axes.min(limit)
    }

    fn internodes(&self, state: State, order: u32, season: u32) -> u32 {
        self.internodes.internodes(state, order, season, self.parameters.long_age_offset)
    }

    fn node(&self, base: DVec3, direction: DVec3, node: u32) -> DVec3 {
        base + direction * (f64::from(node) * self.parameters.internode_m)
    }

    #[expect(clippy::too_many_arguments, reason = "the fields of a growth unit, in order")]
    fn unit(
        &self,
        bearer: Option<usize>,
        bearer_node: u32,
        state: State,
        order: u32,
        season: u32,
        first_node: u32,
        base: DVec3,
        direction: DVec3,
    ) -> GrowthUnit {
        let internodes = self.internodes(state, order, season);
        GrowthUnit { bearer, bearer_node, state, order, season, internodes, first_node, base, direction }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seed::Purpose;

    /// A chain that always turns into `child`, so that growth has no chance in it.
    fn always(child: usize, rules: &str) -> TreeParameters {
        let row: Vec<f64> = (0..4).map(|j| f64::from(u8::from(j == child))).collect();
        TreeParameters {
            iterations: 4,
            transitions: crate::growth::MatrixSource::Inline(vec![row; 4]),
            rules: crate::growth::RuleSource::Inline(vec![rules.into(); 4]),
            internodes: crate::growth::InternodeSource::named("flat20"),
            ..TreeParameters::default()
        }
    }

    fn grow(parameters: &TreeParameters) -> Vec<GrowthUnit> {
        let mut stream = Purpose::Growth.stream(1, 0, 0);
        Grower::new(parameters.clone()).unwrap().grow(&mut stream).unwrap()
    }

    #[test]
    fn pure_succession_is_one_straight_axis() {
        let units = grow(&always(1, ">>>>"));
        assert_eq!(units.iter().map(|u| u.internodes).collect::<Vec<_>>(), [20, 8, 8, 8]);
        assert!(units.iter().all(|u| u.order == 0 && u.direction == DVec3::Z));
        let tip = units[3].base + units[3].direction * (8.0 * 0.035);
        assert!((tip - DVec3::Z * (44.0 * 0.035)).length() < 1e-12);
        assert_eq!(units[3].first_node, 36);
    }

    #[test]
    fn floral_forks_in_three_from_its_last_three_nodes() {
        let units = grow(&always(3, "++++"));
        // 1, then 3 axes of the long unit, then 3 of each floral one (three internodes each).
        assert_eq!(units.len(), 1 + 3 + 9 + 27);
        let forks = &units[1..4];
        for (j, fork) in forks.iter().enumerate() {
            assert_eq!((fork.bearer, fork.order, fork.season), (Some(0), 1, 2));
            assert!((fork.base.z - (20 - j) as f64 * 0.035).abs() < 1e-12);
            assert!((fork.direction.length() - 1.0).abs() < 1e-12);
            assert!((fork.direction.z - 35f64.to_radians().cos()).abs() < 1e-12);
        }
        let flat = |k: usize| DVec3::new(forks[k].direction.x, forks[k].direction.y, 0.0).normalize();
        assert!((flat(0).dot(flat(1)) - 144f64.to_radians().cos()).abs() < 1e-12);
        assert!((flat(0).dot(flat(2)) - 288f64.to_radians().cos()).abs() < 1e-12);
    }

    #[test]
    fn a_short_parent_starts_one_axis_only() {
        let units = grow(&always(2, "++++"));
        // The long trunk forks in three short ones; each of those goes on in one.
        assert_eq!(units.len(), 1 + 3 + 3 + 3);
    }

    #[test]
    fn explosive_growth_stops_at_its_bound() {
        let parameters = TreeParameters { iterations: 40, max_metamers: 5_000, ..always(3, "++++") };
        let mut stream = Purpose::Growth.stream(1, 0, 0);
        let result = Grower::new(parameters).unwrap().grow(&mut stream);
        // 20 + 9 (3^(s-1) - 1) / 2 metamers after season s pass 5000 in season 8.
        assert_eq!(result, Err(Exploded { season: 8 }));
    }

    #[test]
    fn the_power_rules_differ_where_they_should() {
        // A chain that swaps M and F forever: P² is the identity on both, so the three readings part at k = 2.
        let swap = vec![
            vec![0.0, 1.0, 0.0, 0.0],
            vec![0.0, 0.0, 0.0, 1.0],
            vec![0.0, 0.0, 1.0, 0.0],
            vec![0.0, 1.0, 0.0, 0.0],
        ];
        let states = |power_rule| {
            let parameters = TreeParameters {
                transitions: crate::growth::MatrixSource::Inline(swap.clone()),
                power_rule,
                ..always(1, ">>>>")
            };
            grow(&parameters).iter().map(|unit| unit.state.to_string()).collect::<String>()
        };
        assert_eq!(states(PowerRule::Plain), "LMFM");
        // Row M of P² is M, row M of P³ is F.
        assert_eq!(states(PowerRule::Literal), "LMMF");
        // Row L of P, P², P³: M, F, M.
        assert_eq!(states(PowerRule::Marginal), "LMFM");
    }
}
