//! How many tests passed, failed and were skipped, as the test runners' closing lines say.

use std::fmt;
use std::ops::AddAssign;

/// Numbers of tests.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    pub passed: u32,
    pub failed: u32,
    pub skipped: u32,
}

impl Counts {
    /// Reads a closing line of libtest (`test result: ok. 3 passed; 0 failed; 1 ignored; …`).
    pub fn from_libtest(line: &str) -> Option<Self> {
        let words = line.trim_start().strip_prefix("test result: ")?;
        Some(Self::from_words(words))
    }

    /// Reads a closing line of pytest (`===== 3 passed, 1 skipped in 0.51s =====`, also without the rulers).
    pub fn from_pytest(line: &str) -> Option<Self> {
        let words = line.trim().trim_matches('=').trim();
        let (counts, time) = words.rsplit_once(" in ")?;
        let seconds = time.split_whitespace().next()?.strip_suffix('s')?;
        seconds.parse::<f64>().ok()?;
        Some(Self::from_words(counts))
    }

    /// Reads a closing line of ours (`3 passed, 0 failed, 1 skipped`).
    pub fn from_total(line: &str) -> Option<Self> {
        let counts = Self::from_words(line);
        (counts.to_string() == line.trim()).then_some(counts)
    }

    /// Sums `N word` pairs; words nobody knows (`measured`, `deselected`, `warnings`) count nowhere.
    fn from_words(text: &str) -> Self {
        let mut counts = Self::default();
        let words: Vec<&str> =
            text.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()).collect();
        for pair in words.windows(2) {
            let Ok(number) = pair[0].parse::<u32>() else { continue };
            match pair[1] {
                "passed" | "xpassed" => counts.passed += number,
                "failed" | "error" | "errors" => counts.failed += number,
                "skipped" | "ignored" | "xfailed" => counts.skipped += number,
                _ => {}
            }
        }
        counts
    }
}

impl AddAssign for Counts {
    fn add_assign(&mut self, other: Self) {
        self.passed += other.passed;
        self.failed += other.failed;
        self.skipped += other.skipped;
    }
}

impl fmt::Display for Counts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} passed, {} failed, {} skipped", self.passed, self.failed, self.skipped)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn libtest_closing_lines() {
        let line = "test result: FAILED. 12 passed; 2 failed; 1 ignored; 0 measured; 7 filtered out; finished in 0.01s";
        assert_eq!(Counts::from_libtest(line), Some(Counts { passed: 12, failed: 2, skipped: 1 }));
        assert_eq!(Counts::from_libtest("test frame::tests::resync ... ok"), None);
    }

    #[test]
    fn pytest_closing_lines() {
        let line = "==== 1 failed, 12 passed, 3 skipped, 1 error, 2 warnings in 3.51s ====";
        assert_eq!(Counts::from_pytest(line), Some(Counts { passed: 12, failed: 2, skipped: 3 }));
        assert_eq!(Counts::from_pytest("9 passed in 61.20s (0:01:01)").map(|counts| counts.passed), Some(9));
        assert_eq!(Counts::from_pytest("collected 9 items in the folder"), None);
    }
}
