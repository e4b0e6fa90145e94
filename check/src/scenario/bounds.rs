//! What a number must be.

use crate::what::What;

/// What a number must be; all that are given.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bounds {
    /// Exactly this.
    pub equals: Option<f64>,
    /// More than this.
    pub above: Option<f64>,
    /// Less than this.
    pub below: Option<f64>,
    /// Nearer to 0 than this.
    pub abs_below: Option<f64>,
    /// Within these, both included.
    pub between: Option<(f64, f64)>,
    /// How far from `equals` it may be.
    pub tolerance: f64,
}

impl Bounds {
    /// True if there is none.
    pub fn is_empty(&self) -> bool {
        *self == Self { tolerance: self.tolerance, ..Self::default() }
    }

    /// True if `value` is within all of them.
    pub fn hold(&self, value: f64) -> bool {
        self.equals.is_none_or(|wanted| (value - wanted).abs() <= self.tolerance)
            && self.above.is_none_or(|least| value > least)
            && self.below.is_none_or(|most| value < most)
            && self.abs_below.is_none_or(|most| value.abs() < most)
            && self.between.is_none_or(|(least, most)| (least..=most).contains(&value))
    }

    /// In words.
    pub fn words(&self) -> String {
        let mut words = Vec::new();
        if let Some(equals) = self.equals {
            let near = if self.tolerance > 0.0 { format!(" ± {}", self.tolerance) } else { String::new() };
            words.push(format!("{equals}{near}"));
        }
        words.extend(self.above.map(|least| format!("above {least}")));
        words.extend(self.below.map(|most| format!("below {most}")));
        words.extend(self.abs_below.map(|most| format!("nearer to 0 than {most}")));
        words.extend(self.between.map(|(least, most)| format!("{least} to {most}")));
        words.join(", ")
    }

    /// Refuses bounds that decide nothing, whatever the run does: every value of what is expected keeps to them, or none.
    ///
    /// # Errors
    /// The bounds, and which values there are.
    pub(super) fn decide(&self, what: &What) -> Result<(), String> {
        let Some((least, most)) = what.reach().filter(|_| !self.is_empty()) else { return Ok(()) };
        let Bounds { equals, above, below, between, tolerance, .. } = *self;
        let broken = |value: f64| what.is_whole() && tolerance == 0.0 && value.fract() != 0.0;
        let never = equals.is_some_and(broken)
            || equals.is_some_and(|value| value + tolerance < least || value - tolerance > most)
            || above.is_some_and(|value| value >= most)
            || below.is_some_and(|value| value <= least)
            || between.is_some_and(|(low, high)| low > most || high < least);
        // Each of them is an interval: what both ends keep to, everything between does.
        let always = self.hold(least) && self.hold(most);
        // A percentage, where a share is meant.
        let beyond = most.is_finite() && between.is_some_and(|(low, high)| low < least || high > most);
        let who = match (never, always, beyond) {
            (true, ..) => "none of them does",
            (_, true, _) => "all of them do",
            (.., true) => "`between` reaches beyond them",
            (false, false, false) => return Ok(()),
        };
        let values =
            if most.is_finite() { format!("{least} to {most}") } else { format!("{least} and more") };
        Err(format!(
            "`{}` is {values}: expected bounds that some of these values keep to and others do not, found {}: {who}",
            what.name,
            self.words()
        ))
    }
}
