//! What the estimates of a row say of themselves: which leaf areas they withhold, and what they warn of. A study's table has its numbers without a word of it.

use std::collections::BTreeMap;
use std::fmt;
use std::ops::AddAssign;

use rowscan_canopy::{Estimate, Warning};
use serde::{Deserialize, Serialize};

/// Warnings that say what every simulated row has: they warn of no error.
pub(crate) const ALWAYS: [&str; 1] = ["remission_assumed"];

/// Counts over estimates, by code. Prints as a sentence; empty where there is nothing to say.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RowNotes {
    /// Estimates.
    pub estimates: u64,
    /// Estimates that withhold the leaf area, by why.
    pub withheld: BTreeMap<String, u64>,
    /// Estimates that warn, by of what.
    pub warned: BTreeMap<String, u64>,
}

impl RowNotes {
    /// Notes what this estimate says.
    pub fn add(&mut self, estimate: &Estimate) {
        self.estimates += 1;
        if let Some(why) = withheld(estimate) {
            *self.withheld.entry(why.to_owned()).or_default() += 1;
        }
        for code in warnings(estimate) {
            *self.warned.entry(code.to_owned()).or_default() += 1;
        }
    }
}

impl AddAssign<&Self> for RowNotes {
    fn add_assign(&mut self, other: &Self) {
        self.estimates += other.estimates;
        for (all, more) in [(&mut self.withheld, &other.withheld), (&mut self.warned, &other.warned)] {
            more.iter().for_each(|(code, count)| *all.entry(code.clone()).or_default() += count);
        }
    }
}

impl fmt::Display for RowNotes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let parts = [("withheld", &self.withheld), ("warned", &self.warned)];
        let parts = parts.into_iter().filter(|(_, counts)| !counts.is_empty()).map(|(what, counts)| {
            let counts: Vec<String> = counts.iter().map(|(code, count)| format!("{code} {count}")).collect();
            format!("{what}: {}", counts.join(", "))
        });
        let parts: Vec<String> = parts.collect();
        if parts.is_empty() {
            return Ok(());
        }
        write!(f, "of {} estimates, {}", self.estimates, parts.join("; "))
    }
}

/// Why the leaf area of the row is withheld, as a code; none where it is told.
pub fn withheld(estimate: &Estimate) -> Option<&'static str> {
    estimate.leaf.areas.best_m2().err().map(|why| why.code())
}

/// The codes of an estimate's warnings, each once: of all but what every simulated row has.
pub fn warnings(estimate: &Estimate) -> Vec<&'static str> {
    let mut codes = Warning::codes(&estimate.warnings);
    codes.retain(|code| !ALWAYS.contains(code));
    codes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_add_up_and_nothing_is_said_of_rows_without_a_note() {
        let of = |withheld: &[(&str, u64)], warned: &[(&str, u64)]| {
            let counts =
                |counts: &[(&str, u64)]| counts.iter().map(|(code, n)| ((*code).to_owned(), *n)).collect();
            RowNotes { estimates: 2, withheld: counts(withheld), warned: counts(warned) }
        };
        let mut all = of(&[], &[]);
        assert_eq!(all.to_string(), "");
        all += &of(&[("mostly_wood", 1)], &[("b", 1)]);
        all += &of(&[("mostly_wood", 2)], &[("a", 1), ("b", 2)]);
        assert_eq!(all.to_string(), "of 6 estimates, withheld: mostly_wood 3; warned: a 1, b 3");
    }
}
