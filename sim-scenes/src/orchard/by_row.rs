//! Lists of places that hold for every row, or for each row its own.

use serde::{Deserialize, Serialize};

use crate::parameters::{ParameterError, require};

/// Places, counted from 0: `[3, 7]` for every row, or `[[3], [], [0, 7]]`, one list a row.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(untagged, expecting = "a list of places, or a list of such lists, one for every row")]
pub enum ByRow {
    /// The same in every row.
    Every(Vec<u32>),
    /// Row by row.
    Each(Vec<Vec<u32>>),
}

impl Default for ByRow {
    fn default() -> Self {
        Self::Every(Vec::new())
    }
}

impl From<Vec<u32>> for ByRow {
    fn from(places: Vec<u32>) -> Self {
        Self::Every(places)
    }
}

impl ByRow {
    /// Those of a row.
    pub fn of(&self, row: u32) -> &[u32] {
        match self {
            Self::Every(places) => places,
            Self::Each(rows) => rows.get(row as usize).map_or(&[], Vec::as_slice),
        }
    }

    /// True where no row has any.
    pub fn is_empty(&self) -> bool {
        match self {
            Self::Every(places) => places.is_empty(),
            Self::Each(rows) => rows.iter().all(Vec::is_empty),
        }
    }

    /// All lists, each for its row or for all.
    fn lists(&self) -> impl Iterator<Item = &[u32]> {
        let (every, each) = match self {
            Self::Every(places) => (Some(places.as_slice()), &[] as &[Vec<u32>]),
            Self::Each(rows) => (None, rows.as_slice()),
        };
        every.into_iter().chain(each.iter().map(Vec::as_slice))
    }

    fn has_rows(&self, key: &str, rows: u32) -> Result<(), ParameterError> {
        let Self::Each(each) = self else { return Ok(()) };
        let expected = format!("one list of places, or {rows} lists, one a row");
        require(each.len() == rows as usize, key, &expected, format!("{} lists", each.len()))
    }

    /// Checks that all are places of a row.
    pub(super) fn are_places(&self, key: &str, rows: u32, places: u32) -> Result<(), ParameterError> {
        self.has_rows(key, rows)?;
        match self.lists().flatten().find(|place| **place >= places) {
            None => Ok(()),
            Some(place) => {
                let expected = format!("places from 0 to {}", places.saturating_sub(1));
                Err(ParameterError::new(key, expected, place))
            }
        }
    }

    /// Checks that every list that is not empty holds each place once.
    pub(super) fn are_orders(&self, key: &str, rows: u32, places: u32) -> Result<(), ParameterError> {
        self.has_rows(key, rows)?;
        for list in self.lists().filter(|list| !list.is_empty()) {
            let mut sorted = list.to_vec();
            sorted.sort_unstable();
            if !sorted.iter().copied().eq(0..places) {
                let expected = format!("every number from 0 to {} once", places.saturating_sub(1));
                return Err(ParameterError::new(key, expected, format!("{list:?}")));
            }
        }
        Ok(())
    }
}
