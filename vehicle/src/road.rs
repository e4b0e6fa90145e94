//! The ground under the wheels: roughness by ISO 8608, and how a tractor on tyres follows it.
//!
//! Displacement has the spectral density G(n) = G(n0) (n / n0)^-2 in n cycles a metre, n0 = 0.1, from 0.05 to 1 cycles a metre: tyres roll over what is
//! shorter. Left and right wheels run on ground of their own; rear wheels in the tracks of the front ones. The tractor follows at once and stays
//! straight between its wheels: its own swinging at 1.5 to 3.5 Hz is left out.

use std::f64::consts::TAU;

use rowscan_protocol::random::Stream;
use serde::{Deserialize, Serialize};

use crate::parameter::{ParameterError, require_within};

/// Roughness by class, A to F \[MEM\]: G(n0) at the middle of the class, 1e-6 m³.
const CLASSES: [f64; 6] = [16.0, 64.0, 256.0, 1024.0, 4096.0, 16384.0];

/// Where G(n0) holds, cycles a metre.
const N0: f64 = 0.1;

/// What is rolled over, cycles a metre \[S27, MEM\].
const SHORTEST: f64 = 1.0;
/// The longest wave.
const LONGEST: f64 = 0.05;

/// Bands that the spectrum is made of, one wave each.
const BANDS: usize = 64;

/// Key of the random numbers.
const PURPOSE: u64 = 201;

/// Roughness class of ISO 8608.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub enum RoadClass {
    /// Very good.
    A,
    /// Good.
    B,
    /// Average.
    C,
    /// Poor: an orchard lane \[ASM\].
    D,
    /// Very poor: a worn one \[ASM\].
    E,
    /// A field.
    F,
}

/// The ground of a drive: table `[drive.road]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Road {
    /// Its roughness.
    #[schemars(example = &"D")]
    pub class: RoadClass,
    /// Between left and right wheels, metres.
    #[serde(default = "track_m")]
    pub track_m: f64,
    /// Between front and rear wheels, metres; the reference point is in the middle.
    #[serde(default = "wheelbase_m")]
    pub wheelbase_m: f64,
}

fn track_m() -> f64 {
    1.6
}

fn wheelbase_m() -> f64 {
    2.2
}

/// Up, roll and pitch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stance {
    /// Above level ground, metres.
    pub up_m: f64,
    /// Right side down, radians.
    pub roll_rad: f64,
    /// Nose up, radians.
    pub pitch_rad: f64,
}

impl Road {
    /// # Errors
    /// The first key with an invalid value.
    pub fn validate(&self) -> Result<(), ParameterError> {
        require_within("drive.road.track_m", self.track_m, 0.3, 10.0)?;
        require_within("drive.road.wheelbase_m", self.wheelbase_m, 0.3, 10.0)
    }

    /// The ground of a scene with this seed.
    pub fn ground(&self, seed: u64) -> Ground {
        let Self { track_m, wheelbase_m, .. } = *self;
        Ground { tracks: [0, 1].map(|side| Track::new(self.class, seed, side)), track_m, wheelbase_m }
    }
}

/// The ground along both tracks.
#[derive(Clone, Debug, PartialEq)]
pub struct Ground {
    /// Left, right.
    tracks: [Track; 2],
    track_m: f64,
    wheelbase_m: f64,
}

impl Ground {
    /// How the tractor stands after so many metres of way.
    pub fn stance(&self, way_m: f64) -> Stance {
        let half_m = self.wheelbase_m / 2.0;
        let [left, right] = self
            .tracks
            .each_ref()
            .map(|track| [way_m + half_m, way_m - half_m].map(|at_m| track.height_m(at_m)));
        let mean = |wheels: [f64; 2]| (wheels[0] + wheels[1]) / 2.0;
        let front_m = mean([left[0], right[0]]);
        let rear_m = mean([left[1], right[1]]);
        Stance {
            up_m: mean([front_m, rear_m]),
            roll_rad: libm::atan2(mean(left) - mean(right), self.track_m),
            pitch_rad: libm::atan2(front_m - rear_m, self.wheelbase_m),
        }
    }
}

/// A sum of waves, each with the variance of its band: normal amplitudes, so that heights are a normal process.
#[derive(Clone, Debug, PartialEq)]
struct Track(Vec<Wave>);

#[derive(Clone, Copy, Debug, PartialEq)]
struct Wave {
    cycles_per_m: f64,
    cosine_m: f64,
    sine_m: f64,
}

/// Variance that a class has between two wave numbers, m².
fn variance_m2(class: RoadClass, from: f64, to: f64) -> f64 {
    let rough = CLASSES.get(class as usize).copied().unwrap_or_default() * 1e-6;
    rough * N0 * N0 * (1.0 / from - 1.0 / to)
}

