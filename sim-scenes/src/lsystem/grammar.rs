//! The text of an L-system.
//!
//! One setting or production a line:
//!
//! ```text
//! iterations: 6          seasons (default 5)
//! angle: 33              turn of + − & ^ \ / without a number, degrees (default 30)
//! step: 0.3              length of F and f without a number, metres (default 0.1)
//! diameter: 0.07         diameter at the start, metres (default 0.05)
//! taper: 0.7             what ! multiplies the diameter by (default 0.75)
//! contraction: 0.9       what " multiplies the step by (default 0.9)
//! axiom: F A
//! A -> F [ + A ] [ - A ]
//! B (3) -> F B           one of several productions of B, drawn three times as often as
//! B (1) -> F
//! ```
//!
//! Blanks do not count. A letter may carry a number in brackets: `F(0.2)`, `+(25)`.

use std::collections::BTreeMap;

use crate::parameters::RowsError;

/// A letter of a string, with its number if it carries one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Letter {
    /// The letter or sign.
    pub sign: char,
    /// Its number.
    pub number: Option<f64>,
}

/// An L-system with the turtle's settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Grammar {
    /// Times the string is rewritten.
    pub iterations: u32,
    /// Turn of a sign without a number, degrees.
    pub angle_deg: f64,
    /// Length of a step without a number, metres.
    pub step_m: f64,
    /// Diameter at the start, metres.
    pub diameter_m: f64,
    /// Factor of `!`.
    pub taper: f64,
    /// Factor of `"`.
    pub contraction: f64,
    /// What growth starts from.
    pub axiom: Vec<Letter>,
    productions: BTreeMap<char, Vec<Production>>,
}

/// What a letter turns into.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Production {
    pub(super) weight: f64,
    pub(super) successor: Vec<Letter>,
}

/// The grammars that come with the program, by name, with their text.
pub const NAMED_GRAMMARS: &[(&str, &str)] =
    &[("woody", include_str!("presets/woody.lsys")), ("leafy", include_str!("presets/leafy.lsys"))];

const SETTINGS: &str = "iterations, angle, step, diameter, taper, contraction, axiom";

impl Grammar {
    /// The grammar with this name.
    ///
    /// # Errors
    /// No grammar has it.
    pub fn named(name: &str) -> Result<Self, GrammarError> {
        let text = NAMED_GRAMMARS.iter().find(|(known, _)| *known == name).map(|(_, text)| *text);
        let text = text.ok_or_else(|| GrammarError::UnknownName { found: name.to_owned() })?;
        Self::read(crate::parameters::lines(text).map(|(_, line)| line))
    }

    /// Reads the lines of a grammar, without comments.
    ///
    /// # Errors
    /// The first line that cannot be read, or a missing axiom.
    pub fn read<'a>(lines: impl IntoIterator<Item = &'a str>) -> Result<Self, GrammarError> {
        let mut grammar = Self {
            iterations: 5,
            angle_deg: 30.0,
            step_m: 0.1,
            diameter_m: 0.05,
            taper: 0.75,
            contraction: 0.9,
            axiom: Vec::new(),
            productions: BTreeMap::new(),
        };
        for line in lines {
            let bare: String = line.split_whitespace().collect();
            match (bare.split_once("->"), bare.split_once(':')) {
                (Some((head, successor)), _) => grammar.produce(line, head, successor)?,
                (None, Some((key, value))) => grammar.set(line, key, value)?,
                (None, None) => return Err(GrammarError::Line { found: line.to_owned() }),
            }
        }
        if grammar.axiom.is_empty() {
            return Err(GrammarError::NoAxiom);
        }
        Ok(grammar)
    }

    /// The productions of a letter; none for one that stays as it is.
    pub(super) fn of(&self, sign: char) -> &[Production] {
        self.productions.get(&sign).map_or(&[], Vec::as_slice)
    }

    fn produce(&mut self, line: &str, head: &str, successor: &str) -> Result<(), GrammarError> {
        let heads = letters(line, head)?;
        let [Letter { sign, number }] = heads.as_slice() else {
            return Err(GrammarError::Head { found: line.to_owned() });
        };
        let weight = number.unwrap_or(1.0);
        if !(weight > 0.0 && weight.is_finite()) || "[]".contains(*sign) {
            return Err(GrammarError::Head { found: line.to_owned() });
        }
        let production = Production { weight, successor: letters(line, successor)? };
        self.productions.entry(*sign).or_default().push(production);
        Ok(())
    }

    fn set(&mut self, line: &str, key: &str, value: &str) -> Result<(), GrammarError> {
        let number = |low: f64, high: f64| {
            let found = value.parse::<f64>().ok().filter(|number| (low..=high).contains(number));
            found.ok_or_else(|| GrammarError::Number { low, high, found: line.to_owned() })
        };
        match key {
            "iterations" => self.iterations = number(1.0, 100.0)? as u32,
            "angle" => self.angle_deg = number(-360.0, 360.0)?,
            "step" => self.step_m = number(1e-4, 10.0)?,
            "diameter" => self.diameter_m = number(1e-4, 10.0)?,
            "taper" => self.taper = number(1e-3, 10.0)?,
            "contraction" => self.contraction = number(1e-3, 10.0)?,
            "axiom" => self.axiom = letters(line, value)?,
            _ => return Err(GrammarError::Setting { found: line.to_owned() }),
        }
        Ok(())
    }
}

