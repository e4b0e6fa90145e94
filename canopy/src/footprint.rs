//! What a beam's width does to hits on leaves, so that estimators can take it out again.
//!
//! A ray meets a leaf if it passes through the leaf's projection K. A spot of radius R whose share on the leaf must reach τ meets it if its
//! centre lies in K grown by s = R m(τ), with m from a straight edge across a uniform disc: ½ − (m √(1 − m²) + asin m) / π = τ. The mean area
//! of a grown convex figure is Steiner's, A + P s + π s²; a shrunk one (s < 0) loses the corner term. So a canopy of leaves strewn at random
//! is hit as if it had I = 1 + (P s + π s |s|) / A times its density, A and P the mean projected area and outline of its leaves.
//!
//! Clumped leaves share their rims: I − 1 is multiplied by κ, the less the farther the rim reaches: κ = 1 / (1 + (R / c)³), c the size of a clump: a form
//! that fits simulated crowns.
//! Without clumps it is exact for convex leaves wider than the spot, strewn at random, one echo a beam.

use std::f64::consts::PI;

use rowscan_protocol::optics::{Optics, Spot};
use rowscan_protocol::rig::EchoChoice;

use crate::clumping_law::ClumpingLaw;
use crate::error::PipelineError;

/// A scanner's spot, what it takes for an echo, and the leaves it falls on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    /// The spot.
    pub spot: Spot,
    /// Least power that is detected, relative to a white wall at 1 m, square on.
    pub least_power: f64,
    /// Smallest share of a full echo that is reported, whatever the range; 0 without a filter of small pulses.
    pub least_share: f64,
    /// Its standard deviation.
    pub least_share_sd: f64,
    /// The leaves.
    pub leaf: LeafShape,
    /// The echo that is reported; `None` where nobody knows.
    pub echo: Option<EchoChoice>,
    /// Returns closer than this are one blended range, metres.
    pub merged_m: f64,
    /// κ of a spot much smaller than a clump of leaves: 1.
    pub clumping: f64,
    /// Size of a clump, metres: κ is half for a spot whose rim reaches that far. Infinite for leaves strewn at random.
    pub clump_m: f64,
    /// What the row's own scans say of its clumps, over κ; `None` where that was not fitted for such optics.
    pub law: Option<&'static ClumpingLaw>,
}

/// The glass that light passes on its way out and back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrontWindow {
    /// Share of the light that it lets through, one way; 1 where it is clean.
    pub transmission: f64,
    /// Its standard deviation.
    pub sd: f64,
}

impl Default for FrontWindow {
    /// Clean.
    fn default() -> Self {
        Self { transmission: 1.0, sd: 0.0 }
    }
}

impl FrontWindow {
    /// Share of the power that passes it twice.
    pub fn power(self) -> f64 {
        self.transmission * self.transmission
    }

    /// Relative standard deviation of that.
    pub fn power_sd(self) -> f64 {
        2.0 * self.sd / self.transmission
    }
}

/// The leaves of a canopy, on average.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeafShape {
    /// One-sided area, m².
    pub area_m2: f64,
    /// Length of the outline, metres.
    pub outline_m: f64,
    /// Share of light that comes back.
    pub reflectance: f64,
    /// Its standard deviation.
    pub reflectance_sd: f64,
    /// Mean cosine of incidence, weighted by projected area.
    pub cosine: f64,
}

impl Default for LeafShape {
    /// An apple leaf: 24 cm², an ellipse of axis ratio 0.6, reflectance at 905 nm as PROSPECT gives it.
    fn default() -> Self {
        Self { area_m2: 24e-4, outline_m: 0.1822, reflectance: 0.47, reflectance_sd: 0.0, cosine: 0.64 }
    }
}

impl LeafShape {
    /// The same leaf, larger or smaller.
    #[must_use]
    pub fn of_area(self, area_m2: f64) -> Self {
        Self { area_m2, outline_m: self.outline_m * (area_m2 / self.area_m2).sqrt(), ..self }
    }

    /// Mean projected area and outline, m² and m, for a projection function G: a turned plane figure's outline is on average π/4 of its own
    /// where its area is on average a half, and the two shrink together closely enough for the range of G that leaves have.
    fn projected(self, projection: f64) -> (f64, f64) {
        (projection * self.area_m2, PI / 4.0 * self.outline_m)
    }
}

