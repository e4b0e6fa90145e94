//! What remission says of the share of a spot that leaves take.
//!
//! Share is linear: averaged over places, the share of a spot that falls on leaves is how often a ray would meet one, whatever the spot, its profile and
//! the clumping of the leaves. So hits that count by their share need no correction for rims. What they need is a remission that can be read: digits that go by the
//! logarithm of power, and what a leaf that fills the spot would return.

use rowscan_protocol::optics::{Optics, RemissionCurve};
use rowscan_protocol::rig::{CardReading, RemissionReading};

use crate::card_law::{CardMisfit, FirstCard};
use crate::error::PipelineError;
use crate::footprint::{FrontWindow, LeafShape};
use crate::uncertainty::combined;

/// How remission becomes the share of the spot that leaves took.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RemissionScale {
    /// Digits a factor of ten in power.
    pub digits_a_decade: f64,
    /// The most that counts, of a leaf's mean: a leaf that is square on.
    pub most: f64,
    /// Relative standard deviation of the power that a full leaf returns, as the card tells it; `None` where the curve is the model's, which is assumed.
    pub power_sd: Option<f64>,
    /// The same by what the rig says of leaves and window.
    pub rig_sd: f64,
    /// What leaves that fill the spot return, by range, nearest first; repeated at the end where there are fewer. Between two of them it goes by the
    /// logarithm of the range, beyond the ends it is that of the end.
    pub full: [Knot; Self::MOST_KNOTS],
    /// Why it is not gone by, if a card gives reason to doubt it; a model's curve gives none.
    pub doubt: Option<CardDoubt>,
}

/// Why a card is not gone by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CardDoubt {
    /// It was measured at too few ranges.
    TooShort,
    /// Other cards refute that remission goes by the logarithm of power.
    OtherLaw(CardMisfit),
}

/// What full leaves return at one range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Knot {
    /// Metres.
    pub range_m: f64,
    /// Remission, digits of the 8-bit scale.
    pub digits: f64,
}

impl RemissionScale {
    /// Ranges that a card can be measured at.
    pub const MOST_KNOTS: usize = 32;
    /// A card must be measured at so many at least, [`Self::LEAST_A_SIDE`] of them on each side of the near-field knee. Three readings at 1, 2 and 4 m miss
    /// the knee and give 43 % too much leaf area, eight are right within 5 %.
    pub const LEAST_READINGS: usize = 8;
    /// So many at least on each side of the knee.
    pub const LEAST_A_SIDE: usize = 3;
    /// Cards of so many reflectances, the first among them, test the law.
    pub const LEAST_CARDS: usize = 3;
    /// Neighbouring ranges of a card are at most this factor apart.
    pub const WIDEST_STEP: f64 = 1.5;

    /// As the scanner's model has it, before such leaves: assumed, as `rowscan models` says. `None` where remission does not tell power: a
    /// curve that compresses it to a tenth, or a scanner that sends none.
    pub fn of(optics: &Optics, leaf: LeafShape, window: FrontWindow) -> Option<Self> {
        let RemissionCurve::Logarithmic { digits_a_decade, .. } = optics.remission else { return None };
        let near_m = optics.near_field_m.value;
        let digits = |range_m: f64| {
            let near = (range_m / near_m).min(1.0);
            let power = window.power() * leaf.reflectance * leaf.cosine * (near / range_m).powi(2)
                / optics.least_power();
            1.0 + digits_a_decade.value * power.log10()
        };
        let knot = |range_m| [range_m, digits(range_m)];
        let full = knots(&[knot(near_m), knot(FARTHEST_M)])?;
        Some(Self {
            digits_a_decade: digits_a_decade.value,
            most: 1.0 / leaf.cosine,
            power_sd: None,
            rig_sd: combined([leaf.reflectance_sd / leaf.reflectance, window.power_sd()]),
            full,
            doubt: None,
        })
    }

    /// As the rig says that a scanner's remission is read.
    ///
    /// # Errors
    /// A model whose remission does not tell power, or a card without readings or with too many.
    pub fn read(
        reading: &RemissionReading,
        optics: &Optics,
        leaf: LeafShape,
        window: FrontWindow,
    ) -> Result<Self, PipelineError> {
        let by_model = Self::of(optics, leaf, window).ok_or(PipelineError::RemissionTellsNoPower)?;
        match reading {
            RemissionReading::Model => Ok(by_model),
            RemissionReading::Card { reflectance, digits_a_decade, readings, power_sd, others } => {
                PipelineError::check("rig.scanner.remission.reflectance", *reflectance, 0.01, 1.0)?;
                let leaves = digits_a_decade * (leaf.reflectance * leaf.cosine / reflectance).log10();
                let of_leaves: Vec<_> =
                    readings.iter().map(|[range_m, digits]| [*range_m, digits + leaves]).collect();
                let full = knots(&of_leaves)
                    .ok_or(PipelineError::CardReadings { most: Self::MOST_KNOTS, found: readings.len() })?;
                let most = 1.0 / leaf.cosine;
                let enough = enough(readings, optics.near_field_m.value);
                let mut scale = Self {
                    digits_a_decade: *digits_a_decade,
                    most,
                    power_sd: Some(*power_sd),
                    // The card was read through the same window.
                    rig_sd: leaf.reflectance_sd / leaf.reflectance,
                    full,
                    doubt: (!enough).then_some(CardDoubt::TooShort),
                };
                scale.validate()?;
                if !others.is_empty() {
                    test_others(others, *reflectance, readings)?;
                    let digits_at = |range_m| scale.full_digits(range_m) - leaves;
                    let (reflectance, digits_a_decade) = (*reflectance, *digits_a_decade);
                    let misfit =
                        CardMisfit::of(&FirstCard { reflectance, digits_at, digits_a_decade }, others);
                    let refuted = misfit.refutes_logarithm(digits_a_decade, *power_sd);
                    scale.doubt = scale.doubt.or(refuted.then_some(CardDoubt::OtherLaw(misfit)));
                }
                Ok(scale)
            }
        }
    }

