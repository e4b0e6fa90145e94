//! Lines of a scan plane that leans, put upright: each beam's range goes to the line of the place where the beam crosses the row's middle.
//!
//! A line's place is where its plane crosses the row's middle at the height of the mirror: with a yaw that is ahead of the scanner, or behind it.
//! What a beam met nearer or farther than that lies off its new line by a little: the row puts each return at its own place along it
//! ([`crate::stray_returns`]). Beams whose place no line was at are left out there: near the ends of a drive some are. Where most of them are, nothing has been
//! scanned, and no line is given.

use std::collections::VecDeque;

use rowscan_protocol::angle::BeamGrid;

use crate::advance::Weighted;
use crate::beam_line::{BeamLine, KeptBeams};
use crate::geometry::{BeamTable, Frame};
use crate::looks::MOST_GRIDS;
use crate::parameters::AreaForm;

/// A line with more beams whose place no line was at has not been scanned: what stands there is not known, and not nothing.
const MOST_UNSEEN: f64 = 0.5;
/// Lines kept at most. A tractor that creeps has its lines put upright over less than all of its reach.
const MOST_LINES: usize = 2000;

/// Puts lines upright, as far behind the newest as beams reach ahead.
#[derive(Clone, Debug)]
pub(crate) struct Deskew {
    /// One a grid: turns of an interlaced scan have several.
    tables: Vec<BeamTable>,
    /// How far ahead of the scanner its plane crosses the row's middle.
    lead_m: f64,
    reach_m: f64,
    lines: VecDeque<Line>,
    /// The first that has not been given.
    next: usize,
    spare: Vec<KeptBeams>,
    upright: KeptBeams,
}

#[derive(Clone, Debug)]
struct Line {
    at: Weighted,
    grid: BeamGrid,
    beams: KeptBeams,
}

impl Deskew {
    /// Of a plane that meets the row's middle so far ahead of the scanner.
    pub(crate) fn new(lead_m: f64) -> Self {
        Self {
            tables: Vec::new(),
            lead_m,
            reach_m: 0.0,
            lines: VecDeque::new(),
            next: 0,
            spare: Vec::new(),
            upright: KeptBeams::default(),
        }
    }

