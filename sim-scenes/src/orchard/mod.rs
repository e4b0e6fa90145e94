//! The orchard: rows of trees that repeat for ever along Y.

pub mod parameters;

pub use parameters::{Layout, OrchardParameters, Preset};

use crate::growth::{self, GrowError};
use crate::organ::{Cylinder, Leaf, Tree};
use crate::truth::{Truth, TruthGrid};

/// A grown (or handmade) orchard. Trees are numbered row by row: tree `i` of row `r` is number `r · trees per row + i`.
///
/// Row `r` stands at X = r · row spacing; tree `i` of a row stands at y = (i + ½) · spacing and owns the ground y ∈
/// [i, i + 1) · spacing. Every row repeats for ever with period [`Orchard::length_m`].
#[derive(Clone, Debug, PartialEq)]
pub struct Orchard {
    trees: Vec<Tree>,
    trees_per_row: usize,
    length_m: f64,
    seed: Option<u64>,
    tree_spacing_m: Option<f64>,
    row_spacing_m: Option<f64>,
}

impl Orchard {
    /// Grows an orchard, one tree a task of the current rayon pool; the result is the same on any number of threads.
    ///
    /// `progress(done, of)` is called after every tree, from the thread that grew it.
    ///
    /// # Errors
    /// A parameter without meaning, or a tree that explodes ([`GrowError`]).
    pub fn grow(
        parameters: &OrchardParameters,
        seed: u64,
        progress: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<Self, GrowError> {
        parameters.validate()?;
        let layout = parameters.layout();
        let trees_per_row = layout.trees as usize;
        let planting: Vec<growth::Planting> = (0..layout.rows)
            .flat_map(|row| (0..layout.trees).map(move |place| (row, place)))
            .map(|(row, place)| growth::Planting {
                row,
                tree: parameters.order.get(place as usize).copied().unwrap_or(place),
                gap: parameters.missing.contains(&place),
                base: [
                    f64::from(row) * layout.row_spacing_m,
                    (f64::from(place) + 0.5) * layout.tree_spacing_m,
                    0.0,
                ],
            })
            .collect();
        let trees = growth::grow_all(&parameters.tree_parameters(), seed, &planting, progress)?;
        Ok(Self {
            trees,
            trees_per_row,
            length_m: f64::from(layout.trees) * layout.tree_spacing_m,
            seed: Some(seed),
            tree_spacing_m: Some(layout.tree_spacing_m),
            row_spacing_m: Some(layout.row_spacing_m),
        })
    }

    /// One tree made by hand of leaves and wood in the scene frame; the scene repeats every `length_m` along Y, or not at
    /// all where that is infinite. Spacings are unknown, so the leaf area index is too.
    pub fn from_organs(leaves: Vec<Leaf>, wood: Vec<Cylinder>, length_m: f64) -> Self {
        Self::from_trees(vec![Tree { leaves, wood }], length_m, None, None)
    }

    /// One row of trees made by hand, in the scene frame. A length that is not positive counts as infinite: no repetition.
    pub fn from_trees(
        trees: Vec<Tree>,
        length_m: f64,
        tree_spacing_m: Option<f64>,
        row_spacing_m: Option<f64>,
    ) -> Self {
        let length_m = if length_m > 0.0 { length_m } else { f64::INFINITY };
        Self { trees_per_row: trees.len(), trees, length_m, seed: None, tree_spacing_m, row_spacing_m }
    }

    /// All trees, row by row, gaps as trees without organs; in the scene frame.
    pub fn trees(&self) -> &[Tree] {
        &self.trees
    }

    /// Trees (and gaps) in a row.
    pub fn trees_per_row(&self) -> usize {
        self.trees_per_row
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.trees.len().checked_div(self.trees_per_row).unwrap_or(0)
    }

    /// The period of the rows along Y, metres; infinite for a scene that does not repeat.
    pub fn length_m(&self) -> f64 {
        self.length_m
    }

    /// Seed it was grown from; None for a handmade orchard.
    pub fn seed(&self) -> Option<u64> {
        self.seed
    }

    /// Distance between trees in a row, metres, where known.
    pub fn tree_spacing_m(&self) -> Option<f64> {
        self.tree_spacing_m
    }

    /// Distance between rows, metres, where known.
    pub fn row_spacing_m(&self) -> Option<f64> {
        self.row_spacing_m
    }

    /// What is there: the exact areas of the first row, by tree, slab and height band of the default grid.
    pub fn truth(&self) -> Truth {
        self.truth_of_row(0, TruthGrid::default())
    }

    /// The exact areas of one row (an empty row where there is no such row).
    pub fn truth_of_row(&self, row: usize, grid: TruthGrid) -> Truth {
        let from = row.saturating_mul(self.trees_per_row).min(self.trees.len());
        let to = from.saturating_add(self.trees_per_row).min(self.trees.len());
        Truth::of_row(self, self.trees.get(from..to).unwrap_or(&[]), grid)
    }
}
