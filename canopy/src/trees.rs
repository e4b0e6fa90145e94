//! Cells along the row: trees, metres, and the finer ones nested in them.

/// Length of an outline cell along the row, metres, about.
const OUTLINE_M: f64 = 0.1;

/// How the row is cut. Outline cells nest in slices, slices in trees, all by whole numbers, so that no line falls between.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cut {
    outline_m: f64,
    outlines_per_slice: i64,
    slices_per_tree: Option<i64>,
    tree_spacing_m: f64,
}

/// The cells a line lies in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Keys {
    pub(crate) outline: i64,
    pub(crate) slice: i64,
    /// None without a tree spacing, and before the row's first tree.
    pub(crate) tree: Option<i64>,
    pub(crate) metre: i64,
}

impl Cut {
    pub(crate) fn new(tree_spacing_m: Option<f64>, slice_m: f64) -> Self {
        let whole = |length_m: f64, part_m: f64| (length_m / part_m).round().max(1.0);
        let slices_per_tree = tree_spacing_m.map(|spacing_m| whole(spacing_m, slice_m));
        let slice_m = match (tree_spacing_m, slices_per_tree) {
            (Some(spacing_m), Some(slices)) => spacing_m / slices,
            _ => slice_m,
        };
        let outlines = whole(slice_m, OUTLINE_M);
        Self {
            outline_m: slice_m / outlines,
            outlines_per_slice: outlines as i64,
            slices_per_tree: slices_per_tree.map(|n| n as i64),
            tree_spacing_m: tree_spacing_m.unwrap_or(1.0),
        }
    }

    pub(crate) fn slice_m(&self) -> f64 {
        self.outline_m * self.outlines_per_slice as f64
    }

    /// Where a slice begins and ends, metres.
    pub(crate) fn slice_faces_m(&self, slice: i64) -> [f64; 2] {
        [slice, slice + 1].map(|k| k as f64 * self.slice_m())
    }

    pub(crate) fn tree_spacing_m(&self) -> f64 {
        self.tree_spacing_m
    }

    pub(crate) fn keys(&self, y_m: f64) -> Keys {
        // A line a rounding error short of a border belongs behind it.
        let floor = |value: f64| (value + 1e-9).floor() as i64;
        let outline = floor(y_m / self.outline_m);
        let slice = outline.div_euclid(self.outlines_per_slice);
        let tree = self.slices_per_tree.map(|n| slice.div_euclid(n)).filter(|tree| *tree >= 0);
        Keys { outline, slice, tree, metre: floor(y_m) }
    }
}

/// Sums over one tree or metre.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Cell {
    pub(crate) index: i64,
    pub(crate) scanned_m: f64,
    /// The largest line weight in it: how far off its length the scanned metres of a whole cell may be.
    pub(crate) longest_line_m: f64,
    pub(crate) impacted_m2: f64,
    pub(crate) contact_m2: f64,
    /// By the shares of spots.
    pub(crate) share_m2: f64,
    pub(crate) volume_m3: f64,
    pub(crate) height_m: Option<f64>,
    pub(crate) returns: u64,
}

impl Cell {
    pub(crate) fn add_line(&mut self, weight_m: f64, impacted_m2: f64, returns: u64) {
        self.scanned_m += weight_m;
        self.longest_line_m = self.longest_line_m.max(weight_m);
        self.impacted_m2 += impacted_m2;
        self.returns += returns;
    }

    /// Raw leaf area a metre, m²/m.
    pub(crate) fn density(&self) -> f64 {
        self.contact_m2 / self.scanned_m
    }

    /// True if `length_m` was scanned, but for what one line more or less makes.
    pub(crate) fn complete(&self, length_m: f64) -> bool {
        length_m - self.scanned_m <= self.longest_line_m + 1e-9
    }
}

/// Cells in the order of travel, only those scanned, `max` at most.
#[derive(Clone, Debug)]
pub(crate) struct Cells {
    list: Vec<Cell>,
    max: usize,
    dropped: bool,
}

impl Cells {
    pub(crate) fn new(max: usize) -> Self {
        Self { list: Vec::new(), max, dropped: false }
    }