impl Footprint {
    /// A scanner as its model has it, asked for the first echo, before tree crowns of such leaves.
    pub fn of(optics: &Optics, leaf: LeafShape) -> Self {
        let least_power = optics.least_power();
        let merged_m = optics.pulse.merged_m.value;
        let echo = Some(EchoChoice::First);
        let (clumping, clump_m) = (1.0, CROWN_CLUMP_M);
        Self {
            spot: optics.spot,
            least_power,
            least_share: 0.0,
            least_share_sd: 0.0,
            leaf,
            echo,
            merged_m,
            clumping,
            clump_m,
            law: ClumpingLaw::of(optics),
        }
    }

    /// The same behind this window: it takes more to be detected.
    #[must_use]
    pub fn behind(self, window: FrontWindow) -> Self {
        Self { least_power: (self.least_power / window.power()).min(1.0), ..self }
    }

    /// Refuses values no correction could be made with.
    ///
    /// # Errors
    /// The first value out of its range, by its key.
    pub fn validate(&self) -> Result<(), PipelineError> {
        PipelineError::check("footprint.spot", self.spot.nominal_m(1.0), 0.0, 0.5)?;
        PipelineError::check("footprint.least_power", self.least_power, 0.0, 1.0)?;
        PipelineError::check("footprint.least_share", self.least_share, 0.0, 1.0)?;
        PipelineError::check("footprint.least_share_sd", self.least_share_sd, 0.0, 1.0)?;
        PipelineError::check("footprint.leaf.area_m2", self.leaf.area_m2, 1e-6, 1.0)?;
        PipelineError::check("footprint.leaf.outline_m", self.leaf.outline_m, 1e-3, 10.0)?;
        PipelineError::check("footprint.leaf.reflectance", self.leaf.reflectance, 0.01, 1.0)?;
        PipelineError::check("footprint.leaf.cosine", self.leaf.cosine, 0.01, 1.0)?;
        PipelineError::check("footprint.merged_m", self.merged_m, 0.0, 10.0)?;
        PipelineError::check("footprint.clumping", self.clumping, 0.0, 2.0)?;
        PipelineError::check("footprint.clump_m", self.clump_m.min(MOST_CLUMP_M), 1e-3, MOST_CLUMP_M)
    }

    /// The share of the spot that a leaf must fill to be an echo: what the threshold asks for, P_min r² / (ρ cos i).
    pub fn threshold(&self, range_m: f64) -> f64 {
        let by_power = self.least_power * range_m * range_m / (self.leaf.reflectance * self.leaf.cosine);
        by_power.max(self.least_share).min(1.0)
    }

    /// I: how many times as often a leaf is met at this range as a ray would meet it. `projection` is G.
    pub fn inflation(&self, range_m: f64, projection: f64) -> f64 {
        let rim = self.rim(range_m, projection);
        // A spot that loses a leaf altogether cannot tell how many there are.
        (1.0 + rim.clumping * rim.share).max(LEAST_INFLATION)
    }

    /// Relative standard deviation of I, and of every density that is divided by it, by what κ differs between crowns.
    pub fn relative_sd(&self, range_m: f64, projection: f64) -> f64 {
        let rim = self.rim(range_m, projection);
        (CLUMPING_SD * rim.share.abs() / self.inflation(range_m, projection)).min(1.0)
    }

    /// Relative standard deviation of I by how well the smallest share is known that is an echo.
    pub fn least_share_relative_sd(&self, range_m: f64, projection: f64) -> f64 {
        let inflation = |least_share: f64| {
            Self { least_share: least_share.clamp(0.0, 1.0), ..*self }.inflation(range_m, projection)
        };
        let [fewer, more] =
            [self.least_share + self.least_share_sd, self.least_share - self.least_share_sd].map(inflation);
        // A share below 0 does not exist: there the whole difference lies on one side.
        let sides = if self.least_share < self.least_share_sd { 1.0 } else { 2.0 };
        (more - fewer).abs() / sides / self.inflation(range_m, projection)
    }

    fn rim(&self, range_m: f64, projection: f64) -> Rim {
        let (area_m2, outline_m) = self.leaf.projected(projection);
        let edge = match self.echo {
            Some(EchoChoice::Last) => -edge_shift(self.threshold(range_m)),
            Some(EchoChoice::First) | None => edge_shift(self.threshold(range_m)),
        };
        let shift_m = self.spot.radius_m(range_m) * edge;
        // A disc swept over a line of length b grows a figure by b times its width, on average outline / π, besides.
        let swept_m = self.spot.sweep_mrad.value * 1e-3 * range_m * edge.max(0.0);
        let rim_m2 = outline_m * shift_m + PI * shift_m * shift_m.abs();
        let share = (rim_m2 + swept_m * (outline_m / PI + 2.0 * shift_m)) / area_m2;
        let reach_m = self.spot.radius_m(range_m) + self.spot.sweep_mrad.value * 1e-3 * range_m / 2.0;
        let reach = (reach_m / self.clump_m).min(WIDEST_REACH);
        Rim { share, clumping: self.clumping / (1.0 + reach.powi(3)) }
    }

