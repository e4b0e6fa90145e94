//! Rewriting: every letter with productions is replaced, all at once, season by season.

use super::grammar::{Grammar, Letter};
use crate::seed::Stream;

/// A string that outgrew its bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the L-system exceeds {limit} letters in season {season} of {seasons}; give it fewer orchard.lsystem.iterations or raise \
     orchard.lsystem.max_symbols"
)]
pub struct Overgrown {
    /// Season in which the bound was passed, from 1.
    pub season: u32,
    /// Seasons requested.
    pub seasons: u32,
    /// The bound.
    pub limit: usize,
}

/// The string after `iterations` seasons. It is never let grow beyond `limit` letters.
pub(super) fn rewrite(
    grammar: &Grammar,
    iterations: u32,
    limit: usize,
    stream: &mut Stream,
) -> Result<Vec<Letter>, Overgrown> {
    let mut string = grammar.axiom.clone();
    let mut next = Vec::new();
    for season in 1..=iterations {
        for letter in &string {
            match grammar.of(letter.sign) {
                [] => next.push(*letter),
                [only] => next.extend_from_slice(&only.successor),
                several => {
                    let weights: Vec<f64> = several.iter().map(|production| production.weight).collect();
                    let drawn = stream.weighted(&weights).and_then(|place| several.get(place));
                    next.extend(drawn.into_iter().flat_map(|production| &production.successor));
                }
            }
            if next.len() > limit {
                return Err(Overgrown { season, seasons: iterations, limit });
            }
        }
        std::mem::swap(&mut string, &mut next);
        next.clear();
    }
    Ok(string)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seed::Purpose;

    fn stream(tree: u32) -> Stream {
        Purpose::Rewriting.stream(1, 0, tree)
    }

    fn written(letters: &[Letter]) -> String {
        letters.iter().map(|letter| letter.sign).collect()
    }

    #[test]
    fn algae_grow_as_fibonacci_numbers() {
        // Lindenmayer's own first example.
        let algae = Grammar::read(["axiom: A", "A -> AB", "B -> A"]).unwrap();
        let after = |n| rewrite(&algae, n, 1000, &mut stream(0)).unwrap();
        assert_eq!(written(&after(4)), "ABAABABA");
        assert_eq!((5..9).map(|n| after(n).len()).collect::<Vec<_>>(), [13, 21, 34, 55]);
    }

    #[test]
    fn explosions_are_bounded_and_say_when() {
        let doubling = Grammar::read(["axiom: A", "A -> AA"]).unwrap();
        let exploded = rewrite(&doubling, 60, 1000, &mut stream(0)).unwrap_err();
        assert_eq!(exploded, Overgrown { season: 10, seasons: 60, limit: 1000 });
        assert!(exploded.to_string().contains("1000 letters in season 10 of 60"));
    }

    #[test]
    fn choices_follow_their_weights_and_the_seed() {
        let coin = Grammar::read(["axiom: A", "A (3) -> XA", "A (1) -> YA"]).unwrap();
        let drawn = |tree| written(&rewrite(&coin, 100, 1000, &mut stream(tree)).unwrap());
        assert_eq!(drawn(1), drawn(1));
        assert_ne!(drawn(1), drawn(2));
        let heads: usize = (0..100).map(|tree| drawn(tree).matches('X').count()).sum();
        // 10 000 draws at 3/4: five standard deviations are 217.
        assert!(heads.abs_diff(7500) < 217, "{heads}");
    }
}
