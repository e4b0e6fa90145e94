//! The orchard: rows of trees that repeat for ever along Y.

pub mod parameters;

pub use parameters::{Layout, OrchardParameters, Preset};

use std::borrow::Cow;

use crate::generator::plant::{Planted, plant};
use crate::generator::{GrowError, Planting, Remark};
use crate::organ::{Cylinder, Leaf, Tree};
use crate::placement::Placement;
use crate::seed::Purpose;
use crate::support::Support;
use crate::target::Adjustment;
use crate::truth::{Truth, TruthGrid};

/// A grown (or handmade) orchard. Trees are numbered row by row: tree `i` of row `r` is number `r · trees per row + i`.
///
/// Row `r` stands at X = r · row spacing; tree `i` of a row stands at y = (i + ½) · spacing and owns the ground y ∈
/// [i, i + 1) · spacing. Every row repeats for ever with period [`Orchard::length_m`].
///
/// A large orchard is made of few distinct trees ([`Layout::distinct_trees`]): each place then names one of them and how it
/// is turned, and memory grows with the distinct trees only.
#[derive(Clone, Debug, PartialEq)]
pub struct Orchard {
    distinct: Vec<Tree>,
    /// Which of them stands where.
    places: Vec<(usize, Placement)>,
    supports: Vec<Support>,
    trees_per_row: usize,
    length_m: f64,
    seed: Option<u64>,
    tree_spacing_m: Option<f64>,
    row_spacing_m: Option<f64>,
    adjustment: Option<Adjustment>,
    remarks: Vec<Remark>,
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
        let stands: Vec<Planting> = (0..layout.rows)
            .flat_map(|row| (0..layout.trees).map(move |place| (row, place)))
            .map(|(row, place)| Planting {
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
        let (plantings, places) = match layout.distinct_trees {
            0 => {
                let places = (0..stands.len()).map(|number| (number, Placement::HERE)).collect();
                (stands, places)
            }
            distinct => few(distinct, layout.directions, seed, &stands),
        };
        let mut copies = vec![0usize; plantings.len()];
        for (tree, _) in &places {
            copies[*tree] += 1;
        }
        let Planted { trees, supports, adjustment, remarks } =
            plant(parameters, seed, &plantings, &copies, progress)?;
        let trellis = parameters.trellis_parameters().build(&layout);
        Ok(Self {
            distinct: trees,
            places,
            supports: supports.into_iter().chain(trellis).collect(),
            trees_per_row: layout.trees as usize,
            length_m: f64::from(layout.trees) * layout.tree_spacing_m,
            seed: Some(seed),
            tree_spacing_m: Some(layout.tree_spacing_m),
            row_spacing_m: Some(layout.row_spacing_m),
            adjustment,
            remarks,
        })
    }

    /// One tree made by hand of leaves and wood in the scene frame; the scene repeats every `length_m` along Y, or not at
    /// all where that is infinite. Spacings are unknown, so the leaf area index is too.
    pub fn from_organs(leaves: Vec<Leaf>, wood: Vec<Cylinder>, length_m: f64) -> Self {
        Self::from_trees(vec![Tree { leaves, wood, facets: Vec::new() }], length_m, None, None)
    }

    /// One row of trees made by hand, in the scene frame. A length that is not positive counts as infinite: no repetition.
    pub fn from_trees(
        trees: Vec<Tree>,
        length_m: f64,
        tree_spacing_m: Option<f64>,
        row_spacing_m: Option<f64>,
    ) -> Self {
        let places = (0..trees.len()).map(|number| (number, Placement::HERE)).collect();
        Self::from_placed(trees, places, length_m, tree_spacing_m, row_spacing_m)
    }

    /// One row of copies of a few trees, as `places` says: number of the tree, and how it stands. A place without such a tree is a gap.
    pub fn from_placed(
        trees: Vec<Tree>,
        places: Vec<(usize, Placement)>,
        length_m: f64,
        tree_spacing_m: Option<f64>,
        row_spacing_m: Option<f64>,
    ) -> Self {
        Self {
            trees_per_row: places.len(),
            distinct: trees,
            places,
            supports: Vec::new(),
            length_m: if length_m > 0.0 { length_m } else { f64::INFINITY },
            seed: None,
            tree_spacing_m,
            row_spacing_m,
            adjustment: None,
            remarks: Vec::new(),
        }
    }

    /// The same orchard with posts and wires.
    #[must_use]
    pub fn with_supports(self, supports: Vec<Support>) -> Self {
        Self { supports, ..self }
    }

    /// All trees as they stand in the scene frame, row by row, gaps as trees without organs. A copy that was moved or turned is made as
    /// it is asked for.
    pub fn trees(&self) -> impl ExactSizeIterator<Item = Cow<'_, Tree>> + Clone {
        self.places.iter().map(|(tree, placement)| match self.distinct.get(*tree) {
            Some(tree) if placement.is_here() => Cow::Borrowed(tree),
            Some(tree) => Cow::Owned(tree.placed(placement)),
            None => Cow::Owned(Tree::default()),
        })
    }

