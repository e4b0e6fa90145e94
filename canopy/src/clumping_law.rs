//! How a row's leaf area by wide beams hangs on how its leaves stand ([`Clumping`](crate::Clumping)).

use std::sync::LazyLock;

use rowscan_protocol::model::AnyModel;
use rowscan_protocol::optics::Optics;

/// What `rowscan study clumping --format csv` writes: columns beyond those read here tell how good a law is.
static TABLE: &str = include_str!("../clumping.csv");

/// How the leaf area by wide beams hangs on the measure, by a scanner's optics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClumpingLaw {
    /// The model whose optics it was fitted for.
    pub model: &'static str,
    /// ln of the factor where the measure is 1.
    pub constant: f64,
    /// Its slope over ln `closed`.
    pub slope: f64,
    /// Relative standard deviation of what it leaves, of training systems it was not fitted on.
    pub relative_sd: f64,
    /// Smallest and largest `closed` of the fitted rows; beyond, the end's value holds.
    pub fitted: [f64; 2],
}

impl ClumpingLaw {
    /// The law for a scanner of these optics, if one was fitted.
    pub fn of(optics: &Optics) -> Option<&'static Self> {
        static LAWS: LazyLock<Vec<ClumpingLaw>> = LazyLock::new(|| TABLE.lines().filter_map(read).collect());
        LAWS.iter().find(|law| AnyModel::by_name(law.model).is_some_and(|model| model.optics() == optics))
    }

    /// What raw leaf areas of a row are multiplied by whose leaves stand like this.
    pub fn factor(&self, closed: f64) -> f64 {
        let [low, high] = self.fitted;
        (self.constant + self.slope * closed.clamp(low, high).ln()).exp()
    }

    /// Whether rows were fitted whose leaves stand like this.
    pub fn holds(&self, closed: f64) -> bool {
        let [low, high] = self.fitted;
        (low..=high).contains(&closed)
    }
}

/// A law, of a line that holds one; remarks and heads do not.
fn read(line: &'static str) -> Option<ClumpingLaw> {
    let mut fields = line.split(',');
    let model = fields.next()?;
    let mut number = || fields.next()?.parse::<f64>().ok();
    Some(ClumpingLaw {
        model,
        constant: number()?,
        slope: number()?,
        relative_sd: number()?,
        fitted: [number()?, number()?],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_of_the_table_is_a_law_of_a_model() {
        for line in TABLE.lines().filter(|line| !line.starts_with('#')).skip(1) {
            let law = read(line).unwrap_or_else(|| panic!("no law: {line}"));
            let model = AnyModel::by_name(law.model).expect(line);
            assert_eq!(ClumpingLaw::of(model.optics()).map(|law| law.constant), Some(law.constant), "{line}");
            let [low, high] = law.fitted;
            assert!(low < high && high <= 1.0 && (0.0..0.3).contains(&law.relative_sd), "{line}");
        }
    }

    #[test]
    fn beyond_the_fitted_rows_the_end_holds() {
        let law =
            ClumpingLaw { model: "lms111", constant: 0.3, slope: 1.0, relative_sd: 0.1, fitted: [0.5, 0.8] };
        assert!((law.factor(0.6) - 0.6 * 0.3_f64.exp()).abs() < 1e-12);
        assert_eq!((law.factor(0.2), law.factor(0.99)), (law.factor(0.5), law.factor(0.8)));
        assert!(law.holds(0.5) && !law.holds(0.49));
    }
}
