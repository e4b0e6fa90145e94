//! What a scene file says about the orchard: a preset, its layout, and what departs from the preset.

use serde::{Deserialize, Serialize};

use crate::growth::{InternodeLaw, MatrixSource, RuleSource, TreeOverrides, TreeParameters};
use crate::parameters::{ParameterError, choices, parameters, require};

choices! {
    /// A named set of layout and tree parameters; MODEL and reasons stand in each parameter's table.
    pub enum Preset {
        /// Pruned slender trees of an intensive orchard: 12 trees at 1.5 m, rows 4 m apart, LAI about 1.3.
        Spindle = "spindle",
        /// The same, a season older and fuller: LAI about 2.4.
        Mature = "mature",
        /// The small free-growing trees of Méndez et al. (2013): 3 trees at 3 m, rows 5 m apart, not pruned.
        Paper = "paper",
    }
}

parameters! {
    /// How trees stand.
    pub struct Layout;
    /// A layout of which every value may be left to the preset.
    pub overrides LayoutOverrides;

    /// Rows of different trees, one row spacing apart, from X = 0 away from the scanner.
    rows: u32 = 1, "rows", "the scanner sees one row; a second is the background";
    /// Places for trees in a row; after them the row repeats.
    trees: u32 = 3, "trees", "three steady the regressions";
    /// Distance between trees in the row.
    tree_spacing_m: f64 = 3.0, "m", "free-standing apple 2 to 3.5 m";
    /// Distance between rows.
    row_spacing_m: f64 = 5.0, "m", "free-standing apple 4.5 to 6 m";
}

impl Preset {
    /// Its layout.
    pub fn layout(self) -> Layout {
        match self {
            Self::Paper => Layout::default(),
            Self::Spindle | Self::Mature => {
                Layout { rows: 1, trees: 12, tree_spacing_m: 1.5, row_spacing_m: 4.0 }
            }
        }
    }

    /// Its tree parameters: the table's defaults are the paper's; the others depart from them.
    pub fn tree(self) -> TreeParameters {
        match self {
            Self::Paper => TreeParameters::default(),
            Self::Spindle => TreeParameters {
                iterations: 10,
                transitions: MatrixSource::named("P_mapplet_mean"),
                rules: RuleSource::named("vase"),
                internodes: InternodeLaw::Flat20,
                trunk_floor_diameter_m: 0.06,
                pruned: true,
                ..TreeParameters::default()
            },
            Self::Mature => TreeParameters { iterations: 11, ..Self::Spindle.tree() },
        }
    }
}

/// The `[orchard]` table of a scene file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OrchardParameters {
    /// What everything else departs from.
    pub preset: Preset,
    /// Rows of different trees; the preset's where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rows: Option<u32>,
    /// Places for trees in a row; the preset's where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trees: Option<u32>,
    /// Distance between trees in the row, metres; the preset's where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tree_spacing_m: Option<f64>,
    /// Distance between rows, metres; the preset's where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub row_spacing_m: Option<f64>,
    /// Places (counted from 0) where no tree stands, in every row.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub missing: Vec<u32>,
    /// Which tree grows at which place: a permutation of 0..trees. Empty: tree `i` at place `i`. The same trees in another order
    /// tell what an estimator owes to a tree and what to its neighbours.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub order: Vec<u32>,
    /// What departs from the preset's trees.
    pub tree: TreeOverrides,
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
            missing: Vec::new(),
            order: Vec::new(),
            tree: TreeOverrides::default(),
        }
    }

    /// The layout in force.
    pub fn layout(&self) -> Layout {
        let Self { rows, trees, tree_spacing_m, row_spacing_m, .. } = *self;
        LayoutOverrides { rows, trees, tree_spacing_m, row_spacing_m }.over(self.preset.layout())
    }

    /// The tree parameters in force.
    pub fn tree_parameters(&self) -> TreeParameters {
        self.tree.over(self.preset.tree())
    }

    /// Refuses what no orchard can be grown from.
    ///
    /// # Errors
    /// The first key without meaning, with what may stand there.
    pub fn validate(&self) -> Result<(), ParameterError> {
        let layout = self.layout();
        let positive = |key, value: f64| {
            require(value.is_finite() && value > 0.0, key, "a positive number of metres", value)
        };
        require((1..=100).contains(&layout.rows), "orchard.rows", "1 to 100", layout.rows)?;
        require((1..=100_000).contains(&layout.trees), "orchard.trees", "1 to 100000", layout.trees)?;
        positive("orchard.tree_spacing_m", layout.tree_spacing_m)?;
        positive("orchard.row_spacing_m", layout.row_spacing_m)?;
        if let Some(place) = self.missing.iter().find(|place| **place >= layout.trees) {
            let expected = format!("places from 0 to {}", layout.trees - 1);
            return Err(ParameterError::new("orchard.missing", expected, place));
        }
        if !self.order.is_empty() {
            let mut sorted = self.order.clone();
            sorted.sort_unstable();
            if !sorted.iter().copied().eq(0..layout.trees) {
                let expected = format!("every number from 0 to {} once", layout.trees - 1);
                return Err(ParameterError::new("orchard.order", expected, format!("{:?}", self.order)));
            }
        }
        self.tree_parameters().validate()
    }
}
