//! How fast the picture itself moves: what changes from scan to scan, over what changes in a lag of scans.
//!
//! The share of beams that change grows with the way between two scans, and less and less: of a slow drive neighbours differ by a smaller part of what a lag
//! changes than of a fast one (past rows of six training systems at 0.3 times the speed 0.5 to 0.6 times as much, without wind; 0.6 to 0.8 times in 5 m/s).
//! How much there is that can change, leaves or gaps, is in both and cancels. An encoder that misses most of its ticks for a while tells a slow drive there,
//! and the picture goes on at its pace.

use std::collections::VecDeque;

/// Steps of speed a doubling.
const STEPS_PER_DOUBLING: f64 = 4.0;
/// The slowest and the number of steps: from 1/128 of the rig's speed to 16 times it.
const SLOWEST: f64 = 1.0 / 128.0;
const STEPS: usize = 44;
/// From so many times the usual speed to so many, a drive counts as usual.
const USUAL: (f64, f64) = (0.8, 1.25);
/// Speeds by the encoder, of the faster one, at which the picture must be slower, and how far neighbours may lie apart at the faster one, metres: where
/// that is more than a leaf, half the speed changes little (`tall_spindle`, 60 mm: a third of the speed 0.93 times the ratio). Below, it nearly stands,
/// which is told elsewhere.
const SLOWER: [((f64, f64), f64); 4] =
    [((0.03, 0.0625), 0.075), ((0.0625, 0.125), 0.075), ((0.125, 0.25), 0.075), ((0.25, 0.5), 0.045)];
/// A slow picture has less than so much of the ratio at the faster speed.
const BORDER: f64 = 0.92;
/// The smallest ratio at the faster speed that tells something. Below, leaves move faster than the scanner does, or scans follow each other within a leaf.
const LEAST_RATIO: f64 = 0.35;
/// The largest: above, all changes from scan to scan.
const MOST_RATIO: f64 = 0.75;
/// Pairs of a speed that tell something, and what a lag must change there, at least and of what it changes at the other speed.
const LEAST_PAIRS: u32 = 30;
const LEAST_SHARE: f64 = 0.01;
const LEAST_OF_OTHER: f64 = 0.5;

/// Where the ends of a way are less of its length apart, the tractor came back.
const STRAIGHT: f64 = 0.95;

/// Pairs a lag apart: how many, Σ of what a lag changed, Σ of what neighbours within it did on average, and Σ of the way between those, metres.
#[derive(Clone, Copy, Debug, Default)]
struct Pairs {
    count: u32,
    lag: f64,
    neighbours: f64,
    neighbours_m: f64,
}

impl Pairs {
    fn plus(self, other: Self) -> Self {
        Self {
            count: self.count + other.count,
            lag: self.lag + other.lag,
            neighbours: self.neighbours + other.neighbours,
            neighbours_m: self.neighbours_m + other.neighbours_m,
        }
    }

    /// What a lag changes on average.
    fn mean_lag(self) -> f64 {
        self.lag / f64::from(self.count)
    }

    fn ratio(self) -> f64 {
        self.neighbours / self.lag
    }

    fn tell(self) -> bool {
        self.count >= LEAST_PAIRS && self.mean_lag() >= LEAST_SHARE
    }
}

/// What the picture did at each speed by the encoder.
#[derive(Clone, Debug)]
pub(crate) struct PictureSpeed {
    /// Scans to a lag.
    lag: usize,
    /// Of the latest neighbours, the oldest first, the way between them by the encoder, metres, and what changed; not a number where that is unknown.
    neighbours: VecDeque<(f64, f64)>,
    at_speed: [Pairs; STEPS],
}

impl PictureSpeed {
    /// Of pairs so many scans apart.
    pub(crate) fn of_lag(lag: usize) -> Self {
        Self { lag, neighbours: VecDeque::with_capacity(lag), at_speed: [Pairs::default(); STEPS] }
    }

    /// The next scan is so far from the one before, and so much changed.
    pub(crate) fn add_neighbours(&mut self, way_m: f64, changed: Option<f64>) {
        if self.neighbours.len() >= self.lag {
            self.neighbours.pop_front();
        }
        self.neighbours.push_back((way_m, changed.unwrap_or(f64::NAN)));
    }

    /// The next scan has no neighbour.
    pub(crate) fn forget_neighbours(&mut self) {
        self.neighbours.clear();
    }

    /// The latest scan and that a lag before are so far apart, at so many times the rig's speed by the encoder, and so much changed.
    pub(crate) fn add(&mut self, speed: f64, apart_m: f64, lag: f64) {
        let (way_m, sum) = self
            .neighbours
            .iter()
            .fold((0.0, 0.0), |(way_m, sum), (part_m, share)| (way_m + part_m, sum + share));
        // Of a way that came back, neighbours tell the way and the pair does not.
        if self.neighbours.len() < self.lag || sum.is_nan() || apart_m < STRAIGHT * way_m {
            return;
        }
        let (neighbours, neighbours_m) = (sum / self.lag as f64, way_m / self.lag as f64);
        let step = ((speed / SLOWEST).log2() * STEPS_PER_DOUBLING).floor();
        let pairs = (step >= 0.0).then(|| self.at_speed.get_mut(step as usize)).flatten();
        pairs
            .into_iter()
            .for_each(|pairs| *pairs = pairs.plus(Pairs { count: 1, lag, neighbours, neighbours_m }));
    }

    /// Those from one speed to another, each step by its middle.
    fn between(&self, (least, most): (f64, f64)) -> Pairs {
        let middle = |step: usize| SLOWEST * ((step as f64 + 0.5) / STEPS_PER_DOUBLING).exp2();
        let steps = self.at_speed.iter().enumerate();
        let within = steps.filter(|(step, _)| (least..=most).contains(&middle(*step)));
        within.map(|(_, pairs)| *pairs).fold(Pairs::default(), Pairs::plus)
    }

    /// Pairs at which the encoder tells another speed than the usual one, of so many times the rig's, and the picture does not.
    pub(crate) fn refuting(&self, usual: f64) -> u64 {
        let scaled = |(least, most): (f64, f64), by: f64| (least * by, most * by);
        let usually = self.between(scaled(USUAL, usual));
        let mut refuting = 0;
        for ((least, most), farthest_m) in SLOWER {
            let slower = self.between(scaled((least, most), usual));
            refuting += if is_as_fast(usually, slower, farthest_m) { u64::from(slower.count) } else { 0 };
            // Most of the way may be what it misses ticks of: then it tells a faster drive where it is in order.
            let faster = self.between(scaled((1.0 / most, 1.0 / least), usual));
            refuting += if is_as_fast(faster, usually, farthest_m) { u64::from(faster.count) } else { 0 };
        }
        refuting
    }
}

/// Whether the picture is as fast in `slower` as in `faster`, where that can be told: with neighbours no farther apart in the faster one.
fn is_as_fast(faster: Pairs, slower: Pairs, farthest_m: f64) -> bool {
    let can_be_told = faster.tell()
        && slower.tell()
        && (LEAST_RATIO..=MOST_RATIO).contains(&faster.ratio())
        && faster.neighbours_m <= farthest_m * f64::from(faster.count)
        && slower.mean_lag() >= LEAST_OF_OTHER * faster.mean_lag();
    can_be_told && slower.ratio() > BORDER * faster.ratio()
}