/// Reads letters, each with the number in brackets behind it, and checks that branches open and close.
fn letters(line: &str, text: &str) -> Result<Vec<Letter>, GrammarError> {
    let mut letters: Vec<Letter> = Vec::new();
    let mut rest = text;
    let mut open = 0usize;
    while let Some(sign) = rest.chars().next() {
        rest = rest.get(sign.len_utf8()..).unwrap_or("");
        let numberless = || GrammarError::Bracket { found: line.to_owned() };
        match sign {
            '(' | ')' => return Err(numberless()),
            '[' => open += 1,
            ']' => open = open.checked_sub(1).ok_or(GrammarError::Branch { found: line.to_owned() })?,
            _ => {}
        }
        let mut number = None;
        if let Some(inner) = rest.strip_prefix('(') {
            let (digits, after) = inner.split_once(')').ok_or_else(numberless)?;
            let value: f64 = digits.parse().map_err(|_| numberless())?;
            number = Some(value).filter(|value| value.is_finite());
            number.ok_or_else(numberless)?;
            rest = after;
        }
        letters.push(Letter { sign, number });
    }
    if open > 0 {
        return Err(GrammarError::Branch { found: line.to_owned() });
    }
    Ok(letters)
}

/// Why a text is not an L-system. Each message quotes the line.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GrammarError {
    /// The file that should hold it.
    #[error(transparent)]
    File(#[from] RowsError),
    /// No grammar has this name.
    #[error("no grammar is called `{found}`")]
    UnknownName {
        /// The name.
        found: String,
    },
    /// Nothing to start from.
    #[error("a line `axiom: …` is missing")]
    NoAxiom,
    /// Neither a setting nor a production.
    #[error("`{found}` is neither `setting: value` nor `letter -> letters`")]
    Line {
        /// The line.
        found: String,
    },
    /// A setting that does not exist.
    #[error("`{found}` is no setting; settings are {SETTINGS}")]
    Setting {
        /// The line.
        found: String,
    },
    /// A value out of range.
    #[error("a number from {low} to {high} expected in `{found}`")]
    Number {
        /// Least value.
        low: f64,
        /// Greatest value.
        high: f64,
        /// The line.
        found: String,
    },
    /// What is left of the arrow.
    #[error(
        "one letter, with a positive weight in brackets if it has several productions, expected before `->` in `{found}`"
    )]
    Head {
        /// The line.
        found: String,
    },
    /// Round brackets.
    #[error("round brackets hold one finite number behind a letter; found `{found}`")]
    Bracket {
        /// The line.
        found: String,
    },
    /// Square brackets.
    #[error("a branch opens with `[` and closes with `]`; they do not match in `{found}`")]
    Branch {
        /// The line.
        found: String,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_carry_numbers_and_productions_weights() {
        let grammar =
            Grammar::read(["axiom: F ( 0.5 ) A", "A (3) -> + ( -25 ) A", "A -> F", "angle: 20"]).unwrap();
        assert_eq!(grammar.axiom[0], Letter { sign: 'F', number: Some(0.5) });
        assert_eq!(grammar.of('A').iter().map(|p| p.weight).collect::<Vec<_>>(), [3.0, 1.0]);
        assert_eq!(grammar.of('A')[0].successor[0], Letter { sign: '+', number: Some(-25.0) });
        assert_eq!((grammar.angle_deg, grammar.of('B').len()), (20.0, 0));
    }

    #[test]
    fn lines_without_meaning_are_quoted() {
        let refused = |line: &str| Grammar::read(["axiom: A", line]).unwrap_err();
        for line in ["grow up", "colour: 3", "angle: steep", "AB -> F", "A (0) -> F", "A -> F(", "A -> (3)F"]
        {
            assert!(refused(line).to_string().contains(line), "{line}: {}", refused(line));
        }
        assert!(matches!(refused("A -> F [ + A"), GrammarError::Branch { .. }));
        assert!(matches!(refused("A -> F ] + A ["), GrammarError::Branch { .. }));
        assert!(matches!(refused("A -> F(nan)"), GrammarError::Bracket { .. }));
        assert_eq!(Grammar::read(["angle: 3"]), Err(GrammarError::NoAxiom));
    }
}
