//! Whether remission goes by the logarithm of power, as cards of several reflectances tell.
//!
//! One card tells the curve over range; how remission falls with the light that returns is assumed to be a logarithm. Other cards at ranges of the first
//! put that to the test: by each law the first card says what they should have read.

use rowscan_protocol::rig::CardReading;

/// How digits may go with power.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum CardLaw {
    /// So many digits a factor of ten.
    Logarithm,
    /// In proportion.
    Line,
    /// By the square root.
    Root,
}

/// How far cards are off each law, root mean square, digits of the 8-bit scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CardMisfit {
    /// The logarithm, as the rig has it.
    pub logarithm: f64,
    /// Digits in proportion to power.
    pub line: f64,
    /// Digits by the square root of power.
    pub root: f64,
}

/// The first card: its reflectance, and the digits it returns at a range.
pub(crate) struct FirstCard<F> {
    pub(crate) reflectance: f64,
    pub(crate) digits_at: F,
    pub(crate) digits_a_decade: f64,
}

impl CardLaw {
    /// What a card of `times` the light reads where the first reads `digits`.
    fn digits(self, digits: f64, times: f64, digits_a_decade: f64) -> f64 {
        match self {
            Self::Logarithm => digits + digits_a_decade * times.log10(),
            Self::Line => digits * times,
            Self::Root => digits * times.sqrt(),
        }
    }
}

impl CardMisfit {
    /// Of these cards, held against the first.
    pub(crate) fn of<F: Fn(f64) -> f64>(first: &FirstCard<F>, others: &[CardReading]) -> Self {
        let off = |law: CardLaw| {
            let squares = others.iter().map(|card| {
                let times = card.reflectance / first.reflectance;
                let expected = law.digits((first.digits_at)(card.range_m), times, first.digits_a_decade);
                (card.remission - expected).powi(2)
            });
            (squares.sum::<f64>() / others.len() as f64).sqrt()
        };
        Self { logarithm: off(CardLaw::Logarithm), line: off(CardLaw::Line), root: off(CardLaw::Root) }
    }

    /// Whether the logarithm is refuted: the cards are farther off it than `power_sd`, the relative standard deviation of a leaf's power that enters the
    /// interval, allows for twice.
    pub(crate) fn refutes_logarithm(&self, digits_a_decade: f64, power_sd: f64) -> bool {
        self.logarithm > digits_a_decade * (1.0 + 2.0 * power_sd).log10()
    }

    /// The law that fits best, in words.
    pub fn best(&self) -> &'static str {
        if self.logarithm <= self.line.min(self.root) {
            "no law that was tried fits better"
        } else if self.line < self.root {
            "a line fits better"
        } else {
            "a square root fits better"
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DECADE: f64 = 60.0;
    const FIRST: f64 = 0.5;

    fn first_digits(range_m: f64) -> f64 {
        190.0 - 120.0 * (range_m / 1.5).log10()
    }

    /// Cards of three reflectances at three ranges, read by `law`.
    fn cards(law: CardLaw, off: f64) -> Vec<CardReading> {
        let all =
            [0.05, 0.2, 0.9].into_iter().flat_map(|reflectance| [1.6, 2.2, 3.4].map(|r| (reflectance, r)));
        all.enumerate()
            .map(|(number, (reflectance, range_m))| CardReading {
                reflectance,
                range_m,
                remission: law.digits(first_digits(range_m), reflectance / FIRST, DECADE)
                    + if number % 2 == 0 { off } else { -off },
            })
            .collect()
    }

    fn misfit(law: CardLaw, off: f64) -> CardMisfit {
        let first = FirstCard { reflectance: FIRST, digits_at: first_digits, digits_a_decade: DECADE };
        CardMisfit::of(&first, &cards(law, off))
    }

    #[test]
    fn cards_of_a_logarithm_bear_it_out_and_those_of_another_law_refute_it() {
        for off in [0.0, 2.0] {
            let log = misfit(CardLaw::Logarithm, off);
            assert!((log.logarithm - off).abs() < 1e-9 && !log.refutes_logarithm(DECADE, 0.1), "{log:?}");
        }
        for (law, best) in
            [(CardLaw::Line, "a line fits better"), (CardLaw::Root, "a square root fits better")]
        {
            let other = misfit(law, 2.0);
            assert!(other.refutes_logarithm(DECADE, 0.1) && other.best() == best, "{law:?} {other:?}");
        }
        // A slope that is wrong by a quarter is one as well, though no other law is better.
        let first = FirstCard { reflectance: FIRST, digits_at: first_digits, digits_a_decade: 0.75 * DECADE };
        let steep = CardMisfit::of(&first, &cards(CardLaw::Logarithm, 0.0));
        assert!(steep.refutes_logarithm(0.75 * DECADE, 0.1), "{steep:?}");
        assert_eq!(steep.best(), "no law that was tried fits better");
    }

    #[test]
    fn who_knows_less_of_the_power_bears_more() {
        let misfit = misfit(CardLaw::Logarithm, 6.0);
        assert!(misfit.refutes_logarithm(DECADE, 0.1) && !misfit.refutes_logarithm(DECADE, 0.2));
    }
}
