//! What a power law tells tree by tree over what it tells of the row as a whole.
//!
//! A law that is steeper than a line tells more of a dense and a thin half than of two halves that are alike. Calibrations were fitted on rows of trees that are
//! nearly alike; a row with young trees in its gaps has fewer leaves a metre than any of them, and old trees as dense as theirs.

use crate::trees::Cell;

/// A difference so small is one of rounding.
const ROUNDING: f64 = 1e-9;

/// Logarithm of what a law of this exponent of an area (`of` a tree, m²) tells of these trees one by one over what it tells of them together; 0 of trees that are alike. `None` of a law
/// that makes no difference, and without a tree.
pub(crate) fn uneven<'a>(
    trees: impl Iterator<Item = &'a Cell> + Clone,
    exponent: f64,
    of: impl Fn(&Cell) -> f64,
) -> Option<f64> {
    let (length_m, m2) =
        trees.clone().fold((0.0, 0.0), |(length_m, m2), tree| (length_m + tree.scanned_m, m2 + of(tree)));
    let mean = m2 / length_m;
    let by_tree = |tree: &Cell| tree.scanned_m * (of(tree) / tree.scanned_m / mean).powf(exponent);
    let shift = (trees.map(by_tree).sum::<f64>() / length_m).ln();
    Some(shift)
        .filter(|_| exponent > 1.0 && shift.is_finite())
        .map(|shift| if shift > ROUNDING { shift } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trees(contact_m2: &[f64]) -> Vec<Cell> {
        let tree = |contact_m2: &f64| Cell { scanned_m: 1.5, contact_m2: *contact_m2, ..Cell::default() };
        contact_m2.iter().map(tree).collect()
    }

    #[test]
    fn alike_trees_make_no_difference_and_young_ones_do() {
        let of =
            |contact_m2: &[f64], exponent| uneven(trees(contact_m2).iter(), exponent, |tree| tree.contact_m2);
        assert!(of(&[9.0; 12], 1.3).is_some_and(|shift| shift < 1e-12));
        // Three of twelve with a seventh of the leaves: by hand, (9 + 3 · (1/7)^1.3) / 12 over ((9 + 3/7) / 12)^1.3.
        let young: Vec<f64> = [7.0; 9].into_iter().chain([1.0; 3]).collect();
        let by_hand =
            ((9.0 + 3.0 * (1.0_f64 / 7.0).powf(1.3)) / 12.0).ln() - 1.3 * ((9.0 + 3.0 / 7.0) / 12.0_f64).ln();
        assert!(of(&young, 1.3).is_some_and(|shift| (shift - by_hand).abs() < 1e-12 && shift > 0.04));
        assert!(of(&young, 1.6) > of(&young, 1.3));
        for exponent in [1.0, 0.9] {
            assert_eq!(of(&young, exponent), None);
        }
        assert_eq!((of(&[], 1.3), of(&[0.0; 4], 1.3)), (None, None));
    }
}
