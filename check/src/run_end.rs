//! When a run ended and why, as far as an expectation goes that it ended too early for.

use rowscan_protocol::time::SimTime;

/// The end of a run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RunEnd<'a> {
    /// When it was, simulated.
    pub(crate) at: SimTime,
    /// The child whose leaving ended it before its end was reached.
    pub(crate) left: Option<&'a str>,
}

impl RunEnd<'_> {
    /// That it came before `what`, and what to do.
    pub(crate) fn before(self, what: &str) -> String {
        format!("the run ended at {:.3} s, before {what}; {}", self.at.as_secs_f64(), self.remedy())
    }

    /// What makes the run longer: another end is of no use where a child ended it.
    pub(crate) fn remedy(self) -> String {
        match self.left {
            None => "move `end`".to_owned(),
            Some(child) => format!(
                "`{child}` had left at {:.3} s, the last child: have it stay longer, as `end` was not reached",
                self.at.as_secs_f64()
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_remedy_is_that_of_the_cause() {
        let at = SimTime(2_100_000_000);
        let reached = RunEnd { at, left: None };
        assert_eq!(reached.before("`x` was due"), "the run ended at 2.100 s, before `x` was due; move `end`");
        let left = RunEnd { at, left: Some("sut") }.before("`x` was due");
        assert!(left.contains("`sut` had left at 2.100 s") && !left.contains("move `end`"), "{left}");
    }
}
