//! States of growth units and the Markov chain over them (MODEL: Durand et al. 2005 as read by Méndez et al. 2013).

use std::borrow::Cow;
use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::parameters::{ParameterError, RowsError, SceneFile, TableSource, choices};

choices! {
    /// What kind of growth unit a season makes.
    pub enum State {
        /// Long shoot, about 20 metamers.
        Long = "L",
        /// Medium shoot, 8 metamers.
        Medium = "M",
        /// Short shoot, 1 metamer.
        Short = "S",
        /// Floral shoot, 3 metamers.
        Floral = "F",
    }
}

impl State {
    /// Row and column in matrices and rule tables.
    pub fn index(self) -> usize {
        self as usize
    }
}

/// A matrix of transition probabilities; row = parent, column = child, both in the order L, M, S, F.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransitionMatrix([[f64; 4]; 4]);

/// How far a row may be from summing to one.
const ROW_SUM_TOLERANCE: f64 = 1e-6;

impl TransitionMatrix {
    /// Checks shape, entries in \[0, 1\] and row sums within 1e-6 of 1. Nothing is renormalised.
    ///
    /// # Errors
    /// [`MatrixError`], which names the row.
    pub fn new<R: AsRef<[f64]>>(rows: &[R]) -> Result<Self, MatrixError> {
        let mut matrix = [[0.0; 4]; 4];
        if rows.len() != 4 {
            return Err(MatrixError::Rows { found: rows.len() });
        }
        for ((target, row), state) in matrix.iter_mut().zip(rows).zip(State::ALL) {
            let row = row.as_ref();
            *target = row.try_into().map_err(|_| MatrixError::Columns { row: *state, found: row.len() })?;
            if let Some(found) = row.iter().find(|p| !(0.0..=1.0).contains(*p)) {
                return Err(MatrixError::Entry { row: *state, found: *found });
            }
            let sum: f64 = row.iter().sum();
            if (sum - 1.0).abs() > ROW_SUM_TOLERANCE {
                return Err(MatrixError::RowSum { row: *state, sum });
            }
        }
        Ok(Self(matrix))
    }

    /// Probabilities of the children of `parent`.
    pub fn row(&self, parent: State) -> [f64; 4] {
        self.0[parent.index()]
    }

    /// P, P², … Pⁿ. Rounding below zero is clamped.
    pub fn powers(&self, n: usize) -> Vec<Self> {
        std::iter::successors(Some(*self), |power| Some(power.times(self))).take(n).collect()
    }

    fn times(&self, other: &Self) -> Self {
        Self(self.0.map(|row| {
            std::array::from_fn(|j| row.iter().zip(&other.0).map(|(p, q)| p * q[j]).sum::<f64>().max(0.0))
        }))
    }
}

/// The matrices known by name, with where they come from.
pub const NAMED_MATRICES: &[(&str, &str, [[f64; 4]; 4])] = &[
    (
        "P_fuji",
        "EM refit to the public Fuji trees (StructureAnalysis), emission means fixed at 20, 8, 1, 3; two digits",
        [
            [0.23, 0.16, 0.52, 0.09],
            [0.04, 0.03, 0.13, 0.80],
            [0.04, 0.04, 0.23, 0.69],
            [0.04, 0.11, 0.59, 0.26],
        ],
    ),
    (
        "P_mapplet_mean",
        "terminal fates of Costes et al. 2008 as MAppleT has them, plain mean of 1995-2000, renormalised",
        [
            [0.235039, 0.115019, 0.001667, 0.648275],
            [0.027667, 0.083667, 0.048500, 0.840166],
            [0.096833, 0.030833, 0.283334, 0.589000],
            [0.151641, 0.239460, 0.608899, 0.0],
        ],
    ),
    (
        "P_fuji_succession",
        "the Fuji refit, successor edges only",
        [
            [0.5936, 0.3786, 0.0009, 0.0269],
            [0.2444, 0.1355, 0.0149, 0.6052],
            [0.0408, 0.0375, 0.2240, 0.6977],
            [0.0733, 0.1084, 0.4009, 0.4174],
        ],
    ),
    (
        "P_fuji_branching",
        "the Fuji refit, lateral edges only",
        [
            [0.1233, 0.0900, 0.6598, 0.1269],
            [0.0, 0.0326, 0.2005, 0.7669],
            [0.2009, 0.0001, 0.7989, 0.0001],
            [0.0163, 0.0684, 0.8737, 0.0416],
        ],
    ),
];

