//! For people.

use super::{details, one_line};
use crate::verdict::{Tried, Verdict};

/// One scenario with one seed, in lines.
pub fn text(tried: &Tried) -> String {
    let mut text = String::new();
    let seed = tried.seed.map_or(String::new(), |seed| format!(", seed {seed}"));
    text += &format!(
        "{}{seed}: {:.1} s simulated in {:.1} s\n",
        tried.scenario.display(),
        tried.simulated_s,
        tried.wall_s
    );
    for note in tried.notes() {
        text += &format!("  note    {}\n", one_line(&note));
    }
    for case in &tried.cases {
        let word = match case.verdict {
            Verdict::Passed => "passed",
            Verdict::Skipped => "skipped",
            Verdict::Failed => "FAILED",
            Verdict::Error => "ERROR",
        };
        text += &format!("  {word:7} {}: {}\n", one_line(&case.name), one_line(&case.message));
        if case.verdict > Verdict::Skipped {
            details(case).iter().for_each(|line| text += &format!("          {line}\n"));
        }
    }
    text
}
