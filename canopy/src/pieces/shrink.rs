//! Empirical Bayes for the pieces of a row: each is drawn toward the row's mean by how much of the pieces' scatter is error of measurement.
//!
//! The estimator is that of small areas (Fay and Herriot 1979, J. Am. Stat. Assoc. 74:269): of a row's pieces, the scatter that is more than their known
//! error is taken for true. With x a piece over the row's mean a metre, σ its error and τ the true scatter: x′ = 1 + ρ (x − 1), ρ = τ² / (τ² + σ²).

use super::reliability::Reliability;
use super::scatter::{ByLength, PieceScatter};

/// A piece below this share of the middle piece stands for missing or young trees: it is not of the row's kind, and stays as measured.
const SPARSE: f64 = 0.5;
/// Fewest pieces that tell a scatter of their own; of fewer, it is the study's.
const FEWEST: usize = 4;

/// A piece as measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Piece {
    pub(crate) length_m: f64,
    pub(crate) leaf_m2: f64,
}

/// A piece drawn toward its row's mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Shrunk {
    pub(crate) leaf_m2: f64,
    /// Standard deviation of its error about its row, m².
    pub(crate) sd_m2: f64,
}

/// Draws pieces of about `length_m` toward their mean. `None` without a piece that holds foliage.
pub(crate) fn shrink(
    pieces: &[Piece],
    length_m: f64,
    scatter: &PieceScatter,
) -> Option<(Reliability, Vec<Shrunk>)> {
    let middle = middle(pieces)?;
    let full = |piece: &&Piece| piece.length_m > 0.0 && piece.leaf_m2 / piece.length_m >= SPARSE * middle;
    let (mut metres, mut leaf_m2, mut count) = (0.0, 0.0, 0usize);
    for piece in pieces.iter().filter(full) {
        (metres, leaf_m2, count) = (metres + piece.length_m, leaf_m2 + piece.leaf_m2, count + 1);
    }
    let mean = leaf_m2 / metres;
    let relative = |piece: &Piece| piece.leaf_m2 / piece.length_m / mean;
    let (mut seen, mut of_error) = (0.0, 0.0);
    for piece in pieces.iter().filter(full) {
        seen += piece.length_m * (relative(piece) - 1.0).powi(2) / metres;
        of_error += piece.length_m * scatter.error.of(piece.length_m).powi(2) / metres;
    }
    let of_study = scatter.truth.of(length_m).powi(2);
    let n = count as f64;
    let true_variance = if count < FEWEST { of_study } else { (seen * n / (n - 1.0) - of_error).max(0.0) };
    let reliability = |length_m: f64| share(true_variance, scatter.error.of(length_m).powi(2));
    let drawn = |piece: &Piece| 1.0 + reliability(piece.length_m) * (relative(piece) - 1.0);
    // Pieces of one length keep their sum by themselves.
    let sum: f64 = pieces.iter().filter(full).map(|piece| piece.length_m * drawn(piece)).sum();
    let shrunk = pieces.iter().map(|piece| {
        let unit_m2 = mean * piece.length_m.max(0.0);
        if full(&piece) {
            let sd =
                error_sd(reliability(piece.length_m), &scatter.error, true_variance.max(of_study), piece);
            Shrunk { leaf_m2: unit_m2 * drawn(piece) * metres / sum, sd_m2: unit_m2 * sd }
        } else {
            Shrunk { leaf_m2: piece.leaf_m2, sd_m2: unit_m2 * scatter.error.of(piece.length_m) }
        }
    });
    let told = Reliability {
        pieces: u32::try_from(count).unwrap_or(u32::MAX),
        reliability: reliability(length_m),
        error_relative_sd: scatter.error.of(length_m),
        truth_relative_sd: true_variance.sqrt(),
    };
    Some((told, shrunk.collect()))
}

/// The share of a sum of variances that is true.
fn share(truth: f64, error: f64) -> f64 {
    if truth + error > 0.0 { truth / (truth + error) } else { 1.0 }
}

/// What a drawn piece is off: its own error as far as it counts, and the true difference as far as it does not. The true scatter is not below that of the study's
/// rows, since a row of few pieces can look alike by chance.
fn error_sd(reliability: f64, error: &ByLength, true_variance: f64, piece: &Piece) -> f64 {
    (reliability * error.of(piece.length_m)).hypot((1.0 - reliability) * true_variance.sqrt())
}

