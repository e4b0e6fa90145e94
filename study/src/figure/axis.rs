//! Axes: where a value stands between two ends, and which values are marked.

/// Most stretches between the marks of an axis.
const MOST: f64 = 10.0;

/// An axis from its low end to its high end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Axis {
    from: f64,
    to: f64,
    is_logarithmic: bool,
}

impl Axis {
    pub(super) fn linear(from: f64, to: f64) -> Self {
        Self { from, to, is_logarithmic: false }
    }

    /// Both ends above zero.
    pub(super) fn logarithmic(from: f64, to: f64) -> Self {
        Self { from, to, is_logarithmic: true }
    }

    pub(super) fn from(self) -> f64 {
        self.from
    }

    /// How far along the axis a value stands: 0 at the low end, 1 at the high end.
    pub(super) fn share(self, value: f64) -> f64 {
        if self.is_logarithmic {
            (value / self.from).ln() / (self.to / self.from).ln()
        } else {
            (value - self.from) / (self.to - self.from)
        }
    }

    /// The values to mark: round ones, as many as have room.
    pub(super) fn marks(self) -> Vec<f64> {
        if !(self.to > self.from && self.from.is_finite() && self.to.is_finite()) {
            return Vec::new();
        }
        if self.is_logarithmic { self.powers() } else { self.steps() }
    }

    /// Equal steps of 1, 2 or 5 times a power of ten.
    fn steps(self) -> Vec<f64> {
        let least = (self.to - self.from) / MOST;
        let decade = 10_f64.powf(least.log10().floor());
        // Rounding must not make a step too small for its own marks.
        let step =
            [1.0, 2.0, 5.0].map(|times| times * decade).into_iter().find(|step| *step >= least * 0.999);
        let step = step.unwrap_or(10.0 * decade);
        let (first, last) = ((self.from / step - 1e-6).ceil(), (self.to / step + 1e-6).floor());
        (0..=(last - first).max(0.0) as u32).map(|k| step * (first + f64::from(k))).collect()
    }

    /// Powers of ten, with twice and five times each where there is room.
    fn powers(self) -> Vec<f64> {
        let decades = self.from.log10().floor() as i32..=self.to.log10().ceil() as i32;
        let of = |times: &[f64]| -> Vec<f64> {
            let all = decades.clone().flat_map(|decade| times.iter().map(move |n| n * 10_f64.powi(decade)));
            all.filter(|value| (0.999 * self.from..=1.001 * self.to).contains(value)).collect()
        };
        let fine = of(&[1.0, 2.0, 5.0]);
        if fine.len() as f64 <= MOST { fine } else { of(&[1.0]) }
    }
}

/// A number on an axis: as few digits as tell it.
pub(super) fn mark_of(value: f64) -> String {
    let rounded = (value * 1e6).round() / 1e6;
    if rounded == 0.0 { "0".to_owned() } else { rounded.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn marked(axis: Axis) -> Vec<String> {
        axis.marks().into_iter().map(mark_of).collect()
    }

    #[test]
    fn marks_are_round_and_have_no_empty_digits() {
        assert_eq!(marked(Axis::linear(0.0, 1.0)).join(" "), "0 0.1 0.2 0.3 0.4 0.5 0.6 0.7 0.8 0.9 1");
        assert_eq!(marked(Axis::linear(-0.5, 18.5)).join(" "), "0 2 4 6 8 10 12 14 16 18");
        assert_eq!(marked(Axis::linear(-5.8, 31.0)).join(" "), "-5 0 5 10 15 20 25 30");
        assert_eq!(marked(Axis::logarithmic(0.07, 12.0)).join(" "), "0.1 0.2 0.5 1 2 5 10");
        assert_eq!(marked(Axis::logarithmic(0.01, 1e4)).join(" "), "0.01 0.1 1 10 100 1000 10000");
        // An axis without length has nothing to mark.
        assert!(Axis::linear(1.0, 1.0).marks().is_empty() && Axis::linear(0.0, f64::NAN).marks().is_empty());
    }

    #[test]
    fn a_logarithm_gives_every_decade_the_same_room() {
        let axis = Axis::logarithmic(0.1, 100.0);
        let shares = [0.1, 1.0, 10.0, 100.0].map(|value| (3.0 * axis.share(value)).round());
        assert_eq!(shares, [0.0, 1.0, 2.0, 3.0]);
        assert_eq!(Axis::linear(-1.0, 3.0).share(0.0), 0.25);
    }
}