impl Track {
    fn new(class: RoadClass, seed: u64, side: u64) -> Self {
        let edge = |band: usize| LONGEST * libm::pow(SHORTEST / LONGEST, band as f64 / BANDS as f64);
        let waves = (0..BANDS).map(|band| {
            let (from, to) = (edge(band), edge(band + 1));
            let sigma_m = variance_m2(class, from, to).sqrt();
            let mut random = Stream::keyed(seed, &[PURPOSE, side, band as u64]);
            // Box and Muller: both amplitudes of one wave.
            let radius = (-2.0 * libm::log(1.0 - random.unit())).sqrt() * sigma_m;
            let turn = TAU * random.unit();
            let cycles_per_m = from + (to - from) * random.unit();
            Wave { cycles_per_m, cosine_m: radius * libm::cos(turn), sine_m: radius * libm::sin(turn) }
        });
        Self(waves.collect())
    }

    fn height_m(&self, at_m: f64) -> f64 {
        let heights = self.0.iter().map(|wave| {
            let angle = TAU * wave.cycles_per_m * at_m;
            wave.cosine_m * libm::cos(angle) + wave.sine_m * libm::sin(angle)
        });
        heights.sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CLASS: RoadClass = RoadClass::D;

    /// Power of heights about a wave number by a Hann-windowed transform over a stretch of ground, and the same of white frequencies.
    fn power(track: &Track, cycles_per_m: f64) -> f64 {
        let (length_m, step_m) = (100.0, 0.25);
        let count = (length_m / step_m) as usize;
        let (mut re, mut im, mut weights) = (0.0, 0.0, 0.0);
        for i in 0..count {
            let at_m = i as f64 * step_m;
            let window = 0.5 - 0.5 * (TAU * i as f64 / count as f64).cos();
            let height = window * track.height_m(at_m);
            re += height * (TAU * cycles_per_m * at_m).cos();
            im += height * (TAU * cycles_per_m * at_m).sin();
            weights += window * window;
        }
        // One-sided density, m³.
        2.0 * (re * re + im * im) * step_m / weights
    }

    #[test]
    fn the_density_of_the_ground_is_that_of_its_class() {
        // Over 40 roads and 5 wave numbers of an octave: 400 degrees of freedom and more; 4 sigma of chi-square is 4 sqrt(2 / 400).
        let tracks: Vec<Track> = (0..40).map(|seed| Track::new(CLASS, seed, 0)).collect();
        for octave in [0.08, 0.16, 0.32] {
            let numbers: Vec<f64> = (0..5).map(|i| octave * (1.0 + f64::from(i) / 5.0)).collect();
            let relative = numbers.iter().map(|n| {
                let expected = 1024e-6 * (n / N0).powi(-2);
                tracks.iter().map(|track| power(track, *n) / expected).sum::<f64>() / tracks.len() as f64
            });
            let mean = relative.sum::<f64>() / numbers.len() as f64;
            assert!((mean - 1.0).abs() < 4.0 * (2.0f64 / 400.0).sqrt(), "{octave}: {mean}");
        }
    }

    #[test]
    fn heights_and_angles_scatter_as_the_class_has_it() {
        let stances: Vec<Stance> = (0..60)
            .flat_map(|seed| {
                let ground = Road { class: CLASS, track_m: 1.6, wheelbase_m: 2.2 }.ground(seed);
                (0..20).map(move |i| ground.stance(f64::from(i) * 37.0))
            })
            .collect();
        let rms = |value: &dyn Fn(&Stance) -> f64| {
            (stances.iter().map(|stance| value(stance).powi(2)).sum::<f64>() / stances.len() as f64).sqrt()
        };
        // What a base between two wheels leaves of a wave is a closed form: cos² for the mean, sin² for the difference.
        let (mut mean, mut gap) = (0.0, 0.0);
        for i in 0..2000 {
            let n = LONGEST + (SHORTEST - LONGEST) * (f64::from(i) + 0.5) / 2000.0;
            let density = 1024e-6 * (n / N0).powi(-2) * (SHORTEST - LONGEST) / 2000.0;
            let half = std::f64::consts::PI * n * 2.2;
            mean += density * half.cos().powi(2);
            gap += density * half.sin().powi(2);
        }
        let (up, roll) = ((mean / 2.0).sqrt(), (2.0 * mean).sqrt() / 1.6);
        let pitch = (4.0 * gap / 2.0).sqrt() / 2.2;
        for (found, expected) in [
            (rms(&|stance| stance.up_m), up),
            (rms(&|stance| stance.roll_rad), roll),
            (rms(&|stance| stance.pitch_rad), pitch),
        ] {
            assert!((found / expected - 1.0).abs() < 0.1, "{found}, expected {expected}");
        }
    }

    #[test]
    fn the_same_seed_is_the_same_ground_and_standing_is_still() {
        let road = Road { class: RoadClass::B, track_m: 1.6, wheelbase_m: 2.2 };
        assert_eq!(road.ground(4).stance(3.3), road.ground(4).stance(3.3));
        assert_ne!(road.ground(4).stance(3.3), road.ground(5).stance(3.3));
        let quiet = Road { class: RoadClass::A, ..road };
        // The same waves, four times as dense in power.
        let ratio = Road { class: RoadClass::B, ..quiet.clone() }.ground(4).stance(3.3).up_m
            / quiet.ground(4).stance(3.3).up_m;
        assert!((ratio - 2.0).abs() < 1e-9, "{ratio}");
    }
}
