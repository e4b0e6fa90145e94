//! What came out.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::journal::Event;

/// The fact that bytes are held back beyond the steps of a clock in lockstep, by these faults.
pub(crate) const HELD_BACK: &str = "held_back_beyond_steps";
/// The fact that the run ended before its end, and how.
pub(crate) const ENDED_EARLY: &str = "ended_early";

/// The fact that nobody took scans for a while in lockstep, and when.
pub(crate) const GAP: &str = "gap";

/// The fact that a child slept by the host's time and held time in lockstep, and when.
pub(crate) const ASLEEP: &str = "asleep";

/// The fact that computing was measured, and the longest time.
pub(crate) const COMPUTE: &str = "compute_measured";

/// How late this machine wakes what waits.
pub(crate) const JITTER: &str = "jitter";

/// The fact that something in the scene's file should be known.
pub(crate) const WARNING: &str = "warning";

/// How one expectation ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// It holds.
    Passed,
    /// It was not judged, for a reason that is told.
    Skipped,
    /// The bench could not judge it.
    Error,
    /// It does not hold. That is known: nothing that could not be judged beside it takes it back.
    Failed,
}

/// One expectation of one run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Case {
    /// Unique within its scenario: number, words, seed.
    pub name: String,
    /// How it ended.
    pub verdict: Verdict,
    /// One line: expected, found.
    pub message: String,
    /// When it was decided, simulated seconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub t_s: Option<f64>,
    /// Where the tractor was, metres along the row.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub row_m: Option<f64>,
    /// The tree nearest to it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tree: Option<u32>,
    /// The last events until then, in words.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub last_events: Vec<String>,
    /// The command that runs it again.
    pub rerun: String,
    /// A picture of what was judged, in the run's folder.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub picture: Option<PathBuf>,
}

/// One scenario with one seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tried {
    /// The scenario's file.
    pub scenario: PathBuf,
    /// Name of its file without the ending.
    pub name: String,
    /// Its seed, if it came to run.
    pub seed: Option<u64>,
    /// Facts for the report: scene, clock.
    pub facts: Vec<(String, String)>,
    /// Its expectations.
    pub cases: Vec<Case>,
    /// What happened.
    pub events: Vec<Event>,
    /// The end of what its children wrote.
    pub output: String,
    /// Simulated seconds.
    pub simulated_s: f64,
    /// Host seconds.
    pub wall_s: f64,
}

impl Tried {
    /// A scenario that did not come to run, and why.
    pub fn unjudged(scenario: &Path, why: &str) -> Self {
        Self::of_one(scenario, "the scenario is sound", Verdict::Error, why)
    }

    /// A scenario that was being tried when all was told to end.
    pub fn interrupted(scenario: &Path) -> Self {
        let why = "interrupted: told to end while it ran, so nothing of it is judged";
        Self::of_one(scenario, "it runs to its end", Verdict::Error, why)
    }

    /// A scenario whose turn had not come when all was told to end.
    pub fn not_begun(scenario: &Path) -> Self {
        Self::of_one(
            scenario,
            "it runs to its end",
            Verdict::Skipped,
            "not begun: told to end before its turn",
        )
    }

    fn of_one(scenario: &Path, name: &str, verdict: Verdict, why: &str) -> Self {
        let case = Case {
            name: name.to_owned(),
            verdict,
            message: why.to_owned(),
            t_s: None,
            row_m: None,
            tree: None,
            last_events: Vec::new(),
            rerun: rerun(scenario, None),
            picture: None,
        };
        Self {
            scenario: scenario.to_owned(),
            name: name_of(scenario),
            seed: None,
            facts: Vec::new(),
            cases: vec![case],
            events: Vec::new(),
            output: String::new(),
            simulated_s: 0.0,
            wall_s: 0.0,
        }
    }

    /// What a reader of the verdicts should know beside them.
    pub(crate) fn notes(&self) -> Vec<String> {
        let note = |(fact, value): &(String, String)| match fact.as_str() {
            HELD_BACK => {
                Some(format!("{value}: bytes are held back beyond the steps of the clock in lockstep"))
            }
            JITTER => Some(format!("this machine wakes late: {value}")),
            COMPUTE => Some(format!(
                "computing was measured, up to {value} a step: the run does not repeat to the byte"
            )),
            ENDED_EARLY | GAP | ASLEEP => Some(value.clone()),
            _ => None,
        };
        self.facts.iter().filter_map(note).collect()
    }

    /// What the user should know of the scene's file.
    pub fn warnings(&self) -> impl Iterator<Item = &str> {
        self.facts.iter().filter(|(fact, _)| fact == WARNING).map(|(_, what)| what.as_str())
    }

    /// True if nothing failed and everything could be judged.
    pub fn is_fine(&self) -> bool {
        self.cases.iter().all(|case| case.verdict <= Verdict::Skipped)
    }
}

pub(crate) fn name_of(path: &Path) -> String {
    path.file_stem().map_or("scenario".to_owned(), |name| name.to_string_lossy().into_owned())
}

/// The command that runs a scenario again.
pub(crate) fn rerun(path: &Path, seed: Option<u64>) -> String {
    let seed = seed.map_or(String::new(), |seed| format!(" --seed {seed}"));
    format!("rowscan check {}{seed}", for_shell(&path.to_string_lossy()))
}

/// A word as a POSIX shell reads it back.
fn for_shell(word: &str) -> Cow<'_, str> {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "_-+=:,./@%".contains(c);
    match !word.is_empty() && word.chars().all(is_plain) {
        true => Cow::Borrowed(word),
        false => Cow::Owned(format!("'{}'", word.replace('\'', r"'\''"))),
    }
}

/// The verdict of all: the worst one.
pub fn worst<'a>(tried: impl IntoIterator<Item = &'a Tried>) -> Verdict {
    let verdicts = tried.into_iter().flat_map(|tried| tried.cases.iter().map(|case| case.verdict));
    verdicts.max().unwrap_or(Verdict::Error)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whatever else there is: a failure is a failure, and nothing that is unknown passes.
    #[test]
    fn a_failure_outweighs_what_could_not_be_judged_and_that_outweighs_the_rest() {
        use Verdict::{Error, Failed, Passed, Skipped};
        let all = [Passed, Skipped, Error, Failed];
        let of = |verdicts: &[Verdict]| {
            let tried = verdicts.iter().map(|verdict| Tried::of_one(Path::new("a.toml"), "it", *verdict, ""));
            worst(&tried.collect::<Vec<_>>())
        };
        for number in 0..64 {
            let verdicts = [all[number % 4], all[number / 4 % 4], all[number / 16]];
            let expected =
                [Failed, Error, Skipped, Passed].into_iter().find(|worse| verdicts.contains(worse));
            assert_eq!(Some(of(&verdicts)), expected, "{verdicts:?}");
        }
        assert_eq!(of(&[]), Error, "nothing was tried");
    }

    #[test]
    fn the_command_that_runs_it_again_survives_a_shell() {
        for (path, expected) in [
            ("a/b-1.toml", "rowscan check a/b-1.toml --seed 7"),
            ("d ir/a.toml", "rowscan check 'd ir/a.toml' --seed 7"),
            ("it's.toml", r"rowscan check 'it'\''s.toml' --seed 7"),
            ("$HOME/*.toml", "rowscan check '$HOME/*.toml' --seed 7"),
            ("Reihe-ä.toml", "rowscan check 'Reihe-ä.toml' --seed 7"),
        ] {
            assert_eq!(rerun(Path::new(path), Some(7)), expected);
        }
        assert_eq!(rerun(Path::new("a b"), None), "rowscan check 'a b'");
    }
}
