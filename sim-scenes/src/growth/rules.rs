//! What a drawn state does: continue the axis, or end it and branch.

use super::markov::State;
use crate::parameters::{ParameterError, RowsError, TableSource, choices};

choices! {
    /// How the transitions `k` that an axis has made enter its next draw.
    pub enum PowerRule {
        /// Row of the axis's *current* state in P^k, k = 1 at its first transition: the paper's words.
        Literal = "literal",
        /// Row of the axis's *first* state in P^k: the law of the k-th state of a Markov chain.
        Marginal = "marginal",
        /// Row of the current state in P: a plain Markov chain.
        Plain = "plain",
    }
}

choices! {
    /// Whose internodes limit how many axes a branching starts.
    pub enum AxesLimit {
        /// Those of the growth unit that bears them.
        BearingUnit = "bearing_unit",
        /// Those of the first growth unit of the new axes.
        ChildUnit = "child_unit",
    }
}

choices! {
    /// Where new axes leave their bearer.
    pub enum Attachment {
        /// New axis `j` at the `j`-th node from the tip.
        LastNodes = "last_nodes",
        /// All at the tip.
        Tip = "tip",
    }
}

choices! {
    /// How the states of a branching's axes are drawn.
    pub enum ChildDraw {
        /// One state for all.
        One = "one",
        /// One each.
        Each = "each",
    }
}

/// What becomes of an axis whose next state is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RuleStep {
    /// `>`: the axis goes on in place.
    Succession,
    /// `+`: the axis ends (sympodial) and new axes start.
    Branching,
}

/// A step for every (parent, child), both in the order L, M, S, F.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RuleTable([[RuleStep; 4]; 4]);

impl RuleTable {
    /// Reads four rows (parent L, M, S, F) of four signs, `>` or `+` (child L, M, S, F).
    ///
    /// # Errors
    /// [`RuleError`], which names the row.
    pub fn new<R: AsRef<str>>(rows: &[R]) -> Result<Self, RuleError> {
        let mut table = [[RuleStep::Succession; 4]; 4];
        if rows.len() != 4 {
            return Err(RuleError::Rows { found: rows.len() });
        }
        for ((target, row), state) in table.iter_mut().zip(rows).zip(State::ALL) {
            let steps: Option<Vec<RuleStep>> = row
                .as_ref()
                .chars()
                .map(|sign| match sign {
                    '>' => Some(RuleStep::Succession),
                    '+' => Some(RuleStep::Branching),
                    _ => None,
                })
                .collect();
            *target = steps
                .and_then(|steps| steps.try_into().ok())
                .ok_or_else(|| RuleError::Signs { row: *state, found: row.as_ref().to_owned() })?;
        }
        Ok(Self(table))
    }

    /// What drawing `child` does to an axis in state `parent`.
    pub fn step(&self, parent: State, child: State) -> RuleStep {
        self.0[parent.index()][child.index()]
    }
}

/// The rule sets known by name.
pub const NAMED_RULES: &[(&str, [&str; 4])] =
    &[("vase", ["++>>", "++>>", "++>>", "++++"]), ("floral_only", [">>>>", ">>>>", ">>>>", "++++"])];

/// Where a rule table comes from: a name of [`NAMED_RULES`], or rows of signs in the scene file.
pub type RuleSource = TableSource<String>;

impl RuleSource {
    /// The checked table.
    ///
    /// # Errors
    /// [`RuleError`]: unknown name, shape or sign.
    pub fn rules(&self) -> Result<RuleTable, RuleError> {
        match self.rows()? {
            Ok(rows) => RuleTable::new(&rows),
            Err(name) => match NAMED_RULES.iter().find(|(known, _)| *known == name) {
                Some((_, rows)) => RuleTable::new(rows),
                None => Err(RuleError::UnknownName { found: name.to_owned() }),
            },
        }
    }
}

/// Why signs do not form a rule table.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum RuleError {
    /// The file that should hold it.
    #[error(transparent)]
    File(#[from] RowsError),
    /// No rule set has this name.
    #[error("no rule set is called `{found}`")]
    UnknownName {
        /// The name.
        found: String,
    },
    /// Not four rows.
    #[error("4 rows expected, found {found}")]
    Rows {
        /// Rows given.
        found: usize,
    },
    /// A row is not four signs.
    #[error("four signs `>` or `+` expected in row {row}, found `{found}`")]
    Signs {
        /// Parent state of the row.
        row: State,
        /// The row.
        found: String,
    },
}

impl RuleError {
    /// The same said of a key of the scene file.
    pub(crate) fn at(self, key: String) -> ParameterError {
        let names: Vec<&str> = NAMED_RULES.iter().map(|(name, _)| *name).collect();
        let expected =
            format!("one of {} or four rows L, M, S, F of four signs, here or in a file", names.join(", "));
        ParameterError::new(key, expected, self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn floral_shoots_always_branch_and_the_vase_forks_its_trunk() {
        for (name, _) in NAMED_RULES {
            let rules = RuleSource::named(name).rules().unwrap();
            assert!(State::ALL.iter().all(|child| rules.step(State::Floral, *child) == RuleStep::Branching));
        }
        let vase = RuleSource::named("vase").rules().unwrap();
        assert_eq!(vase.step(State::Long, State::Long), RuleStep::Branching);
        assert_eq!(vase.step(State::Long, State::Short), RuleStep::Succession);
    }

    #[test]
    fn a_bad_sign_names_its_row() {
        let error = RuleTable::new(&["++>>", "++>", "++>>", "++++"]).unwrap_err();
        assert_eq!(error, RuleError::Signs { row: State::Medium, found: "++>".into() });
    }
}
