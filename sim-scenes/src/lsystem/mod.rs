//! Trees by a bracketed L-system: a string is rewritten season by season, a turtle draws the last one.
//!
//! The grammar is text: settings (`angle: 33`), an `axiom:`, and productions (`A -> F [ + A ] A`). Several productions of one
//! letter are drawn from by weight (`A (3) -> …`), from the tree's own random stream. [`grammar`] has the settings, [`turtle`] the
//! letters that draw.

pub mod grammar;
pub(crate) mod rewrite;
pub mod turtle;

pub use grammar::{Grammar, GrammarError, NAMED_GRAMMARS};
pub use rewrite::Overgrown;

use crate::generator::draft::Draft;
use crate::generator::error::GrowError;
use crate::generator::planting::{Generator, Planting};
use crate::growth::TreeParameters;
use crate::parameters::{ParameterError, TableSource, parameters, require};
use crate::seed::Purpose;

/// Where a grammar comes from: a name of [`NAMED_GRAMMARS`], or lines of text here or in a file.
pub type GrammarSource = TableSource<String>;

parameters! {
    /// How an L-system grows a tree.
    pub struct LSystemParameters;
    /// L-system parameters of which every one may be left out: the `[orchard.lsystem]` table of a scene file.
    pub overrides LSystemOverrides;

    /// The grammar: a name, or its lines here or in a file.
    rules: GrammarSource = GrammarSource::named("leafy"), "woody | leafy | lines", "ours: the productions of Méndez 2012 and Tarquis 2006 are not public";
    /// Times the string is rewritten; 0 for as often as the grammar says.
    iterations: u32 = 0, "seasons", "the grammar knows";
    /// Letters at which a tree counts as exploded.
    max_symbols: u32 = 2_000_000, "letters", "a production that doubles its letter passes it in 21 seasons";
}

impl LSystemParameters {
    /// Checks all values.
    ///
    /// # Errors
    /// The first key with an invalid value, and the values allowed.
    pub fn validate(&self) -> Result<(), ParameterError> {
        require(self.iterations <= 100, "orchard.lsystem.iterations", "0 to 100", self.iterations)?;
        require(self.max_symbols > 0, "orchard.lsystem.max_symbols", "1 or more", self.max_symbols)?;
        self.grammar().map(|_| ())
    }

    /// The grammar, read.
    ///
    /// # Errors
    /// Unknown name, unreadable file, or a line that cannot be read.
    pub fn grammar(&self) -> Result<Grammar, ParameterError> {
        let grammar = match self.rules.rows() {
            Ok(Ok(lines)) => Grammar::read(lines.iter().map(String::as_str)),
            Ok(Err(name)) => Grammar::named(name),
            Err(error) => Err(error.into()),
        };
        grammar.map_err(|error| {
            let names: Vec<&str> = NAMED_GRAMMARS.iter().map(|(name, _)| *name).collect();
            let expected =
                format!("one of {} or the lines of a grammar, here or in a file", names.join(", "));
            ParameterError::new("orchard.lsystem.rules", expected, error)
        })
    }
}

/// Trees of a grammar.
pub(crate) struct Sprouting {
    grammar: Grammar,
    iterations: u32,
    max_symbols: usize,
    leaves: TreeParameters,
    seed: u64,
}

impl Sprouting {
    pub(crate) fn new(
        lsystem: &LSystemParameters,
        leaves: TreeParameters,
        seed: u64,
    ) -> Result<Self, ParameterError> {
        lsystem.validate()?;
        let grammar = lsystem.grammar()?;
        let iterations = if lsystem.iterations > 0 { lsystem.iterations } else { grammar.iterations };
        let max_symbols = lsystem.max_symbols as usize;
        Ok(Self { grammar, iterations, max_symbols, leaves, seed })
    }
}

impl Generator for Sprouting {
    fn draft(&self, &Planting { row, tree, .. }: &Planting) -> Result<Draft, GrowError> {
        let mut stream = Purpose::Rewriting.stream(self.seed, row, tree);
        let letters = rewrite::rewrite(&self.grammar, self.iterations, self.max_symbols, &mut stream)
            .map_err(|cause| GrowError::Overgrown { row, tree, cause })?;
        let mut stream = Purpose::Foliage.stream(self.seed, row, tree);
        Ok(turtle::draw(&letters, &self.grammar, &self.leaves, &mut stream))
    }

    fn is_pruned(&self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_named_grammar_is_one_and_grows_a_tree() {
        for (name, _) in NAMED_GRAMMARS {
            let parameters =
                LSystemParameters { rules: GrammarSource::named(name), ..LSystemParameters::default() };
            let sprouting = Sprouting::new(&parameters, TreeParameters::default(), 1).unwrap();
            let planting = |tree| Planting { row: 0, tree, gap: false, is_young: false, base: [0.0; 3] };
            let (one, other) =
                (sprouting.draft(&planting(0)).unwrap(), sprouting.draft(&planting(1)).unwrap());
            assert!(one.segments.len() > 100, "{name}: {}", one.segments.len());
            assert_eq!(one.blades.is_empty(), *name == "woody");
            // Only a grammar with a choice gives different trees.
            assert_eq!(one.segments == other.segments, *name == "woody");
        }
    }

    #[test]
    fn a_grammar_that_is_none_is_refused_at_its_key() {
        let with = |lines: &[&str]| LSystemParameters {
            rules: GrammarSource::Inline(lines.iter().map(|line| (*line).to_owned()).collect()),
            ..LSystemParameters::default()
        };
        let refusal = |lines: &[&str]| with(lines).validate().unwrap_err().to_string();
        let unknown = refusal(&["axiom: A", "colour: 3"]);
        assert!(unknown.starts_with("orchard.lsystem.rules must be one of woody, leafy"), "{unknown}");
        assert!(unknown.contains("`colour: 3`") && unknown.contains("iterations, angle"), "{unknown}");
        let named = LSystemParameters { rules: GrammarSource::named("oak"), ..LSystemParameters::default() };
        assert!(named.validate().unwrap_err().to_string().contains("`oak`"));
        assert!(with(&["axiom: A", "A -> F A"]).validate().is_ok());
    }
}