    /// The cell with an index; new ones come in ascending order. None if there are too many, or it never was.
    pub(crate) fn at(&mut self, index: i64) -> Option<&mut Cell> {
        if self.list.last().is_none_or(|last| last.index < index) {
            if self.list.len() >= self.max {
                self.dropped = true;
                return None;
            }
            self.list.push(Cell { index, ..Cell::default() });
        }
        self.list.iter_mut().rev().find(|cell| cell.index <= index).filter(|cell| cell.index == index)
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &Cell> + Clone {
        self.list.iter()
    }

    /// The most cells kept, if some were dropped.
    pub(crate) fn dropped(&self) -> Option<usize> {
        self.dropped.then_some(self.max)
    }
}

/// A tree with less leaf area a metre than this share of the others' is missing: what stands there is a neighbour's.
const MISSING: f64 = 0.01;
/// So much of a tree must have been scanned to tell.
const SCANNED: f64 = 0.5;

/// Metres with canopy returns that lie where trees are missing: neighbours reach into the gap, and no row of full trees has them. Trees `spacing_m` apart,
/// the one at `open` still being scanned.
pub(crate) fn gaps_m(trees: &Cells, metres: &Cells, spacing_m: f64, open: Option<i64>) -> f64 {
    if trees.dropped || metres.dropped {
        return 0.0;
    }
    let least = least_density(trees, spacing_m, open);
    let within = |tree: &Cell| -> f64 {
        let [from_m, to_m] = [tree.index, tree.index + 1].map(|tree| tree as f64 * spacing_m);
        let overlap_m = |metre: &Cell| {
            let first_m = metre.index as f64;
            ((first_m + 1.0).min(to_m) - first_m.max(from_m)).max(0.0) * metre.scanned_m
        };
        metres.iter().filter(|metre| metre.returns > 0).map(overlap_m).sum()
    };
    whole(trees, spacing_m, open).filter(|tree| tree.density() < least).map(within).sum()
}

/// Trees of which enough was scanned to tell, but for those that are missing.
pub(crate) fn standing(
    trees: &Cells,
    spacing_m: f64,
    open: Option<i64>,
) -> impl Iterator<Item = &Cell> + Clone {
    let least = least_density(trees, spacing_m, open);
    whole(trees, spacing_m, open).filter(move |tree| tree.density() >= least)
}

/// Whether no tree stands there, of those of which enough was scanned to tell.
pub(crate) fn is_missing(trees: &Cells, spacing_m: f64) -> impl Fn(&Cell) -> bool {
    let least = least_density(trees, spacing_m, None);
    move |tree| tree.scanned_m > SCANNED * spacing_m && tree.density() < least
}

/// Trees of which enough was scanned to tell.
fn whole(trees: &Cells, spacing_m: f64, open: Option<i64>) -> impl Iterator<Item = &Cell> + Clone {
    trees.iter().filter(move |tree| Some(tree.index) != open && tree.scanned_m > SCANNED * spacing_m)
}

/// Leaf area a metre below which a tree is missing.
fn least_density(trees: &Cells, spacing_m: f64, open: Option<i64>) -> f64 {
    // Where the leaf area stands, so that gaps do not lower what they are held against.
    let (sum, weighted) = whole(trees, spacing_m, open).fold((0.0, 0.0), |(sum, weighted), tree| {
        (sum + tree.contact_m2, weighted + tree.contact_m2 * tree.density())
    });
    MISSING * weighted / sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_is_no_canopy_wherever_neighbours_reach_into_it() {
        // Twelve trees of 1.5 m; some are missing, but for a branch of their neighbours.
        let found = |missing: &[i64], open| {
            let (mut trees, mut metres) = (Cells::new(100), Cells::new(100));
            for index in 0..12 {
                let contact_m2 = if missing.contains(&index) { 0.05 } else { 9.0 + 0.1 * index as f64 };
                *trees.at(index).unwrap() = Cell { index, contact_m2, scanned_m: 1.5, ..Cell::default() };
            }
            for index in 0..18 {
                *metres.at(index).unwrap() = Cell { index, scanned_m: 1.0, returns: 5, ..Cell::default() };
            }
            gaps_m(&trees, &metres, 1.5, open)
        };
        assert_eq!(found(&[], None), 0.0);
        for missing in [&[0][..], &[3], &[3, 4], &[1, 5, 11], &[0, 2, 4, 6, 8, 10]] {
            let expected_m = 1.5 * missing.len() as f64;
            assert!(
                (found(missing, None) - expected_m).abs() < 1e-9,
                "{missing:?}: {}",
                found(missing, None)
            );
        }
        // Of the tree that is being scanned nothing is known yet.
        assert_eq!(found(&[3], Some(3)), 0.0);
    }

    #[test]
    fn cells_nest_and_trees_begin_at_multiples_of_the_spacing() {
        let cut = Cut::new(Some(1.2), 0.25);
        assert!((cut.slice_m() - 0.24).abs() < 1e-12);
        for tree in 0..2000i64 {
            let border_m = tree as f64 * 1.2;
            assert_eq!(cut.keys(border_m).tree, Some(tree));
            assert_eq!(cut.keys(border_m + 1.1999).tree, Some(tree));
        }
        assert_eq!(cut.keys(-0.01).tree, None);
        assert_eq!(cut.keys(-0.01).metre, -1);
        assert_eq!(Cut::new(None, 0.25).keys(7.0).tree, None);
    }

    #[test]
    fn only_so_many_cells_are_kept() {
        let mut cells = Cells::new(2);
        assert!(cells.at(5).is_some());
        assert!(cells.at(9).is_some());
        assert!(cells.at(5).is_some());
        assert!(cells.at(7).is_none());
        assert_eq!(cells.dropped(), None);
        assert!(cells.at(10).is_none());
        assert_eq!(cells.dropped(), Some(2));
        assert_eq!(cells.iter().count(), 2);
    }
}
