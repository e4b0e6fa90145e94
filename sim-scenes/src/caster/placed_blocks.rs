//! Where blocks stand: rows of trees where they were made, and copies of distinct trees. Which of them a line may meet, and which are
//! hidden behind nearer ones.

use super::block::Block;
use super::rectangle::Rectangle;
use super::row_index::{RowIndex, YExtent};
use super::sight::Part;
use crate::lanes::WIDTH;
use crate::orchard::Orchard;
use crate::organ::Tree;
use crate::placement::Placement;

/// The box about a block, metres, from the foot of its tree.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    low: [f64; 3],
    high: [f64; 3],
}

impl Bounds {
    const NOTHING: Self = Self { low: [f64::INFINITY; 3], high: [f64::NEG_INFINITY; 3] };

    fn of(tree: &Tree) -> Self {
        let mut bounds = Self::NOTHING;
        let facets = tree.facets.iter().map(|facet| &facet.polygon);
        for vertex in tree.leaves.iter().chain(facets).flat_map(|leaf| leaf.outline()) {
            bounds.add(*vertex, 0.0);
        }
        for piece in &tree.wood {
            bounds.add(piece.base(), piece.radius_m());
            bounds.add(piece.tip(), piece.radius_m());
        }
        bounds
    }

    fn and(self, other: Self) -> Self {
        let least = |axis: usize| self.low[axis].min(other.low[axis]);
        let most = |axis: usize| self.high[axis].max(other.high[axis]);
        Self { low: std::array::from_fn(least), high: std::array::from_fn(most) }
    }

    /// What the box takes up in the scan plane.
    fn seen_from(&self, [x, _, z]: [f64; 3]) -> Rectangle {
        Rectangle {
            low: [self.low[0] - x - SPARE_M, self.low[2] - z - SPARE_M],
            high: [self.high[0] - x + SPARE_M, self.high[2] - z + SPARE_M],
        }
    }

    fn add(&mut self, point: [f64; 3], margin_m: f64) {
        for ((low, high), c) in self.low.iter_mut().zip(&mut self.high).zip(point) {
            *low = low.min(c - margin_m);
            *high = high.max(c + margin_m);
        }
    }
}

/// The trees that stand where they were made, by number, in rows that no plane X = const separates: what one scanner sees as one.
fn rows(orchard: &Orchard) -> Vec<Vec<(u32, &Tree, Bounds)>> {
    let trees = (0..).zip(orchard.standing()).filter_map(|(number, (tree, placement))| {
        let tree = orchard.distinct_trees().get(tree).filter(|_| placement.is_here())?;
        // A tree without organs reaches nowhere.
        Some((number, tree, Bounds::of(tree))).filter(|(.., bounds)| bounds.low[0] <= bounds.high[0])
    });
    let mut trees: Vec<(u32, &Tree, Bounds)> = trees.collect();
    trees.sort_by(|a, b| a.2.low[0].total_cmp(&b.2.low[0]));
    let (mut rows, mut reach_m) = (Vec::<Vec<_>>::new(), f64::NEG_INFINITY);
    for tree in trees {
        match rows.last_mut().filter(|_| tree.2.low[0] <= reach_m) {
            Some(row) => row.push(tree),
            None => rows.push(vec![tree]),
        }
        reach_m = reach_m.max(tree.2.high[0]);
    }
    rows
}

/// A copy that stands somewhere.
#[derive(Clone, Copy, Debug)]
struct Copy {
    block: usize,
    /// Number of the tree in the orchard.
    tree: u32,
    base_m: [f64; 3],
}

/// All trees of an orchard: rows of those that stand where they were made, and copies, sorted along the row.
#[derive(Clone, Debug, Default)]
pub(super) struct PlacedBlocks {
    /// Rows from one end of the period to the other, then distinct trees as they are turned.
    blocks: Vec<Block>,
    bounds: Vec<Bounds>,
    /// How many of the blocks are rows.
    rows: usize,
    index: RowIndex,
    /// Entry by entry of the index, images over the border of the period included; None fills up a row.
    copies: Vec<Option<Copy>>,
}

/// A copy as a part of a line sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    /// Its block.
    pub(super) block: usize,
    /// The number of its tree, if it is a copy.
    pub(super) tree: Option<u32>,
    /// The line's part as seen from the block.
    pub(super) part: Part,
    /// The rectangle in (X, Z), from the line's origin, that holds it.
    pub(super) window: Rectangle,
    /// The same for it and all views behind it.
    pub(super) beyond: Rectangle,
}

/// How far a window is widened, metres: far above rounding.
const SPARE_M: f64 = 1e-6;

