//! Interlaced scan modes: turns of the mirror whose beams lie between one another's, each a telegram of its own.

use super::{Model, ScanMode};
use crate::angle::{BeamGrid, exact_step_deg};

impl Model {
    /// What the mirror does in a scan mode: how often it turns, and how far its beams are apart in one turn.
    pub fn turn_of(&self, mode: ScanMode) -> ScanMode {
        self.turn.unwrap_or(mode)
    }

    /// How many turns a scan of this mode is interlaced of; 1 where each turn is a whole scan.
    pub fn turns_a_scan(&self, mode: ScanMode) -> u16 {
        let turns = exact_step_deg(self.turn_of(mode).step) / exact_step_deg(mode.step.max(1));
        (libm::round(turns) as u16).max(1)
    }

    /// The beams of turn number `turn` since power-up. The first turn of a sequence begins with the field; each one after begins a step of the mode later,
    /// and ends within the field: it has a beam less.
    pub fn beams_of_turn(&self, mode: ScanMode, turn: u64) -> BeamGrid {
        let place = (turn % u64::from(self.turns_a_scan(mode))) as i32;
        let start = self.start_angle + place * i32::from(mode.step);
        BeamGrid::spanning(start, self.stop_angle, self.turn_of(mode).step)
    }

    /// The beams of every turn of a sequence.
    pub fn grids(&self, mode: ScanMode) -> impl Iterator<Item = BeamGrid> + '_ {
        (0..u64::from(self.turns_a_scan(mode))).map(move |turn| self.beams_of_turn(mode, turn))
    }

    /// Whether a turn of some mode has `count` beams from `start` on.
    pub(crate) fn has_turn(&self, start: i32, count: usize) -> bool {
        let mut grids = self.modes.iter().flat_map(|&mode| self.grids(mode));
        grids.any(|grid| grid.start == start && grid.len() == count)
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use crate::model::all;

    #[test]
    fn the_turns_of_a_sequence_are_the_beams_of_the_mode_each_once() {
        let mut interlaced = 0;
        for model in all() {
            for &mode in model.modes {
                let turns = model.turns_a_scan(mode);
                interlaced += u16::from(turns > 1);
                let whole = model.beams(mode);
                let angles =
                    |grid: crate::angle::BeamGrid| (0..grid.len()).map(move |beam| grid.angle_deg(beam));
                let mut met: Vec<f64> = model.grids(mode).flat_map(angles).collect();
                met.sort_by(f64::total_cmp);
                assert_eq!(met.len(), whole.len(), "{} {mode:?}", model.name);
                assert!(met.iter().zip(angles(whole)).all(|(met, meant)| (met - meant).abs() < 1e-9));
                let turn = model.turn_of(mode);
                assert_eq!(
                    turn.frequency_centihz,
                    mode.frequency_centihz * u32::from(turns),
                    "{}",
                    model.name
                );
                // A sequence repeats.
                assert_eq!(model.beams_of_turn(mode, 0), model.beams_of_turn(mode, turns.into()));
            }
        }
        assert!(interlaced >= 2);
    }
}
