//! Returns of a scan plane that leans, each at its own place along the row.

use crate::trees::{Cells, Cut};

/// A return that is not where its line is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stray {
    pub(crate) y_m: f64,
    pub(crate) impacted_m2: f64,
    pub(crate) trunk: f64,
}

/// Strays ahead of the newest line: they wait until a line has come there.
#[derive(Clone, Debug, Default)]
pub(crate) struct Strays {
    waiting: Vec<Stray>,
    first_m: Option<f64>,
    last_m: f64,
}

impl Strays {
    /// A line passes.
    pub(crate) fn pass(&mut self, y_m: f64) {
        self.first_m.get_or_insert(y_m);
        self.last_m = y_m;
    }

    /// A return of it.
    pub(crate) fn add(&mut self, stray: Stray) {
        self.waiting.push(stray);
    }

    /// Those that lines have come to; all of them, at the last line's place, once no line comes.
    pub(crate) fn settle(&mut self, ended: bool, mut settled: impl FnMut(Stray)) {
        let (first_m, last_m) = (self.first_m.unwrap_or(self.last_m), self.last_m);
        self.waiting.retain(|stray| {
            let waits = stray.y_m > last_m && !ended;
            if !waits {
                settled(Stray { y_m: stray.y_m.min(last_m).max(first_m), ..*stray });
            }
            waits
        });
    }
}

/// Adds a return to the tree and the metre that it lies in.
pub(crate) fn into_cells(stray: Stray, cut: &Cut, trees: &mut Cells, metres: &mut Cells) {
    let keys = cut.keys(stray.y_m);
    let tree = keys.tree.and_then(|tree| trees.at(tree));
    for cell in tree.into_iter().chain(metres.at(keys.metre)) {
        cell.add_line(0.0, stray.impacted_m2, 1);
    }
}
