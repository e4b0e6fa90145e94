//! Blocks of neighbouring beams: what a much wider beam would have met that ends only where all of it does.

use crate::beam_line::BeamLine;
use crate::footprint::Footprint;
use crate::geometry::{Reading, reading};

/// Blocks of beams over two spots.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Closing {
    /// How wide a block is from the mirror, radians.
    width_rad: f64,
}

/// A block's width, in spots.
const SPOTS: f64 = 2.0;

impl Closing {
    /// For spots as wide as they are at the row plane.
    pub(crate) fn of(footprint: &Footprint, distance_m: f64) -> Self {
        Self { width_rad: SPOTS * 2.0 * footprint.spot.radius_m(distance_m) / distance_m }
    }

    /// The range of each beam's block, metres: that of its farthest return, no echo where one of its beams has none. Unknown beams say nothing.
    pub(crate) fn close<'a>(&self, line: &BeamLine<'a>) -> impl Iterator<Item = f64> + use<'a> {
        let steps = self.width_rad / line.grid.step_deg().to_radians();
        let block = if steps.is_finite() { (steps.round() as usize).max(1) } else { 1 };
        let range_m = line.range_m;
        (0..range_m.len()).map(move |beam| {
            let from = beam.saturating_sub(block / 2);
            let to = (beam + block - block / 2 + 1).min(range_m.len());
            let known = |range_m: &&f64| reading(**range_m) != Reading::Invalid;
            let beams = range_m.get(from..to).unwrap_or_default().iter();
            beams.filter(known).copied().reduce(f64::max).unwrap_or(f64::NAN)
        })
    }
}

#[cfg(test)]
mod tests {
    use rowscan_protocol::angle::BeamGrid;

    use super::*;

    const NONE: f64 = f64::INFINITY;

    fn closed(width: f64, range_m: &[f64]) -> Vec<f64> {
        let grid = BeamGrid { start: 0, step: 5000, count: range_m.len() as u16 };
        let closing = Closing { width_rad: width * grid.step_deg().to_radians() };
        closing.close(&BeamLine { grid, range_m, share: &[] }).collect()
    }

    #[test]
    fn what_fewer_beams_meet_than_a_block_has_is_passed_and_what_more_meet_ends_behind_it() {
        let lone = closed(2.0, &[NONE, NONE, 2.0, 2.1, NONE, NONE]);
        assert!(lone.iter().all(|range_m| *range_m == NONE), "{lone:?}");
        let wall = closed(2.0, &[NONE, 2.0, 2.1, 2.2, 2.3, 2.4, NONE]);
        assert_eq!(wall, [NONE, NONE, 2.2, 2.3, 2.4, NONE, NONE]);
    }

    #[test]
    fn beams_that_are_unknown_say_nothing() {
        assert_eq!(closed(2.0, &[f64::NAN, 2.0, f64::NAN])[1], 2.0);
        assert!(closed(2.0, &[f64::NAN; 3]).iter().all(|range_m| range_m.is_nan()));
    }
}
