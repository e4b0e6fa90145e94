//! What a scene file says about the orchard: a preset, and what departs from it.

use std::fmt;

use serde::de::{Error, Unexpected, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use super::by_row::ByRow;
use super::layout::{Layout, LayoutOverrides};
use super::preset::Preset;
use crate::analytic::{AnalyticOverrides, AnalyticParameters};
use crate::generator::kind::GeneratorKind;
use crate::ground::{GroundOverrides, GroundParameters};
use crate::growth::{
    BranchingSource, InternodeSource, MatrixSource, RuleSource, TreeOverrides, TreeParameters,
};
use crate::import::{ImportParameters, Stands};
use crate::lsystem::{LSystemOverrides, LSystemParameters};
use crate::parameters::{ParameterError, SceneFile, require};
use crate::season::Season;
use crate::support::{Trellis, TrellisOverrides};
use crate::trained::{TrainingOverrides, TrainingParameters};

/// Trees that are all grown and kept: 32 GB of the built-in spindles.
const MOST_DIFFERENT: u32 = 10_000;

/// A count of which there is one at least, in the words of its complaint. The range is checked with the layout, which knows key and most.
fn one_or_more<'de, D: Deserializer<'de>>(from: D) -> Result<Option<u32>, D::Error> {
    struct OneOrMore;

    impl<'de> Visitor<'de> for OneOrMore {
        type Value = Option<u32>;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("a whole number of 1 or more")
        }

        fn visit_i64<E: Error>(self, found: i64) -> Result<Self::Value, E> {
            u32::try_from(found).map(Some).map_err(|_| E::invalid_value(Unexpected::Signed(found), &self))
        }

        fn visit_u64<E: Error>(self, found: u64) -> Result<Self::Value, E> {
            u32::try_from(found).map(Some).map_err(|_| E::invalid_value(Unexpected::Unsigned(found), &self))
        }

        fn visit_none<E: Error>(self) -> Result<Self::Value, E> {
            Ok(None)
        }

        fn visit_some<D: Deserializer<'de>>(self, from: D) -> Result<Self::Value, D::Error> {
            from.deserialize_any(self)
        }
    }

    from.deserialize_option(OneOrMore)
}

/// The `[orchard]` table of a scene file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct OrchardParameters {
    /// What everything else departs from.
    pub preset: Preset,
    /// Rows of different trees; the preset's where absent.
    #[serde(skip_serializing_if = "Option::is_none", deserialize_with = "one_or_more")]
    pub rows: Option<u32>,
    /// Places for trees in a row; the preset's where absent.
    #[serde(skip_serializing_if = "Option::is_none", deserialize_with = "one_or_more")]
    pub trees: Option<u32>,
    /// Distance between trees in the row, metres; the preset's where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tree_spacing_m: Option<f64>,
    /// Distance between rows, metres; the preset's where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub row_spacing_m: Option<f64>,
    /// Places at both ends of every row where nothing stands; the preset's where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub row_ends: Option<u32>,
    /// Places (counted from 0) where no tree stands, in every row or row by row.
    #[serde(skip_serializing_if = "ByRow::is_empty")]
    #[schemars(example = vec![3, 7])]
    pub missing: ByRow,
    /// Places where a young tree stands, of `tree.replanted_seasons`.
    #[serde(skip_serializing_if = "ByRow::is_empty")]
    #[schemars(example = vec![5])]
    pub replanted: ByRow,
    /// Which tree grows at which place: a permutation of 0..trees, for every row or row by row. Empty: tree `i` at place `i`. The same
    /// trees in another order tell what an estimator owes to a tree and what to its neighbours.
    #[serde(skip_serializing_if = "ByRow::is_empty")]
    #[schemars(example = vec![2, 0, 1])]
    pub order: ByRow,
    /// Trees that differ; the preset's where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub distinct_trees: Option<u32>,
    /// Directions that copies of distinct trees may face; the preset's where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub directions: Option<u32>,
    /// What makes the trees; the preset's where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub generator: Option<GeneratorKind>,
    /// How many leaves are out, and how large.
    pub season: Season,
    /// Leaf area index that is reached within 1 % by thinning or adding leaves; none where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = 1.8)]
    pub target_lai: Option<f64>,
    /// What departs from the preset's trees.
    pub tree: TreeOverrides,
    /// How trees are trained.
    pub training: TrainingOverrides,
    /// Trees by an L-system.
    pub lsystem: LSystemOverrides,
    /// Trees from files.
    pub import: ImportParameters,
    /// Scenes by a formula.
    pub analytic: AnalyticOverrides,
    /// What departs from the preset's posts and wires.
    pub trellis: TrellisOverrides,
    /// Soil and grass.
    #[serde(skip_serializing_if = "is_default")]
    pub ground: GroundOverrides,
}