    /// Refuses values that no share could be made with.
    ///
    /// # Errors
    /// The first value out of its range, by its key.
    pub fn validate(&self) -> Result<(), PipelineError> {
        let check = PipelineError::check;
        check("rig.scanner.remission.digits_a_decade", self.digits_a_decade, 1.0, 1e4)?;
        check("rig.scanner.remission.power_sd", self.power_sd.unwrap_or(0.0), 0.0, 10.0)?;
        check("remission.most", self.most, 1.0, 100.0)?;
        for knot in self.full {
            check("a range of rig.scanner.remission.readings", knot.range_m, 0.01, 1e3)?;
            check("a remission of rig.scanner.remission.readings", knot.digits, -1e4, 1e4)?;
        }
        let falls =
            self.full.iter().zip(self.full.iter().skip(1)).find(|(from, to)| to.range_m < from.range_m);
        falls.map_or(Ok(()), |(from, to)| {
            Err(PipelineError::CardOrder { before_m: from.range_m, found_m: to.range_m })
        })
    }

    /// What full leaves return at this range, digits.
    pub fn full_digits(&self, range_m: f64) -> f64 {
        let [first, ..] = self.full;
        let mut from = first;
        for to in self.full {
            if range_m <= to.range_m {
                let way = (to.range_m / from.range_m).ln();
                let part =
                    if way > 0.0 { ((range_m / from.range_m).ln() / way).clamp(0.0, 1.0) } else { 1.0 };
                return from.digits + part * (to.digits - from.digits);
            }
            from = to;
        }
        from.digits
    }
}

/// Refuses other cards that test nothing.
fn test_others(others: &[CardReading], first: f64, readings: &[[f64; 2]]) -> Result<(), PipelineError> {
    let mut reflectances: Vec<f64> = others.iter().map(|card| card.reflectance).chain([first]).collect();
    let [nearest_m, farthest_m] =
        [readings.first(), readings.last()].map(|end| end.map_or(0.0, |end| end[0]));
    for card in others {
        PipelineError::check("rig.scanner.remission.others.reflectance", card.reflectance, 0.001, 2.0)?;
        PipelineError::check("rig.scanner.remission.others.remission", card.remission, -1e4, 1e4)?;
        PipelineError::check("rig.scanner.remission.others.range_m", card.range_m, nearest_m, farthest_m)?;
    }
    reflectances.sort_by(f64::total_cmp);
    reflectances.dedup();
    let found = reflectances.len();
    if found < RemissionScale::LEAST_CARDS { Err(PipelineError::Cards { found }) } else { Ok(()) }
}

/// Whether a card was measured at enough ranges, dense enough, on both sides of the near-field knee.
fn enough(readings: &[[f64; 2]], knee_m: f64) -> bool {
    let before = readings.iter().filter(|[range_m, _]| *range_m < knee_m).count();
    let dense = readings
        .iter()
        .zip(readings.iter().skip(1))
        .all(|([from_m, _], [to_m, _])| to_m / from_m <= RemissionScale::WIDEST_STEP + 1e-9);
    readings.len() >= RemissionScale::LEAST_READINGS
        && before >= RemissionScale::LEAST_A_SIDE
        && readings.len() - before >= RemissionScale::LEAST_A_SIDE
        && dense
}

/// No orchard's leaf is farther away, metres.
const FARTHEST_M: f64 = 100.0;

/// Ranges and what leaves return there; None where there are none, or too many.
fn knots(readings: &[[f64; 2]]) -> Option<[Knot; RemissionScale::MOST_KNOTS]> {
    let knot = |[range_m, digits]: [f64; 2]| Knot { range_m, digits };
    let mut full = [knot(*readings.last()?); RemissionScale::MOST_KNOTS];
    if readings.len() > full.len() {
        return None;
    }
    full.iter_mut().zip(readings).for_each(|(place, reading)| *place = knot(*reading));
    Some(full)
}