    /// A line enters; gives lines that are complete to `row`.
    pub(crate) fn push(
        &mut self,
        frame: &Frame,
        line: &BeamLine<'_>,
        at: Weighted,
        row: &mut dyn FnMut(&BeamLine<'_>, Weighted),
    ) {
        if !(at.weight_m > 0.0 && at.y_m.is_finite()) {
            return;
        }
        if !self.tables.iter().any(|table| table.grid() == line.grid) {
            self.look(frame, line.grid, row);
        }
        let mut kept = self.spare.pop().unwrap_or_default();
        kept.keep(line);
        self.lines.push_back(Line { at, grid: line.grid, beams: kept });
        while let Some(next) = self.lines.get(self.next) {
            if next.at.y_m + self.reach_m > at.y_m && self.lines.len() < MOST_LINES {
                break;
            }
            self.give(row);
        }
    }

    /// A grid that is new. Turns of an interlaced scan begin elsewhere, with the same step; other grids are of another scan mode.
    fn look(&mut self, frame: &Frame, grid: BeamGrid, row: &mut dyn FnMut(&BeamLine<'_>, Weighted)) {
        let other_mode = self.tables.iter().any(|table| table.grid().step != grid.step);
        if other_mode || self.tables.len() >= MOST_GRIDS {
            self.flush(row);
            self.tables.clear();
            self.reach_m = 0.0;
        }
        let mut table = BeamTable::default();
        table.update(grid, frame, AreaForm::Midpoint);
        let shifts = table.beams().iter().flatten().map(|beam| (beam.shift_m - self.lead_m).abs());
        self.reach_m = shifts.fold(self.reach_m, f64::max);
        self.tables.push(table);
    }

    /// No more lines come.
    pub(crate) fn flush(&mut self, row: &mut dyn FnMut(&BeamLine<'_>, Weighted)) {
        while self.next < self.lines.len() {
            self.give(row);
        }
        self.spare.extend(self.lines.drain(..).map(|line| line.beams));
        self.next = 0;
    }

    /// The next line, upright.
    fn give(&mut self, row: &mut dyn FnMut(&BeamLine<'_>, Weighted)) {
        let Some((at, grid)) = self.lines.get(self.next).map(|line| (line.at, line.grid)) else { return };
        self.upright.clear();
        let Self { lines, upright, tables, lead_m, .. } = self;
        // So many lines apart are those with the same beams.
        let turns = tables.len();
        let table = tables.iter().find(|table| table.grid() == grid);
        let (mut aimed, mut unseen) = (0_usize, 0_usize);
        for (number, beam) in table.iter().flat_map(|table| table.beams()).enumerate() {
            let own = beam.as_ref().and_then(|beam| {
                let from_m = at.y_m + *lead_m - beam.shift_m;
                let after = lines.partition_point(|line| line.at.y_m < from_m);
                let near = (after.saturating_sub(turns)..after + turns).filter_map(|line| lines.get(line));
                let near = near.filter(|line| line.grid == grid);
                let off = |line: &Line| (line.at.y_m - from_m).abs();
                let nearest = near.min_by(|a, b| off(a).total_cmp(&off(b)));
                // A line that stands for this place.
                nearest.filter(|line| off(line) <= line.at.weight_m * turns as f64).map(|line| &line.beams)
            });
            aimed += usize::from(beam.is_some());
            unseen += usize::from(beam.is_some() && own.is_none());
            let of = |list: &[f64]| list.get(number).copied().unwrap_or(f64::NAN);
            upright.range_m.push(own.map_or(f64::NAN, |beams| of(&beams.range_m)));
            upright.share.push(own.map_or(f64::NAN, |beams| of(&beams.share)));
        }
        if unseen as f64 <= MOST_UNSEEN * aimed as f64 {
            let at = Weighted { y_m: at.y_m + self.lead_m, ..at };
            row(&self.upright.line(grid), at);
        }
        self.next += 1;
        let past = |line: &Line| line.at.y_m + self.reach_m + line.at.weight_m < at.y_m;
        while self.next > 0
            && self.lines.front().is_some_and(|line| past(line) || self.lines.len() >= MOST_LINES)
        {
            self.spare.extend(self.lines.pop_front().map(|line| line.beams));
            self.next -= 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_protocol::rig::{Mount, Rig};

    /// What each line holds of the number of the line that a range came from.
    fn upright(mount: &Mount, lines: u32) -> Vec<(f64, Vec<f64>)> {
        let frame = Frame::new(&Rig::default(), mount).unwrap();
        let grid = BeamGrid::spanning(300_000, 1_500_000, 60_000);
        let (mut deskew, mut found) = (Deskew::new(mount.meets_axis_m()), Vec::new());
        let mut take = |line: &BeamLine<'_>, at: Weighted| found.push((at.y_m, line.range_m.to_vec()));
        for number in 0..lines {
            let (y_m, range_m) = (f64::from(number) * 0.02, vec![1.0 + f64::from(number); grid.len()]);
            let line = BeamLine { grid, range_m: &range_m, share: &[] };
            deskew.push(&frame, &line, Weighted { y_m, weight_m: 0.02 }, &mut take);
        }
        deskew.flush(&mut take);
        found
    }

    #[test]
    fn each_beam_comes_from_the_line_that_crossed_the_row_there() {
        let mount = Mount { distance_m: 2.0, yaw_deg: 10.0, ..Mount::default() };
        let found = upright(&mount, 100);
        assert_eq!(found.len(), 100);
        // Each line lies where its level beam crosses the row: tan 10° · 2 m = 0.353 m ahead of the scanner.
        for (number, (y_m, line)) in found.iter().enumerate() {
            assert!((y_m - 0.02 * number as f64 - 0.3527).abs() < 1e-4, "{y_m}");
            assert_eq!(line[10], 1.0 + number as f64);
        }
    }

    /// A plane that leans so far that beams up and down cross the row far apart: at the ends only a few of a line were measured, and there is none.
    #[test]
    fn what_most_beams_have_not_seen_is_not_scanned() {
        let mount = Mount { distance_m: 2.0, pitch_deg: 60.0, roll_deg: 45.0, ..Mount::default() };
        let known = |(_, line): &(f64, Vec<f64>)| line.iter().filter(|range_m| !range_m.is_nan()).count();
        let aimed = upright(&mount, 500).iter().map(known).max().unwrap();
        let found = upright(&mount, 100);
        assert!((20..95).contains(&found.len()), "{}", found.len());
        assert!(found.iter().all(|line| 2 * known(line) >= aimed), "{aimed}: {found:?}");
    }

    #[test]
    fn a_pitch_parts_beams_up_and_down_and_leaves_the_level_one() {
        let mount = Mount { distance_m: 2.0, pitch_deg: 5.0, ..Mount::default() };
        let found = upright(&mount, 100);
        let line = &found[50].1;
        // Beams 5, 10 and 15 are at −30°, 0° and 30°; the tops lean back, so the upper beams of a later line cross here.
        assert_eq!(line[10], 51.0);
        let ahead = 2.0 * 30f64.to_radians().tan() * 5f64.to_radians().sin() / 0.02;
        assert!((line[15] - 51.0 - ahead).abs() <= 0.6 && (line[5] - 51.0 + ahead).abs() <= 0.6, "{line:?}");
    }
}
