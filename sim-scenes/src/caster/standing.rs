//! Copies of distinct trees: where they stand, which of them a line may meet, and which are hidden behind nearer ones.

use super::block::Block;
use super::row_index::{Extent, RowIndex};
use super::sight::Part;
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
    fn of(tree: &Tree) -> Self {
        let mut bounds = Self { low: [f64::INFINITY; 3], high: [f64::NEG_INFINITY; 3] };
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

    fn add(&mut self, point: [f64; 3], margin_m: f64) {
        for ((low, high), c) in self.low.iter_mut().zip(&mut self.high).zip(point) {
            *low = low.min(c - margin_m);
            *high = high.max(c + margin_m);
        }
    }
}

/// A copy that stands somewhere.
#[derive(Clone, Copy, Debug)]
struct Copy {
    block: usize,
    /// Number of the tree in the orchard.
    tree: u32,
    base_m: [f64; 3],
}

/// All copies of an orchard, sorted along the row.
#[derive(Clone, Debug, Default)]
pub(super) struct Standing {
    /// Distinct trees as they are turned.
    blocks: Vec<Block>,
    bounds: Vec<Bounds>,
    index: RowIndex,
    /// Entry by entry of the index, images over the border of the period included; None fills up a row.
    copies: Vec<Option<Copy>>,
}

/// A copy as a part of a line sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    /// Its block.
    pub(super) block: usize,
    /// The number of its tree.
    pub(super) tree: u32,
    /// The line's part as seen from the block.
    pub(super) part: Part,
    /// Its first owner.
    pub(super) first_owner: usize,
    /// The rectangle in (X, Z), from the line's origin, that holds it.
    pub(super) window: Rectangle,
    /// The same for it and all views behind it.
    pub(super) beyond: Rectangle,
}

/// A rectangle of the scan plane, metres from the line's origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rectangle {
    /// Least X and Z.
    pub(super) low: [f64; 2],
    /// Greatest X and Z.
    pub(super) high: [f64; 2],
}

impl Rectangle {
    const NOTHING: Self = Self { low: [f64::INFINITY; 2], high: [f64::NEG_INFINITY; 2] };

    /// How far its nearest point is; 0 from within.
    pub(super) fn distance_m(&self) -> f64 {
        let along = |axis: usize| self.low[axis].max(-self.high[axis]).max(0.0);
        along(0).hypot(along(1))
    }

    fn and(self, other: Self) -> Self {
        let pick = |of: fn(f64, f64) -> f64, a: [f64; 2], b: [f64; 2]| [of(a[0], b[0]), of(a[1], b[1])];
        Self { low: pick(f64::min, self.low, other.low), high: pick(f64::max, self.high, other.high) }
    }
}

/// How far a window is widened, metres: far above rounding.
const SPARE_M: f64 = 1e-6;

impl Standing {
    /// The copies of an orchard: the trees that do not stand where they were made.
    pub(super) fn new(orchard: &Orchard) -> Self {
        let mut standing = Self::default();
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
                    standing.blocks.push(Block::new(std::iter::once((0, &turned)), &[], f64::INFINITY));
                    known.push((distinct, turn, standing.blocks.len() - 1));
                    standing.blocks.len() - 1
                }
            };
            copies.push(Copy { block, tree, base_m: placement.base_m() });
        }
        standing.plant(&copies, orchard.length_m());
        standing
    }

    fn plant(&mut self, copies: &[Copy], period_m: f64) {
        let (mut images, mut extents) = (Vec::new(), Vec::new());
        for copy in copies {
            let Some(bounds) = self.bounds.get(copy.block) else { continue };
            let [x, y, z] = copy.base_m;
            let extent = Extent { from_m: bounds.low[1] + y - SPARE_M, to_m: bounds.high[1] + y + SPARE_M };
            // A tree without organs reaches nowhere.
            if extent.from_m > extent.to_m {
                continue;
            }
            for shift in extent.images(period_m) {
                images.push(Copy { base_m: [x, y + shift, z], ..*copy });
                extents.push(Extent { from_m: extent.from_m + shift, to_m: extent.to_m + shift });
            }
        }
        let (index, order) = RowIndex::new(&extents);
        self.index = index;
        self.copies = order.into_iter().map(|number| images.get(number?).copied()).collect();
    }

    pub(super) fn block(&self, number: usize) -> Option<&Block> {
        self.blocks.get(number)
    }

    /// Appends the copies that a part of a line may meet.
    pub(super) fn seen(&self, part: Part, views: &mut Vec<View>) {
        for rows in self.index.rows(part.y_m.0, part.y_m.1) {
            let entries = rows.start * super::lanes::WIDTH..rows.end * super::lanes::WIDTH;
            for copy in entries.filter_map(|entry| self.copies.get(entry).copied().flatten()) {
                let Some(bounds) = self.bounds.get(copy.block) else { continue };
                let [x, y, z] = copy.base_m;
                let (low_m, high_m) = (bounds.low[1] + y - SPARE_M, bounds.high[1] + y + SPARE_M);
                if part.y_m.1 < low_m || high_m < part.y_m.0 {
                    continue;
                }
                let [ox, oy, oz] = part.origin;
                let window = Rectangle {
                    low: [bounds.low[0] + x - ox - SPARE_M, bounds.low[2] + z - oz - SPARE_M],
                    high: [bounds.high[0] + x - ox + SPARE_M, bounds.high[2] + z - oz + SPARE_M],
                };
                let moved = Part {
                    origin: [ox - x, oy - y, oz - z],
                    beams: part.beams,
                    y_m: (part.y_m.0 - y, part.y_m.1 - y),
                };
                let (block, tree) = (copy.block, copy.tree);
                views.push(View { block, tree, part: moved, first_owner: 0, window, beyond: window });
            }
        }
    }

    /// Sorts views from near to far and gives them their owners, from `first_owner` on.
    pub(super) fn order(&self, views: &mut [View], mut first_owner: usize) {
        views.sort_by(|a, b| {
            a.window.distance_m().total_cmp(&b.window.distance_m()).then(a.tree.cmp(&b.tree))
        });
        for view in &mut *views {
            view.first_owner = first_owner;
            first_owner += self.blocks.get(view.block).map_or(0, Block::len);
        }
        views.iter_mut().rev().fold(Rectangle::NOTHING, |behind, view| {
            view.beyond = view.window.and(behind);
            view.beyond
        });
    }
}
