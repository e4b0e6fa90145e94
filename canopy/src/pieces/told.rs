//! The pieces of an estimate, drawn toward their row's mean, with their intervals.

use super::reliability::{PieceReliability, Reliability};
use super::scatter::PieceScatter;
use super::shrink::{Piece, Shrunk, shrink};
use crate::estimate::Estimate;
use crate::leaf::PieceLeaf;
use crate::regression::Z95;

/// How sure the row's leaf area is.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct RowSds {
    /// Relative standard deviation by its sampling alone; `None` where it is unknown.
    pub(crate) sampling: Option<f64>,
    /// The same by all causes that go either way.
    pub(crate) all: Option<f64>,
    /// What causes that go one way may make of it: the logarithms of the least and the most over what is told.
    pub(crate) shifts: [f64; 2],
    /// What a piece is off by for leaves of its neighbours that count in it: a relative standard deviation, times its metres.
    pub(crate) smeared_m: f64,
}

impl RowSds {
    /// The ends within which a piece of the row lies, from those by causes that go either way.
    pub(crate) fn shifted(self, [low_m2, high_m2]: [f64; 2], leaf_m2: f64) -> [f64; 2] {
        let [least, most] = self.shifts.map(|shift| leaf_m2 * shift.exp_m1());
        [(low_m2 + least).max(0.0), high_m2 + most]
    }
}

/// A shorter piece is as unsure as this one, metres.
const SHORTEST_M: f64 = 0.25;

/// Draws an estimate's pieces toward their row's mean, and tells how sure each is.
pub(crate) fn tell(estimate: &mut Estimate, scatter: Option<&PieceScatter>, tree_m: f64, row: RowSds) {
    let Some(scatter) = scatter else { return };
    let mut trees: Vec<_> = estimate.trees.iter_mut().map(|tree| (tree.scanned_m, &mut tree.leaf)).collect();
    let trees = draw(&mut trees, tree_m, scatter, row);
    let mut metres: Vec<_> =
        estimate.slices.iter_mut().map(|slice| (slice.scanned_m, &mut slice.leaf)).collect();
    let metres = draw(&mut metres, 1.0, scatter, row);
    estimate.pieces =
        Some(PieceReliability { trees, metres }).filter(|_| trees.is_some() || metres.is_some());
}

fn draw(
    pieces: &mut [(f64, &mut PieceLeaf)],
    length_m: f64,
    scatter: &PieceScatter,
    row: RowSds,
) -> Option<Reliability> {
    // What is withheld stays so.
    let mut known: Vec<(Piece, &mut PieceLeaf)> = pieces
        .iter_mut()
        .filter_map(|(length_m, leaf)| {
            let leaf_m2 = leaf.unshrunk.ok()?;
            Some((Piece { length_m: *length_m, leaf_m2 }, &mut **leaf))
        })
        .collect();
    let measured: Vec<Piece> = known.iter().map(|(piece, _)| *piece).collect();
    let (told, shrunk) = shrink(&measured, length_m, scatter)?;
    for ((piece, leaf), Shrunk { leaf_m2, sd_m2 }) in known.iter_mut().zip(shrunk) {
        let smeared = row.smeared_m / piece.length_m.max(SHORTEST_M);
        let ends = |row_sd: f64| {
            let half_m2 = Z95 * sd_m2.hypot(row_sd * leaf_m2).hypot(smeared * leaf_m2);
            [(leaf_m2 - half_m2).max(0.0), leaf_m2 + half_m2]
        };
        leaf.areas = leaf.areas.with_best(leaf_m2);
        leaf.sampling_error_m2 = row.sampling.map(ends);
        leaf.interval_m2 = row.all.map(ends).map(|ends| row.shifted(ends, leaf_m2));
    }
    Some(told)
}
