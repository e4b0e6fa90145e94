//! An orchard as it stands: trees, where they stand, posts and wires.

use std::borrow::Cow;

use rowscan_vehicle::trajectory::Drive;

use crate::generator::foliage_shares::FoliageShares;
use crate::generator::remark::Remark;
use crate::ground::Ground;
use crate::organ::{Cylinder, Leaf, Tree};
use crate::placement::Placement;
use crate::support::Support;
use crate::target::Adjustment;

/// A grown (or handmade) orchard. Trees are numbered row by row: tree `i` of row `r` is number `r · trees per row + i`.
///
/// Row `r` stands at X = r · row spacing; tree `i` of a row stands at y = (i + ½) · spacing and owns the ground y ∈
/// [i, i + 1) · spacing. Every row repeats forever with period [`Orchard::length_m`], but where a drive has headlands: [`Orchard::beside`].
///
/// A large orchard is made of few distinct trees (`distinct_trees` of the layout): each place then names one of them and how it
/// is turned, and memory grows with the distinct trees only.
#[derive(Clone, Debug, PartialEq)]
pub struct Orchard {
    pub(super) distinct: Vec<Tree>,
    /// Which of them stands where.
    pub(super) places: Vec<(usize, Placement)>,
    pub(super) supports: Vec<Support>,
    pub(super) ground: Ground,
    pub(super) trees_per_row: usize,
    pub(super) length_m: f64,
    /// False where rows end with their last trees.
    pub(super) repeats: bool,
    pub(super) seed: Option<u64>,
    pub(super) tree_spacing_m: Option<f64>,
    pub(super) row_spacing_m: Option<f64>,
    pub(super) adjustment: Option<Adjustment>,
    pub(super) foliage: Option<FoliageShares>,
    pub(super) remarks: Vec<Remark>,
}

impl Orchard {
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
            ground: Ground::default(),
            length_m: if length_m > 0.0 { length_m } else { f64::INFINITY },
            repeats: true,
            seed: None,
            tree_spacing_m,
            row_spacing_m,
            adjustment: None,
            foliage: None,
            remarks: Vec::new(),
        }
    }

    /// The same orchard as this drive finds it: rows repeat beside one alley without end, and end where a drive turns on headlands.
    #[must_use]
    pub fn beside(self, drive: &Drive) -> Self {
        Self { repeats: !drive.has_headlands(), ..self }
    }

    /// True if this drive finds it as it is.
    pub fn is_beside(&self, drive: &Drive) -> bool {
        self.repeats != drive.has_headlands()
    }

    /// The same orchard with posts and wires.
    #[must_use]
    pub fn with_supports(self, supports: Vec<Support>) -> Self {
        Self { supports, ..self }
    }

    /// All trees as they stand in the scene frame, row by row, gaps as trees without organs. A copy that was moved or turned is made as
    /// it is asked for.
    pub fn trees(&self) -> impl ExactSizeIterator<Item = Cow<'_, Tree>> + Clone {
        self.places.iter().map(|place| self.tree_at(place))
    }

    /// Height of a row's foot in the scene frame, metres: where the soil's slope is at the row's axis. Rows are numbered as alleys count them; there may
    /// be no tree in this one.
    pub fn foot_m(&self, row: i32) -> f64 {
        // Without a spacing there is one row.
        self.ground.rise * f64::from(row) * self.row_spacing_m.unwrap_or(0.0)
    }

    /// The same of a row of trees, by its number among them.
    pub(crate) fn foot_of_trees_m(&self, row: usize) -> f64 {
        i32::try_from(row).map_or(0.0, |row| self.foot_m(row))
    }

    /// The trees of one row with heights from the row's foot, X and Y as in the scene: what tells a row's own heights looks at these.
    pub fn trees_from_foot(&self, row: usize) -> impl ExactSizeIterator<Item = Cow<'_, Tree>> + Clone {
        let foot_m = self.foot_of_trees_m(row);
        let down = Placement::at([0.0, 0.0, -foot_m]);
        self.trees_of_row(row)
            .map(move |tree| if foot_m == 0.0 { tree } else { Cow::Owned(tree.placed(&down)) })
    }

    /// The trees of one row, as [`Self::trees`] gives them; none where there is no such row.
    pub fn trees_of_row(&self, row: usize) -> impl ExactSizeIterator<Item = Cow<'_, Tree>> + Clone {
        let from = row.saturating_mul(self.trees_per_row);
        let places = self.places.get(from..from.saturating_add(self.trees_per_row)).unwrap_or_default();
        places.iter().map(|place| self.tree_at(place))
    }

    fn tree_at(&self, (tree, placement): &(usize, Placement)) -> Cow<'_, Tree> {
        match self.distinct.get(*tree) {
            Some(tree) if placement.is_here() => Cow::Borrowed(tree),
            Some(tree) => Cow::Owned(tree.placed(placement)),
            None => Cow::Owned(Tree::default()),
        }
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

    /// Soil and grass of all rows, which repeat with them, and the level plane below.
    pub fn ground(&self) -> &Ground {
        &self.ground
    }

    /// The same orchard on another ground.
    #[must_use]
    pub fn with_ground(self, ground: Ground) -> Self {
        Self { ground, ..self }
    }

    /// How the target leaf area was reached; None without a target.
    pub fn adjustment(&self) -> Option<&Adjustment> {
        self.adjustment.as_ref()
    }

    /// On what wood the leaves stand; None where that is unknown (imported, analytic, handmade trees, L-systems).
    pub fn foliage(&self) -> Option<FoliageShares> {
        self.foliage
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

    /// Length of the rows along Y, metres; infinite for one that was made by hand without a length.
    pub fn length_m(&self) -> f64 {
        self.length_m
    }

    /// After how many metres along Y all that stands repeats; infinite where it does not.
    pub fn period_m(&self) -> f64 {
        if self.repeats { self.length_m } else { f64::INFINITY }
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
}