fn is_default<T: Default + PartialEq>(table: &T) -> bool {
    *table == T::default()
}

impl Default for OrchardParameters {
    fn default() -> Self {
        Self::of(Preset::Spindle)
    }
}

impl OrchardParameters {
    /// A preset without departures.
    pub fn of(preset: Preset) -> Self {
        Self {
            preset,
            rows: None,
            trees: None,
            tree_spacing_m: None,
            row_spacing_m: None,
            row_ends: None,
            missing: ByRow::default(),
            replanted: ByRow::default(),
            order: ByRow::default(),
            distinct_trees: None,
            directions: None,
            generator: None,
            season: Season::FullLeaf,
            target_lai: None,
            tree: TreeOverrides::default(),
            training: TrainingOverrides::default(),
            lsystem: LSystemOverrides::default(),
            import: ImportParameters::default(),
            analytic: AnalyticOverrides::default(),
            trellis: TrellisOverrides::default(),
            ground: GroundOverrides::default(),
        }
    }

    /// The layout in force.
    pub fn layout(&self) -> Layout {
        let Self { rows, trees, row_ends, tree_spacing_m, row_spacing_m, distinct_trees, directions, .. } =
            *self;
        LayoutOverrides { rows, trees, row_ends, tree_spacing_m, row_spacing_m, distinct_trees, directions }
            .over(self.preset.layout())
    }

    /// What makes the trees.
    pub fn generator(&self) -> GeneratorKind {
        self.generator.unwrap_or(self.preset.generator())
    }

    /// The training in force.
    pub fn training_parameters(&self) -> TrainingParameters {
        self.training.over(self.preset.training())
    }

    /// The L-system parameters in force.
    pub fn lsystem_parameters(&self) -> LSystemParameters {
        self.lsystem.over(LSystemParameters::default())
    }

    /// The sizes of an analytic scene in force.
    pub fn analytic_parameters(&self) -> AnalyticParameters {
        self.analytic.over(AnalyticParameters::default())
    }

    /// The ground in force.
    pub fn ground_parameters(&self) -> GroundParameters {
        self.ground.over(GroundParameters::default())
    }

    /// The posts and wires in force.
    pub fn trellis_parameters(&self) -> Trellis {
        self.trellis.over(self.preset.trellis())
    }

    /// The files that it names. Their contents must be handed in before an orchard can be grown.
    pub fn files_mut(&mut self) -> Vec<&mut SceneFile> {
        let TreeOverrides { transitions, branching_transitions, rules, internodes, .. } = &mut self.tree;
        let mut files: Vec<&mut SceneFile> = Vec::new();
        files.extend(transitions.as_mut().and_then(MatrixSource::file_mut));
        files.extend(branching_transitions.as_mut().and_then(BranchingSource::file_mut));
        files.extend(rules.as_mut().and_then(RuleSource::file_mut));
        files.extend(internodes.as_mut().and_then(InternodeSource::file_mut));
        files.extend(self.lsystem.rules.as_mut().and_then(|rules| rules.file_mut()));
        files.extend(self.import.files_mut());
        files
    }

