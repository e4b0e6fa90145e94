//! The presets: training systems by name.

use super::layout::Layout;
use crate::generator::kind::GeneratorKind;
use crate::growth::{InternodeSource, LeafLifetime, MatrixSource, RuleSource, TreeParameters};
use crate::parameters::choices;
use crate::support::Trellis;
use crate::trained::{Form, TrainingParameters};

choices! {
    /// A named set of layout, training and tree parameters; their reasons stand in each parameter's table.
    pub enum Preset {
        /// Slender spindles of an intensive orchard: a leader and a cone of fruiting branches; 12 trees at 1.5 m, rows 4 m apart.
        Spindle = "spindle",
        /// Tall spindles: higher, narrower, branches tied below the horizontal: 12 trees at 1 m, rows 3.5 m apart.
        TallSpindle = "tall_spindle",
        /// Spindles some seasons older, wider and denser.
        Mature = "mature",
        /// The small free-growing trees of Méndez et al. (2013): 3 trees at 3 m, rows 5 m apart, not pruned.
        Paper = "paper",
        /// Open vases: free-standing crowns on scaffold branches, the middle kept open: 6 trees at 4 m, rows 5 m apart.
        Vase = "vase",
        /// A fruiting wall: palmettes tied to wires and sheared: 12 trees at 1 m, rows 3.5 m apart.
        FruitingWall = "fruiting_wall",
        /// A hedge: low, dense, sheared flat: 12 trees at 0.8 m, rows 3 m apart.
        Hedge = "hedge",
    }
}

impl Preset {
    /// Its layout.
    pub fn layout(self) -> Layout {
        let row = |trees, tree_spacing_m, row_spacing_m| Layout {
            trees,
            tree_spacing_m,
            row_spacing_m,
            ..Layout::default()
        };
        match self {
            Self::Paper => Layout::default(),
            Self::Spindle | Self::Mature => row(12, 1.5, 4.0),
            Self::Vase => row(6, 4.0, 5.0),
            Self::TallSpindle | Self::FruitingWall => row(12, 1.0, 3.5),
            Self::Hedge => row(12, 0.8, 3.0),
        }
    }

    /// What makes its trees.
    pub fn generator(self) -> GeneratorKind {
        match self {
            Self::Paper => GeneratorKind::Hmt,
            _ => GeneratorKind::Trained,
        }
    }

    /// Its tree parameters for a generator: the table's defaults are the paper's; the others depart from them.
    pub fn tree(self, generator: GeneratorKind) -> TreeParameters {
        match (self, generator) {
            (Self::Paper, _) => TreeParameters::default(),
            (_, GeneratorKind::Trained) => self.trained_tree(),
            _ => self.cut_tree(),
        }
    }

    /// Seasons, leaves and the room of a trained tree.
    fn trained_tree(self) -> TreeParameters {
        let spindle = trained_spindle();
        match self {
            Self::Spindle | Self::Paper => spindle,
            Self::TallSpindle => TreeParameters {
                iterations: 8,
                envelope_half_width_m: 0.65,
                envelope_top_half_width_m: 0.3,
                envelope_half_length_m: 0.6,
                envelope_top_m: 3.3,
                ..spindle
            },
            Self::Mature => TreeParameters {
                iterations: 12,
                trunk_floor_diameter_m: 0.08,
                envelope_half_width_m: 1.2,
                envelope_top_half_width_m: 0.4,
                envelope_half_length_m: 1.0,
                envelope_top_m: 3.4,
                ..spindle
            },
            Self::Vase => TreeParameters {
                iterations: 10,
                trunk_floor_diameter_m: 0.12,
                envelope_half_width_m: 1.5,
                envelope_top_half_width_m: 1.9,
                envelope_half_length_m: 1.5,
                envelope_top_m: 3.5,
                hollow_deg: 26.0,
                hollow_from_m: 0.9,
                ..spindle
            },
            Self::FruitingWall => TreeParameters {
                iterations: 9,
                pruned: true,
                envelope_half_width_m: 0.5,
                envelope_top_half_width_m: 0.3,
                envelope_half_length_m: 0.6,
                clear_trunk_m: 0.5,
                ..spindle
            },
            Self::Hedge => TreeParameters {
                iterations: 8,
                pruned: true,
                envelope_half_width_m: 0.6,
                envelope_top_half_width_m: 0.5,
                envelope_half_length_m: 0.55,
                clear_trunk_m: 0.35,
                envelope_top_m: 2.2,
                ..spindle
            },
        }
    }