/// Where a matrix comes from: a name of [`NAMED_MATRICES`], or rows of numbers in the scene file.
pub type MatrixSource = TableSource<Vec<f64>>;

impl MatrixSource {
    /// The checked matrix.
    ///
    /// # Errors
    /// [`MatrixError`]: unknown name, shape, entry or row sum.
    pub fn matrix(&self) -> Result<TransitionMatrix, MatrixError> {
        self.read(TransitionMatrix::new)
    }

    /// The matrix with every row divided by its sum, and the rows whose sums were off, with those sums.
    ///
    /// # Errors
    /// As [`Self::matrix`], but for row sums: only a row that sums to nothing is refused.
    pub fn renormalised(&self) -> Result<(TransitionMatrix, Vec<(State, f64)>), MatrixError> {
        let mut off = Vec::new();
        let matrix = self.read(|rows| {
            let scaled: Vec<Vec<f64>> = rows
                .iter()
                .zip(State::ALL)
                .map(|(row, state)| {
                    let sum: f64 = row.iter().sum();
                    if (sum - 1.0).abs() > ROW_SUM_TOLERANCE && sum > 0.0 {
                        off.push((*state, sum));
                        row.iter().map(|p| p / sum).collect()
                    } else {
                        row.clone()
                    }
                })
                .chain(rows.iter().skip(State::ALL.len()).cloned())
                .collect();
            TransitionMatrix::new(&scaled)
        })?;
        Ok((matrix, off))
    }

    fn read(
        &self,
        check: impl FnOnce(&[Vec<f64>]) -> Result<TransitionMatrix, MatrixError>,
    ) -> Result<TransitionMatrix, MatrixError> {
        match self.rows()? {
            Ok(rows) => check(&rows),
            Err(name) => match NAMED_MATRICES.iter().find(|(known, ..)| *known == name) {
                Some((.., rows)) => TransitionMatrix::new(rows),
                None => Err(MatrixError::UnknownName { found: name.to_owned() }),
            },
        }
    }
}

/// Where the states of branching axes are drawn from.
#[derive(Clone, Debug, PartialEq)]
pub enum BranchingSource {
    /// From the same draw as succession.
    AsTransitions,
    /// From a matrix of their own.
    Own(MatrixSource),
}

const AS_TRANSITIONS: &str = "as_transitions";

impl BranchingSource {
    /// The file it stands in, if it does.
    pub fn file_mut(&mut self) -> Option<&mut SceneFile> {
        match self {
            Self::AsTransitions => None,
            Self::Own(source) => source.file_mut(),
        }
    }
}

impl fmt::Display for BranchingSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::AsTransitions => f.write_str(AS_TRANSITIONS),
            Self::Own(source) => source.fmt(f),
        }
    }
}

impl JsonSchema for BranchingSource {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "BranchingSource".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        MatrixSource::json_schema(generator)
    }
}

impl Serialize for BranchingSource {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::AsTransitions => serializer.serialize_str(AS_TRANSITIONS),
            Self::Own(source) => source.serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for BranchingSource {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(match MatrixSource::deserialize(deserializer)? {
            MatrixSource::Named(name) if name == AS_TRANSITIONS => Self::AsTransitions,
            source => Self::Own(source),
        })
    }
}

/// Why numbers do not form a transition matrix.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MatrixError {
    /// The file that should hold it.
    #[error(transparent)]
    File(#[from] RowsError),
    /// No matrix has this name.
    #[error("no transition matrix is called `{found}`")]
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
    /// A row is not four numbers.
    #[error("4 numbers expected in row {row}, found {found}")]
    Columns {
        /// Parent state of the row.
        row: State,
        /// Numbers given.
        found: usize,
    },
    /// An entry is not a probability.
    #[error("probabilities from 0 to 1 expected in row {row}, found {found}")]
    Entry {
        /// Parent state of the row.
        row: State,
        /// The entry.
        found: f64,
    },
    /// A row does not sum to one.
    #[error("row {row} must sum to 1 within 1e-6, its sum is {sum}")]
    RowSum {
        /// Parent state of the row.
        row: State,
        /// Its sum.
        sum: f64,
    },
}