/// Leaf area a metre of the middle piece: with pieces sorted from the emptiest on, the one at which their sum passes half of the row's leaf area. The median piece would
/// be a gap where few trees stand, since what hangs over from its neighbours makes a gap a piece.
fn middle(pieces: &[Piece]) -> Option<f64> {
    let mut known: Vec<(f64, f64)> = pieces
        .iter()
        .filter(|piece| piece.length_m > 0.0 && piece.leaf_m2 > 0.0)
        .map(|piece| (piece.leaf_m2 / piece.length_m, piece.leaf_m2))
        .collect();
    known.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    let half_m2 = known.iter().map(|(_, leaf_m2)| leaf_m2).sum::<f64>() / 2.0;
    let mut below_m2 = 0.0;
    let holds_half = |(_, leaf_m2): &&(f64, f64)| {
        below_m2 += leaf_m2;
        below_m2 >= half_m2
    };
    known.iter().find(holds_half).map(|(per_metre, _)| *per_metre)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scatter(error: f64, truth: f64) -> PieceScatter {
        let by_length = |at_1m| ByLength { at_1m, exponent: 0.5 };
        let (error, truth) = (by_length(error), by_length(truth));
        PieceScatter { count: "contact", beams: "eye", model: "lms111", distance_m: 2.0, error, truth }
    }

    fn metres(leaf_m2: &[f64]) -> Vec<Piece> {
        leaf_m2.iter().map(|&leaf_m2| Piece { length_m: 1.0, leaf_m2 }).collect()
    }

    #[test]
    fn differences_keep_the_share_that_is_true() {
        // Eight pieces of 5 ± 1 m²: variance 8/7 · 0.04 of the mean's square, of which 0.01 is error.
        let pieces = metres(&[4.0, 6.0, 4.0, 6.0, 4.0, 6.0, 4.0, 6.0]);
        let (told, shrunk) = shrink(&pieces, 1.0, &scatter(0.1, 0.2)).unwrap();
        let variance = 0.04 * 8.0 / 7.0;
        let expected = (variance - 0.01) / variance;
        assert!((told.reliability - expected).abs() < 1e-12 && told.pieces == 8, "{told:?}");
        assert!((shrunk[0].leaf_m2 - (5.0 - expected)).abs() < 1e-12, "{shrunk:?}");
        let sum: f64 = shrunk.iter().map(|piece| piece.leaf_m2).sum();
        assert!((sum - 40.0).abs() < 1e-9, "{sum}");
    }

    #[test]
    fn pieces_that_differ_by_less_than_their_error_are_all_the_mean_and_not_sure_of_it() {
        let pieces = metres(&[4.9, 5.1, 4.9, 5.1, 4.9, 5.1]);
        let (told, shrunk) = shrink(&pieces, 1.0, &scatter(0.2, 0.08)).unwrap();
        assert_eq!(told.reliability, 0.0);
        assert!(shrunk.iter().all(|piece| (piece.leaf_m2 - 5.0).abs() < 1e-12));
        assert!(shrunk.iter().all(|piece| (piece.sd_m2 - 5.0 * 0.08).abs() < 1e-12), "{shrunk:?}");
    }

    #[test]
    fn a_missing_tree_stays_missing_and_does_not_draw_the_others() {
        let with_gap = [5.0, 6.0, 0.0, 4.0, 5.0, 1.0, 5.5, 4.5];
        let (told, shrunk) = shrink(&metres(&with_gap), 1.0, &scatter(0.3, 0.1)).unwrap();
        assert_eq!((shrunk[2].leaf_m2, shrunk[5].leaf_m2, told.pieces), (0.0, 1.0, 6));
        let sum: f64 = shrunk.iter().map(|piece| piece.leaf_m2).sum();
        assert!((sum - with_gap.iter().sum::<f64>()).abs() < 1e-9);
        assert!(shrunk[2].sd_m2 > 0.0, "that nothing is there is not sure, either");
    }

    /// However many places are empty or hold a young tree, and however few are full: they stay as measured, and the full ones are drawn as in a row without them.
    #[test]
    fn few_trees_among_many_gaps_are_drawn_as_without_them() {
        for trees in 1..=6 {
            let full: Vec<f64> = [9.0, 11.0, 10.0, 8.5, 12.0, 9.5][..trees].to_vec();
            for (gaps, sparse_m2) in
                [(0, 0.0), (1, 0.01), (2, 0.05), (11, 0.02), (30, 0.06), (3, 1.5), (12, 0.0)]
            {
                let all = [full.clone(), vec![sparse_m2; gaps]].concat();
                let (told, shrunk) = shrink(&metres(&all), 1.0, &scatter(0.3, 0.1)).unwrap();
                let (alone, drawn) = shrink(&metres(&full), 1.0, &scatter(0.3, 0.1)).unwrap();
                assert_eq!(told, alone, "{trees} trees, {gaps} gaps of {sparse_m2} m²");
                for (place, piece) in shrunk.iter().enumerate() {
                    let expected = drawn.get(place).map_or(sparse_m2, |tree| tree.leaf_m2);
                    assert!(
                        (piece.leaf_m2 - expected).abs() < 1e-9,
                        "{trees} trees, {gaps} gaps: {shrunk:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn pieces_of_unlike_lengths_add_up_too() {
        let pieces: Vec<Piece> = [(0.4, 1.0), (1.0, 6.0), (1.0, 4.0), (1.0, 5.5), (0.7, 3.9), (1.0, 4.0)]
            .map(|(length_m, leaf_m2)| Piece { length_m, leaf_m2 })
            .to_vec();
        let (_, shrunk) = shrink(&pieces, 1.0, &scatter(0.1, 0.1)).unwrap();
        let sums = [pieces.iter().map(|p| p.leaf_m2).sum::<f64>(), shrunk.iter().map(|p| p.leaf_m2).sum()];
        assert!((sums[0] - sums[1]).abs() < 1e-9, "{sums:?}");
    }

    #[test]
    fn few_pieces_go_by_the_studys_scatter_and_none_by_nothing() {
        let (told, _) = shrink(&metres(&[4.0, 6.0]), 1.0, &scatter(0.1, 0.1)).unwrap();
        assert!((told.reliability - 0.5).abs() < 1e-12, "{told:?}");
        assert_eq!(shrink(&[], 1.0, &scatter(0.1, 0.1)), None);
        assert_eq!(shrink(&metres(&[0.0, 0.0]), 1.0, &scatter(0.1, 0.1)), None);
    }
}