    /// Hidden Markov trees cut to the outline of the preset: what other generators grow in its place.
    fn cut_tree(self) -> TreeParameters {
        let spindle = TreeParameters {
            iterations: 10,
            transitions: MatrixSource::named("P_mapplet_mean"),
            rules: RuleSource::named("vase"),
            internodes: InternodeSource::named("flat20"),
            leaf_lifetime: LeafLifetime::CurrentSeason,
            trunk_floor_diameter_m: 0.06,
            pruned: true,
            ..TreeParameters::default()
        };
        match self {
            Self::Spindle | Self::TallSpindle | Self::Paper => spindle,
            Self::Mature => TreeParameters { iterations: 11, ..spindle },
            Self::Vase => TreeParameters {
                iterations: 12,
                trunk_floor_diameter_m: 0.12,
                envelope_half_width_m: 1.8,
                envelope_half_length_m: 1.8,
                clear_trunk_m: 0.6,
                envelope_top_m: 3.2,
                hollow_deg: 20.0,
                hollow_from_m: 0.9,
                ..spindle
            },
            Self::FruitingWall => TreeParameters {
                iterations: 11,
                envelope_half_width_m: 0.45,
                envelope_top_half_width_m: 0.25,
                clear_trunk_m: 0.5,
                envelope_top_m: 3.0,
                ..spindle
            },
            Self::Hedge => TreeParameters {
                envelope_half_width_m: 0.6,
                clear_trunk_m: 0.3,
                envelope_top_m: 2.2,
                ..spindle
            },
        }
    }

    /// How its trees are trained.
    pub fn training(self) -> TrainingParameters {
        let spindle = TrainingParameters::default();
        match self {
            Self::Spindle | Self::Paper => spindle,
            Self::TallSpindle => {
                TrainingParameters { lateral_shoot_m: 0.36, tie_deg: 105.0, renewal_seasons: 5, ..spindle }
            }
            Self::Mature => {
                TrainingParameters { laterals: 6.5, side_shoots: 3.0, renewal_seasons: 7, ..spindle }
            }
            Self::Vase => TrainingParameters {
                form: Form::Vase,
                whip_m: 0.75,
                laterals: 4.5,
                lateral_shoot_m: 0.5,
                tie_deg: 0.0,
                side_shoots: 2.3,
                winter_share: 0.95,
                spurs_per_m: 8.5,
                ..spindle
            },
            Self::FruitingWall => TrainingParameters {
                form: Form::Palmette,
                laterals: 2.5,
                lateral_shoot_m: 0.32,
                side_shoots: 2.4,
                winter_share: 0.8,
                cut_unevenness: 0.1,
                spurs_per_m: 6.0,
                ..spindle
            },
            Self::Hedge => TrainingParameters {
                form: Form::Hedge,
                whip_m: 0.7,
                laterals: 7.0,
                lateral_shoot_m: 0.37,
                tie_deg: 0.0,
                side_shoots: 2.2,
                renewal_seasons: 5,
                winter_share: 0.8,
                cut_unevenness: 0.1,
                spurs_per_m: 6.5,
                ..spindle
            },
        }
    }

    /// Its posts and wires.
    pub fn trellis(self) -> Trellis {
        match self {
            Self::FruitingWall => Trellis { post_every: 6, wires: 5, wire_step_m: 0.5, ..Trellis::default() },
            _ => Trellis::default(),
        }
    }
}

/// Seasons, leaves and the room of a spindle, from which the other systems depart.
fn trained_spindle() -> TreeParameters {
    TreeParameters {
        iterations: 7,
        leaf_lifetime: LeafLifetime::CurrentSeason,
        internode_m: 0.023,
        trunk_floor_diameter_m: 0.06,
        envelope_half_width_m: 1.05,
        envelope_top_half_width_m: 0.35,
        envelope_half_length_m: 0.85,
        clear_trunk_m: 0.6,
        envelope_top_m: 3.0,
        ..TreeParameters::default()
    }
}