    /// How much farther than the nearest leaf a blended range lies on average, metres.
    ///
    /// Share is linear: a leaf that is met takes 1/I of the spot on average. The rest goes on as rays do, meets leaves at a rate λ, and what it
    /// meets within a pulse takes part in the power-weighted mean: at `1/λ − L / (e^(λL) − 1)` on average, for `1 − e^(−λL)` of the rest.
    pub fn delay_m(&self, range_m: f64, projection: f64) -> f64 {
        let first = 1.0 / self.inflation(range_m, projection).max(1.0);
        let depth = CROWN_RATE_PER_M * self.merged_m;
        if depth <= 0.0 {
            return 0.0;
        }
        let behind = (1.0 - first) * (1.0 - (-depth).exp());
        let behind_m = 1.0 / CROWN_RATE_PER_M - self.merged_m / depth.exp_m1();
        behind * behind_m / (first + behind)
    }
}

/// Leaves a metre of way that a ray would meet in a crown: 3 m² of leaves a cubic metre. The blend hangs little on it.
const CROWN_RATE_PER_M: f64 = 1.5;

/// What a leaf's rim adds to it.
#[derive(Clone, Copy, Debug)]
struct Rim {
    /// Area of the rim over the leaf's.
    share: f64,
    /// κ.
    clumping: f64,
}

/// Clumps of tree crowns: what takes the device optics of LMS111, TiM561 and LMS511 back to rays on simulated `spindle` rows, within 5 % from 2 m and 4 m
/// off (seeds 301, 302). `vase` rows ask for 9 to 18 % more, `fruiting_wall` rows for 12 to 35 % less.
const CROWN_CLUMP_M: f64 = 0.028;

/// Spots that reach farther, in clumps, are taken as this wide: nothing was tried there, and the canopy must not look thinner for a wider spot.
const WIDEST_REACH: f64 = 0.95;

/// Larger clumps are no clumps, metres.
const MOST_CLUMP_M: f64 = 1e6;

/// Standard deviation of κ between these models, distances and crowns.
const CLUMPING_SD: f64 = 0.15;

/// No correction multiplies by more than the inverse of this.
const LEAST_INFLATION: f64 = 0.05;