impl PlacedBlocks {
    pub(super) fn new(orchard: &Orchard) -> Self {
        let mut standing = Self::default();
        for row in rows(orchard) {
            let bounds = row.iter().fold(Bounds::NOTHING, |all, (.., bounds)| all.and(*bounds));
            standing.bounds.push(bounds);
            let trees = row.iter().map(|(number, tree, _)| (*number, *tree));
            standing.blocks.push(Block::new(trees, &[], &[], orchard.period_m()));
        }
        standing.rows = standing.blocks.len();
        // A distinct tree in one direction is one block, whatever the number of its places.
        let mut known: Vec<(usize, u64, usize)> = Vec::new();
        let mut copies = Vec::new();
        for (tree, (distinct, placement)) in (0..).zip(orchard.standing()) {
            let Some(organs) = orchard.distinct_trees().get(distinct).filter(|_| !placement.is_here()) else {
                continue;
            };
            let turn = placement.turn_deg().to_bits();
            let made = known.iter().find(|(of, turned, _)| (*of, *turned) == (distinct, turn));
            let block = match made {
                Some((.., block)) => *block,
                None => {
                    let turned = organs.placed(&Placement::HERE.turned(placement.turn_deg()));
                    standing.bounds.push(Bounds::of(&turned));
                    standing.blocks.push(Block::new(std::iter::once((0, &turned)), &[], &[], f64::INFINITY));
                    known.push((distinct, turn, standing.blocks.len() - 1));
                    standing.blocks.len() - 1
                }
            };
            copies.push(Copy { block, tree, base_m: placement.base_m() });
        }
        standing.plant(&copies, orchard.period_m());
        standing
    }

    /// Sets out the copies: the trees that do not stand where they were made.
    fn plant(&mut self, copies: &[Copy], period_m: f64) {
        let (mut images, mut extents) = (Vec::new(), Vec::new());
        for copy in copies {
            let Some(bounds) = self.bounds.get(copy.block) else { continue };
            let [x, y, z] = copy.base_m;
            let extent = YExtent { from_m: bounds.low[1] + y - SPARE_M, to_m: bounds.high[1] + y + SPARE_M };
            // A tree without organs reaches nowhere.
            if extent.from_m > extent.to_m {
                continue;
            }
            for shift in extent.images(period_m) {
                images.push(Copy { base_m: [x, y + shift, z], ..*copy });
                extents.push(YExtent { from_m: extent.from_m + shift, to_m: extent.to_m + shift });
            }
        }
        let (index, order) = RowIndex::new(&extents);
        self.index = index;
        self.copies = order.into_iter().map(|number| images.get(number as usize).copied()).collect();
    }

    /// What all trees take up across the row, in (X, Z) of the scene.
    pub(super) fn across(&self) -> Rectangle {
        let copies =
            self.copies.iter().flatten().filter_map(|copy| Some((copy.base_m, self.bounds.get(copy.block)?)));
        let rows = self.bounds.iter().take(self.rows).map(|bounds| ([0.0; 3], bounds));
        rows.chain(copies)
            .fold(Rectangle::NOTHING, |all, ([x, y, z], bounds)| all.and(bounds.seen_from([-x, -y, -z])))
    }

    pub(super) fn block(&self, number: usize) -> Option<&Block> {
        self.blocks.get(number)
    }

    /// Appends the rows and the copies that a part of a line may meet.
    pub(super) fn seen(&self, part: Part, views: &mut Vec<View>) {
        views.extend(self.bounds.iter().take(self.rows).enumerate().map(|(block, bounds)| {
            let window = bounds.seen_from(part.origin);
            View { block, tree: None, part, window, beyond: window }
        }));
        for eight in self.index.eights(part.y_m).flatten() {
            let first = *eight as usize * WIDTH;
            for copy in (first..first + WIDTH).filter_map(|entry| self.copies.get(entry).copied().flatten()) {
                let Some(bounds) = self.bounds.get(copy.block) else { continue };
                let [x, y, z] = copy.base_m;
                let (low_m, high_m) = (bounds.low[1] + y - SPARE_M, bounds.high[1] + y + SPARE_M);
                if part.y_m.1 < low_m || high_m < part.y_m.0 {
                    continue;
                }
                let [ox, oy, oz] = part.origin;
                let window = bounds.seen_from([ox - x, oy - y, oz - z]);
                let moved = Part {
                    origin: [ox - x, oy - y, oz - z],
                    beams: part.beams,
                    starts_m: (part.starts_m.0 - y, part.starts_m.1 - y),
                    y_m: (part.y_m.0 - y, part.y_m.1 - y),
                };
                let (block, tree) = (copy.block, Some(copy.tree));
                views.push(View { block, tree, part: moved, window, beyond: window });
            }
        }
    }

    /// Sorts views from near to far.
    pub(super) fn order(views: &mut [View]) {
        views.sort_by(|a, b| {
            a.window.distance_m().total_cmp(&b.window.distance_m()).then(a.tree.cmp(&b.tree))
        });
        views.iter_mut().rev().fold(Rectangle::NOTHING, |behind, view| {
            view.beyond = view.window.and(behind);
            view.beyond
        });
    }
}
