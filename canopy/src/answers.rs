//! What beams tell by direction: directions of which nothing is known along most of the row, and ground that answers no beam.
//!
//! Beams that are lost here and there leave densities what they are; what is lost in the same directions all along the row hides a part of it. And within a few
//! metres ground always answers: where a beam that the rig leads to it meets nothing, not even a leaf before it, the rig has the beam wrong.

use crate::geometry::{Beam, BeamTable, Frame, Reading};

/// A direction whose beams are unknown for more of their weight than this does not see the row.
const MOST: f64 = 0.5;
/// Directions that are told apart, from straight down to straight up.
const DIRECTIONS: usize = 360;
/// How far from the mirror ground answers, metres: dark soil under 15° and more, by a scanner that has a range of 18 m at 10 % remission.
const GROUND_ANSWERS_M: f64 = 6.0;
/// What lies so far below the ground that the rig tells is none of it, metres: a beam that ends there was led elsewhere.
const BELOW_M: f64 = 1.0;
/// Share of the directions to the ground that must answer: a dirty window, a wet spot and a post take some.
const LEAST_ANSWERS: f64 = 0.25;
/// The alley reaches so far to the row axis; crowns stand over the rest.
const ALLEY: f64 = 0.75;
/// Directions to the ground that tell something.
const LEAST_DIRECTIONS: u32 = 10;

/// Σ weight over the beams of a direction, metres.
#[derive(Clone, Copy, Debug, Default)]
struct Direction {
    all_m: f64,
    unknown_m: f64,
    missed_m: f64,
}

/// What the beams that look at the row met, by direction.
#[derive(Clone, Debug)]
pub(crate) struct Answers {
    directions: Vec<Direction>,
}

impl Default for Answers {
    fn default() -> Self {
        Self { directions: vec![Direction::default(); DIRECTIONS] }
    }
}

/// The directions that the rig leads to the ground where `there` says so: by how far from the mirror a beam ends, and how far across the row, metres. Each
/// direction once.
fn to_ground<'a>(
    table: &'a BeamTable,
    frame: &'a Frame,
    there: impl Fn(f64, f64) -> bool + 'a,
) -> impl Iterator<Item = usize> + 'a {
    let mut latest = None;
    table.beams().iter().flatten().filter_map(move |beam| {
        let (_, ends_m) = frame.above_clearance_m(beam);
        let direction = Some(number(beam)).filter(|_| there(ends_m, ends_m * beam.cos));
        let is_new = direction.is_some() && direction != latest;
        latest = direction.or(latest);
        direction.filter(|_| is_new)
    })
}

/// The direction of a beam.
fn number(beam: &Beam) -> usize {
    ((beam.theta_rad / core::f64::consts::PI + 0.5) * DIRECTIONS as f64).max(0.0) as usize
}

impl Answers {
    /// Adds a beam of a line with this weight; a return lies so high above the ground.
    pub(crate) fn add(&mut self, beam: &Beam, found: Reading, above_m: f64, weight_m: f64) {
        let Some(direction) = self.directions.get_mut(number(beam)) else { return };
        direction.all_m += weight_m;
        match found {
            Reading::Return if above_m < -BELOW_M => direction.missed_m += weight_m,
            Reading::Return => {}
            Reading::Miss => direction.missed_m += weight_m,
            Reading::Invalid => direction.unknown_m += weight_m,
        }
    }

    /// Share of the directions that look at the row and are unknown along most of it.
    pub(crate) fn unknown_share(&self) -> f64 {
        let looking = self.directions.iter().filter(|direction| direction.all_m > 0.0);
        let (all, unknown) = looking.fold((0_u32, 0_u32), |(all, unknown), direction| {
            (all + 1, unknown + u32::from(direction.unknown_m > MOST * direction.all_m))
        });
        f64::from(unknown) / f64::from(all.max(1))
    }

    /// Whether this table leads beams in enough directions to the ground of the alley, well before the row.
    pub(crate) fn leads_to_alley(table: &BeamTable, frame: &Frame) -> bool {
        let reach_m = ALLEY * frame.distance_m;
        to_ground(table, frame, |_, across_m| across_m < reach_m).count() >= LEAST_DIRECTIONS as usize
    }

    /// Share of the beams that met something, of those that this table leads to the ground before the row axis; `None` where it leads none there, and where
    /// enough met something.
    pub(crate) fn silent_ground(&self, table: &BeamTable, frame: &Frame) -> Option<f64> {
        let (mut directions, mut known_m, mut answered_m) = (0, 0.0, 0.0);
        let before_row = |ends_m, across_m| ends_m <= GROUND_ANSWERS_M && across_m < frame.distance_m;
        let led = to_ground(table, frame, before_row);
        for direction in led.filter_map(|number| self.directions.get(number)) {
            let beam_known_m = direction.all_m - direction.unknown_m;
            directions += u32::from(beam_known_m > 0.0);
            known_m += beam_known_m;
            answered_m += beam_known_m - direction.missed_m;
        }
        let share = answered_m / known_m;
        (directions >= LEAST_DIRECTIONS && share < LEAST_ANSWERS).then_some(share)
    }
}