    /// The same orchard with all trees as young as replanted ones.
    pub(crate) fn of_replanted(&self) -> Self {
        let seasons = self.tree_parameters().replanted_seasons;
        let tree = TreeOverrides { iterations: Some(seasons), ..self.tree.clone() };
        Self { tree, ..self.clone() }
    }

    /// The tree parameters in force.
    pub fn tree_parameters(&self) -> TreeParameters {
        self.tree.over(self.preset.tree(self.generator()))
    }

    /// Checks all values.
    ///
    /// # Errors
    /// The first key with an invalid value, and the values allowed.
    pub fn validate(&self) -> Result<(), ParameterError> {
        let layout = self.layout();
        let positive = |key, value: f64| {
            require(value.is_finite() && value > 0.0, key, "a positive number of metres", value)
        };
        require((1..=100).contains(&layout.rows), "orchard.rows", "1 to 100", layout.rows)?;
        require((1..=100_000).contains(&layout.trees), "orchard.trees", "1 to 100000", layout.trees)?;
        positive("orchard.tree_spacing_m", layout.tree_spacing_m)?;
        positive("orchard.row_spacing_m", layout.row_spacing_m)?;
        self.missing.are_places("orchard.missing", layout.rows, layout.trees)?;
        self.replanted.are_places("orchard.replanted", layout.rows, layout.trees)?;
        let in_gap = (0..layout.rows).find_map(|row| {
            let missing = self.missing.of(row);
            self.replanted.of(row).iter().find(|place| missing.contains(place)).copied()
        });
        let expected = "places that are not in orchard.missing, where a gap stays a gap";
        require(in_gap.is_none(), "orchard.replanted", expected, in_gap.unwrap_or_default())?;
        self.order.are_orders("orchard.order", layout.rows, layout.trees)?;
        let grows = matches!(self.generator(), GeneratorKind::Hmt | GeneratorKind::Trained);
        let expected = "empty, unless trees are grown season by season (hmt, trained)";
        require(grows || self.replanted.is_empty(), "orchard.replanted", expected, self.generator())?;
        let expected = "less than half of orchard.trees";
        require(
            2 * u64::from(layout.row_ends) < u64::from(layout.trees),
            "orchard.row_ends",
            expected,
            layout.row_ends,
        )?;
        let placed = self.generator() == GeneratorKind::Import && self.import.stands == Stands::InPlace;
        let expected = "0 for trees that stand where their files say";
        require(
            !placed || layout.distinct_trees == 0,
            "orchard.distinct_trees",
            expected,
            layout.distinct_trees,
        )?;
        require(
            layout.distinct_trees <= 100_000,
            "orchard.distinct_trees",
            "0 to 100000",
            layout.distinct_trees,
        )?;
        let is_grown =
            matches!(self.generator(), GeneratorKind::Hmt | GeneratorKind::Trained | GeneratorKind::LSystem);
        let different = layout.rows.saturating_mul(layout.trees);
        require(
            !is_grown || layout.distinct_trees > 0 || different <= MOST_DIFFERENT,
            "orchard.trees",
            "at most 10000 trees that all differ, some 3 MB each; set orchard.distinct_trees for more",
            different,
        )?;
        require((1..=360).contains(&layout.directions), "orchard.directions", "1 to 360", layout.directions)?;
        if let Some(lai) = self.target_lai {
            require(lai > 0.0 && lai <= 100.0, "orchard.target_lai", "above 0, up to 100", lai)?;
        }
        self.trellis_parameters().validate()?;
        self.ground_parameters().validate(&layout)?;
        match self.generator() {
            GeneratorKind::Hmt => {}
            GeneratorKind::Trained => self.training_parameters().validate(self.trellis_parameters().wires)?,
            GeneratorKind::LSystem => self.lsystem_parameters().validate()?,
            GeneratorKind::Import => self.import.validate()?,
            GeneratorKind::Analytic => self.analytic_parameters().validate(layout.tree_spacing_m)?,
        }
        self.tree_parameters().validate()
    }
}