/// m(τ): how far, in radii, a spot's centre may stand off a straight edge for the share τ of it to lie beyond. 1 for a touch, 0 for a half.
fn edge_shift(share: f64) -> f64 {
    let beyond = |m: f64| 0.5 - (m * (1.0 - m * m).sqrt() + m.asin()) / PI;
    let (mut low, mut high) = (-1.0_f64, 1.0_f64);
    for _ in 0..50 {
        let middle = f64::midpoint(low, high);
        if beyond(middle) > share { low = middle } else { high = middle }
    }
    f64::midpoint(low, high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_protocol::optics::Fact;

    #[test]
    fn the_shift_is_that_of_a_disc_cut_by_an_edge() {
        // OPTICS 8.1: touch, 1 %, 6 %, 25 %, a half.
        for (share, shift) in [(0.0, 1.0), (0.01, 0.93), (0.06, 0.78), (0.25, 0.40), (0.5, 0.0)] {
            assert!((edge_shift(share) - shift).abs() < 0.006, "{share} {}", edge_shift(share));
        }
        assert!((edge_shift(0.75) + edge_shift(0.25)).abs() < 1e-9);
    }

    #[test]
    fn a_leaf_of_24_square_centimetres_under_an_lms1xx_at_1_4_metres_is_met_three_times_as_often() {
        let touch = Footprint {
            spot: lms1xx_spot(),
            least_power: 0.0,
            least_share: 0.0,
            least_share_sd: 0.0,
            leaf: LeafShape::default(),
            echo: Some(EchoChoice::First),
            merged_m: 0.0,
            clumping: 1.0,
            clump_m: f64::INFINITY,
            law: None,
        };
        // 12.0 cm² and 143 mm projected; +200 % with 0.9 of the nominal radius of 14.5 mm.
        assert!((touch.inflation(1.4, 0.5) - 3.0).abs() < 0.02, "{}", touch.inflation(1.4, 0.5));
        let quarter = Footprint { least_share: 0.25, ..touch };
        assert!((quarter.inflation(1.4, 0.5) - 1.0) < (touch.inflation(1.4, 0.5) - 1.0) * 0.5);
        let clumped = Footprint { clumping: 0.5, ..touch };
        assert!((clumped.inflation(1.4, 0.5) - 2.0).abs() < 0.02);
    }

    fn lms1xx_spot() -> Spot {
        Spot {
            exit_mm: Fact::assumed(8.0),
            divergence_mrad: Fact::assumed(15.0),
            sweep_mrad: Fact::assumed(0.0),
            effective: Fact::assumed(0.9),
        }
    }

    /// An LMS1xx before crowns.
    fn lms111() -> Footprint {
        Footprint {
            spot: lms1xx_spot(),
            least_power: 0.1 / (18.0 * 18.0),
            least_share: 0.0,
            least_share_sd: 0.0,
            leaf: LeafShape::default(),
            echo: Some(EchoChoice::First),
            merged_m: 1.0,
            clumping: 1.0,
            clump_m: CROWN_CLUMP_M,
            law: None,
        }
    }

    /// Measured: rows whose unit asks for 5, 10 and 15 % of the spot read 10, 18 and 23 % lower by contact than those of one that asks for nothing.
    #[test]
    fn a_unit_that_asks_for_a_share_of_the_spot_meets_fewer_leaves_and_not_to_know_it_costs_as_much() {
        let of = |least_share, least_share_sd| Footprint { least_share, least_share_sd, ..lms111() };
        let known = of(0.0, 0.0);
        assert_eq!(known.least_share_relative_sd(2.0, 0.5), 0.0);
        for (share, lost) in [(0.05, 0.05..0.16), (0.10, 0.10..0.25), (0.15, 0.15..0.35)] {
            let less = 1.0 - of(share, 0.0).inflation(2.0, 0.5) / known.inflation(2.0, 0.5);
            assert!(lost.contains(&less), "{share} {less}");
            let unknown = of(0.0, share).least_share_relative_sd(2.0, 0.5);
            assert!((unknown - less).abs() < 1e-12, "{share} {unknown}");
        }
        let about = of(0.10, 0.05).least_share_relative_sd(2.0, 0.5);
        assert!((0.02..0.15).contains(&about), "{about}");
    }

    #[test]
    fn a_wider_spot_never_looks_thinner_and_the_last_echo_loses_the_rim() {
        let eye = lms111();
        // But for the threshold, which takes rims away again.
        let touch = Footprint { least_power: 0.0, ..eye };
        let by_range: Vec<f64> = (1..120).map(|step| touch.inflation(f64::from(step) * 0.1, 0.5)).collect();
        assert!(by_range.iter().zip(by_range.iter().skip(1)).all(|(near, far)| far >= near), "{by_range:?}");
        let last = Footprint { echo: Some(EchoChoice::Last), ..eye };
        assert!(eye.inflation(2.0, 0.5) > 2.0 && last.inflation(2.0, 0.5) < 1.0);
        let strewn = Footprint { clump_m: f64::INFINITY, ..eye };
        assert!(strewn.inflation(4.0, 0.5) > 1.3 * eye.inflation(4.0, 0.5));
        assert!((0.02..0.2).contains(&eye.relative_sd(2.0, 0.5)), "{}", eye.relative_sd(2.0, 0.5));
    }

    #[test]
    fn a_blended_range_lies_behind_the_first_leaf_by_what_strewn_leaves_say() {
        // A spot that meets leaves at I λ; the first one takes 1/I of it, the rest meets the next ones at λ. Drawn from the same law, by hand.
        let eye = Footprint { clump_m: f64::INFINITY, ..lms111() };
        let first = 1.0 / eye.inflation(2.0, 0.5);
        let (mut power, mut moment) = (first, 0.0);
        let steps = 100_000;
        for step in 0..steps {
            let depth_m = (f64::from(step) + 0.5) / f64::from(steps);
            let density =
                (1.0 - first) * CROWN_RATE_PER_M * (-CROWN_RATE_PER_M * depth_m).exp() / f64::from(steps);
            power += density;
            moment += density * depth_m;
        }
        let delay_m = eye.delay_m(2.0, 0.5);
        assert!((delay_m - moment / power).abs() < 1e-4, "{delay_m} {}", moment / power);
        assert!((0.1..0.4).contains(&delay_m));
        let apart = Footprint { merged_m: 0.0, ..eye };
        assert_eq!(apart.delay_m(2.0, 0.5), 0.0);
    }
}