impl MatrixError {
    /// The same said of a key of the scene file.
    pub(crate) fn at(self, key: String) -> ParameterError {
        let names: Vec<&str> = NAMED_MATRICES.iter().map(|(name, ..)| *name).collect();
        let expected = format!(
            "one of {} or four rows L, M, S, F of four probabilities, here or in a file",
            names.join(", ")
        );
        ParameterError::new(key, expected, self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_named_matrix_is_one() {
        for (name, ..) in NAMED_MATRICES {
            assert!(MatrixSource::named(name).matrix().is_ok(), "{name}");
        }
    }

    #[test]
    fn old_chains_forget_their_state() {
        let powers = MatrixSource::named("P_fuji").matrix().unwrap().powers(50);
        let spread = |power: &TransitionMatrix| -> f64 {
            let first = power.row(State::Long);
            let gaps = State::ALL
                .iter()
                .flat_map(|s| power.row(*s).into_iter().zip(first).map(|(a, b)| (a - b).abs()));
            gaps.fold(0.0, f64::max)
        };
        assert!(spread(&powers[49]) < 1e-9);
        assert!(spread(&powers[4]) < 0.03 && spread(&powers[4]) > 0.01);
        // The stationary law worked out from the same matrix by hand.
        for (found, expected) in
            powers[49].row(State::Short).into_iter().zip([0.0494, 0.0779, 0.4049, 0.4678])
        {
            assert!((found - expected).abs() < 1e-4, "{found} {expected}");
        }
    }

    #[test]
    fn a_file_holds_a_matrix_and_a_row_that_is_off_is_divided_by_its_sum_on_request() {
        let text = "# L M S F\n0.5, 0.2, 0.2, 0.2\n0 0 0 1\n0; 0; 1; 0 # short\n\n1 0 0 0\n";
        let file = |text: &str| MatrixSource::File(SceneFile::with_content("p.txt", text.as_bytes()));
        assert!(matches!(file(text).matrix(), Err(MatrixError::RowSum { row: State::Long, .. })));
        let (matrix, off) = file(text).renormalised().unwrap();
        assert!(matches!(off.as_slice(), [(State::Long, sum)] if (sum - 1.1).abs() < 1e-12));
        assert!((matrix.row(State::Long)[0] - 0.5 / 1.1).abs() < 1e-15);
        assert_eq!(matrix.row(State::Medium), [0.0, 0.0, 0.0, 1.0]);
        let error = file("0 0 0 1\n0 zero 0 1\n").matrix().unwrap_err();
        assert_eq!(error.to_string(), "p.txt:2: numbers expected, found `0 zero 0 1`");
        let unread = MatrixSource::File(SceneFile::named("p.txt")).matrix().unwrap_err();
        assert_eq!(unread.to_string(), "p.txt has not been read");
    }

    #[test]
    fn a_bad_row_is_named_with_its_sum() {
        let mut rows = vec![vec![0.25; 4]; 4];
        rows[2][1] = 0.26;
        let error = TransitionMatrix::new(&rows).unwrap_err();
        assert!(
            matches!(error, MatrixError::RowSum { row: State::Short, sum } if (sum - 1.01).abs() < 1e-12)
        );
        assert_eq!(error.to_string(), "row S must sum to 1 within 1e-6, its sum is 1.01");
        rows[2] = vec![0.5, 0.5];
        assert_eq!(TransitionMatrix::new(&rows), Err(MatrixError::Columns { row: State::Short, found: 2 }));
        rows[2] = vec![-0.5, 0.5, 0.5, 0.5];
        assert_eq!(TransitionMatrix::new(&rows), Err(MatrixError::Entry { row: State::Short, found: -0.5 }));
        rows.pop();
        assert_eq!(TransitionMatrix::new(&rows), Err(MatrixError::Rows { found: 3 }));
    }
}