    /// One tree as it stands in the scene frame.
    pub fn tree(&self, number: usize) -> Option<Cow<'_, Tree>> {
        self.trees().nth(number)
    }

    /// The trees that differ; where each of them stands, [`Self::standing`] says.
    pub fn distinct_trees(&self) -> &[Tree] {
        &self.distinct
    }

    /// Which distinct tree stands at each place, and how; row by row.
    pub fn standing(&self) -> impl ExactSizeIterator<Item = (usize, &Placement)> + Clone {
        self.places.iter().map(|(tree, placement)| (*tree, placement))
    }

    /// Sum over all places of a count of each place's tree, such as its leaves.
    pub fn count(&self, of: impl Fn(&Tree) -> usize) -> usize {
        let each: Vec<usize> = self.distinct.iter().map(of).collect();
        self.places.iter().filter_map(|(tree, _)| each.get(*tree)).sum()
    }

    /// Posts and wires of all rows, which repeat with them.
    pub fn supports(&self) -> &[Support] {
        &self.supports
    }

    /// Posts and wires of one row: those nearer to its axis than to another's, with their numbers.
    pub fn supports_of_row(&self, row: usize) -> impl Iterator<Item = (usize, &Support)> {
        let spacing_m = self.row_spacing_m;
        let last = self.rows().saturating_sub(1) as f64;
        self.supports.iter().enumerate().filter(move |(_, support)| {
            let at = spacing_m.map_or(0.0, |spacing_m| (support.shape.base()[0] / spacing_m).round());
            at.clamp(0.0, last) == row as f64
        })
    }

    /// What was done to reach a leaf area that was asked for; None where none was.
    pub fn adjustment(&self) -> Option<&Adjustment> {
        self.adjustment.as_ref()
    }

    /// What was done to the input, for the user to know.
    pub fn remarks(&self) -> &[Remark] {
        &self.remarks
    }

    /// Trees (and gaps) in a row.
    pub fn trees_per_row(&self) -> usize {
        self.trees_per_row
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.places.len().checked_div(self.trees_per_row).unwrap_or(0)
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
        let first = row.saturating_mul(self.trees_per_row);
        let trees: Vec<Cow<'_, Tree>> = self.trees().skip(first).take(self.trees_per_row).collect();
        Truth::of_row(self, &trees, row, grid)
    }
}

/// Plantings of a few distinct trees at the origin (the last one a gap), and which of them stands at each place: tree and direction
/// drawn from the place's own random stream.
fn few(
    distinct: u32,
    directions: u32,
    seed: u64,
    stands: &[Planting],
) -> (Vec<Planting>, Vec<(usize, Placement)>) {
    let at_origin = |tree, gap| Planting { row: 0, tree, gap, base: [0.0; 3] };
    let plantings = (0..distinct).map(|tree| at_origin(tree, false)).chain([at_origin(distinct, true)]);
    let places = stands.iter().map(|stand| {
        if stand.gap {
            return (distinct as usize, Placement::HERE);
        }
        let mut stream = Purpose::Placing.stream(seed, stand.row, stand.tree);
        let mut draw = |of: u32| (stream.unit() * f64::from(of)).floor();
        let (tree, direction) = (draw(distinct) as usize, draw(directions));
        (tree, Placement::at(stand.base).turned(direction * 360.0 / f64::from(directions)))
    });
    (plantings.collect(), places.collect())
}
