//! Internodes of growth units, by state, order and the age of the tree.

use super::markov::State;
use crate::parameters::{ParameterError, RowsError, TableSource};

/// Where the internodes of long growth units come from: a name of [`NAMED_INTERNODES`], or two rows of whole numbers (trunk; other
/// axes), one number a year from Ta = 1, of which the last goes on forever.
pub type InternodeSource = TableSource<Vec<u32>>;

/// The tables known by name, with where they come from.
pub const NAMED_INTERNODES: &[(&str, &str)] = &[
    ("table2", "96.436·exp(−0.37·Ta) on the trunk, 68.525·exp(−0.33·Ta) elsewhere (paper)"),
    ("flat20", "20 in every year: the paper's mean of long shoots"),
];

/// Years that a named table covers.
const YEARS: u32 = 64;

/// Longest growth unit: a table may not ask for more.
const MOST: u32 = 10_000;

/// Internodes by state, order and year.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InternodeTable {
    /// From Ta = 0.
    trunk: Vec<u32>,
    long: Vec<u32>,
}

impl InternodeSource {
    /// The checked table.
    ///
    /// # Errors
    /// [`InternodeError`]: unknown name, shape or number.
    pub fn table(&self) -> Result<InternodeTable, InternodeError> {
        let rows = match self.rows()? {
            Err("table2") => {
                let column = |scale: f64, decay: f64| {
                    let exact = move |age| scale * libm::exp(-decay * f64::from(age));
                    (0..=YEARS).map(|age| (exact(age) + 0.5).floor().max(1.0) as u32).collect()
                };
                return Ok(InternodeTable { trunk: column(96.436, 0.37), long: column(68.525, 0.33) });
            }
            Err("flat20") => return Ok(InternodeTable { trunk: vec![20], long: vec![20] }),
            Err(name) => return Err(InternodeError::UnknownName { found: name.to_owned() }),
            Ok(rows) => rows,
        };
        let [trunk, long] = rows.as_ref() else { return Err(InternodeError::Rows { found: rows.len() }) };
        let column = |row: &Vec<u32>, of| match row.first() {
            None => Err(InternodeError::Empty { of }),
            Some(first) => match row.iter().find(|n| !(1..=MOST).contains(*n)) {
                Some(found) => Err(InternodeError::Number { of, found: *found }),
                // The year before the first, which only an offset asks for, is like the first.
                None => Ok(std::iter::once(*first).chain(row.iter().copied()).collect()),
            },
        };
        Ok(InternodeTable { trunk: column(trunk, "trunk")?, long: column(long, "other axes")? })
    }
}

impl InternodeTable {
    /// Internodes of a growth unit: `order` 0 is the trunk, `season` its birth counted from 1 (Ta), `long_age_offset` the years
    /// by which long shoots off the trunk count younger. At least one.
    pub fn internodes(&self, state: State, order: u32, season: u32, long_age_offset: u32) -> u32 {
        let (column, age) = match (state, order) {
            (State::Medium, _) => return 8,
            (State::Short, _) => return 1,
            (State::Floral, _) => return 3,
            (State::Long, 0) => (&self.trunk, season),
            (State::Long, _) => (&self.long, season.saturating_sub(long_age_offset)),
        };
        column.get(age as usize).or(column.last()).copied().unwrap_or(1)
    }
}

/// Why numbers do not form a table of internodes.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum InternodeError {
    /// The file that should hold it.
    #[error(transparent)]
    File(#[from] RowsError),
    /// No table has this name.
    #[error("no table of internodes is called `{found}`")]
    UnknownName {
        /// The name.
        found: String,
    },
    /// Not two rows.
    #[error("2 rows expected, found {found}")]
    Rows {
        /// Rows given.
        found: usize,
    },
    /// A row without numbers.
    #[error("a number a year expected for the {of}, found none")]
    Empty {
        /// Which row.
        of: &'static str,
    },
    /// Too few or too many internodes.
    #[error("1 to {MOST} internodes expected for the {of}, found {found}")]
    Number {
        /// Which row.
        of: &'static str,
        /// The number.
        found: u32,
    },
}

impl InternodeError {
    /// The same said of a key of the scene file.
    pub(crate) fn at(self, key: String) -> ParameterError {
        let names: Vec<&str> = NAMED_INTERNODES.iter().map(|(name, _)| *name).collect();
        let expected = format!(
            "one of {} or two rows (trunk; other axes) of internodes by year, here or in a file",
            names.join(", ")
        );
        ParameterError::new(key, expected, self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn internodes_are_those_of_the_rebuilt_table() {
        let table = InternodeSource::named("table2").table().unwrap();
        let of = |order, season| table.internodes(State::Long, order, season, 0);
        let trunk: Vec<u32> = (1..=11).map(|season| of(0, season)).collect();
        let long: Vec<u32> = (1..=11).map(|season| of(3, season)).collect();
        assert_eq!(trunk, [67, 46, 32, 22, 15, 10, 7, 5, 3, 2, 2]);
        assert_eq!(long, [49, 35, 25, 18, 13, 9, 7, 5, 4, 3, 2]);
        assert_eq!(table.internodes(State::Long, 1, 2, 1), 49);
        assert_eq!(table.internodes(State::Long, 0, 40, 0), 1);
    }

    #[test]
    fn a_table_of_ones_own_goes_on_with_its_last_year() {
        let table = InternodeSource::Inline(vec![vec![30, 20], vec![15]]).table().unwrap();
        let trunk: Vec<u32> = (1..=4).map(|season| table.internodes(State::Long, 0, season, 0)).collect();
        assert_eq!(trunk, [30, 20, 20, 20]);
        assert_eq!(table.internodes(State::Long, 2, 1, 3), 15);
        let refused = |rows: Vec<Vec<u32>>| InternodeSource::Inline(rows).table().unwrap_err();
        assert_eq!(refused(vec![vec![1]]), InternodeError::Rows { found: 1 });
        assert_eq!(refused(vec![vec![1], vec![]]), InternodeError::Empty { of: "other axes" });
        assert_eq!(refused(vec![vec![0], vec![1]]), InternodeError::Number { of: "trunk", found: 0 });
    }
}
