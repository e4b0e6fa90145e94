//! How much of the row each scan line stands for.
//!
//! Line i weighs half the way from the line before plus half the way to the line after, w_i = (y_{i+1} − y_{i−1})/2, so a
//! lost line's place is taken by its neighbours. The outer half of the first and of the last line is half a *step*: the way
//! to its neighbour, a telegram. N lines Δy apart therefore weigh N·Δy in all, and so they do with lines lost between.
//! Where the tractor goes back, its lines add nothing until it is beyond where it was: a tree driven over twice is one tree.
//! A gap of more than `max_gap_steps` steps is not filled: each side keeps half of `max_gap_steps` steps.
//! A weight is known when the next line is, so lines lag by one.

use rowscan_protocol::counting::Link;

/// Weighs lines, one behind.
#[derive(Clone, Debug)]
pub(crate) struct Advance {
    max_gap_steps: f64,
    /// The way is told no finer than this, metres.
    resolution_m: f64,
    first_y_m: Option<f64>,
    last_y_m: Option<f64>,
    open: Option<OpenLine>,
    /// Way a telegram, as the last countable link had it.
    step_m: Option<f64>,
    gaps: u64,
    unfilled_m: f64,
}

#[derive(Clone, Copy, Debug)]
struct OpenLine {
    y_m: f64,
    /// Half the way to the line before; None for the first line, whose outer half needs its neighbour.
    before_m: Option<f64>,
}

/// What became of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Step {
    /// It is open; the one before has its weight, if there was one.
    Opened(Option<Weighted>),
    /// It lies behind the open line: that stretch of row has been counted, the tractor came back over it.
    Behind,
}

/// A line whose weight is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Weighted {
    pub(crate) y_m: f64,
    pub(crate) weight_m: f64,
}

impl Advance {
    pub(crate) fn new(max_gap_steps: f64) -> Self {
        Self {
            max_gap_steps,
            resolution_m: 0.0,
            first_y_m: None,
            last_y_m: None,
            open: None,
            step_m: None,
            gaps: 0,
            unfilled_m: 0.0,
        }
    }

    /// The way is told in steps of this length from now on, metres: lines so far apart are neighbours.
    pub(crate) fn resolve(&mut self, resolution_m: f64) {
        self.resolution_m = resolution_m;
    }

    /// A line at `y_m` opens; gives the one before with its weight. `nominal_step_m` is the way a telegram by the stated
    /// frequency, for where no step was seen yet.
    pub(crate) fn next(&mut self, y_m: f64, link: Link, nominal_step_m: f64) -> Step {
        self.last_y_m = Some(y_m);
        let Some(open) = self.open else {
            self.first_y_m.get_or_insert(y_m);
            self.open = Some(OpenLine { y_m, before_m: None });
            return Step::Opened(None);
        };
        if y_m < open.y_m {
            return Step::Behind;
        }
        let way_m = y_m - open.y_m;
        if let Link::Steps(steps) = link {
            self.step_m = Some(way_m / f64::from(steps.max(1)));
        }
        let step_m = self.known_step_m(nominal_step_m);
        let filled_m = if way_m > self.longest_m(nominal_step_m) {
            let longest_m = (self.max_gap_steps * step_m).max(self.resolution_m);
            self.gaps += 1;
            self.unfilled_m += way_m - longest_m;
            longest_m
        } else {
            way_m
        };
        self.open = Some(OpenLine { y_m, before_m: Some(filled_m / 2.0) });
        Step::Opened(Some(Self::weigh(open, filled_m / 2.0, way_m.min(step_m))))
    }

    /// The longest way between two lines that they fill.
    pub(crate) fn longest_m(&self, nominal_step_m: f64) -> f64 {
        // Rounding of the device clock must not turn a gap of exactly the longest length into a longer one.
        (self.max_gap_steps * self.known_step_m(nominal_step_m)).max(self.resolution_m) * (1.0 + 1e-9)
    }

    /// A tractor that stood knows no step of its own.
    fn known_step_m(&self, nominal_step_m: f64) -> f64 {
        self.step_m.filter(|step_m| *step_m > 0.0).unwrap_or(nominal_step_m)
    }

    /// The stream ends: gives the last line with its weight.
    pub(crate) fn close(&mut self, nominal_step_m: f64) -> Option<Weighted> {
        let open = self.open.take()?;
        let step_m = self.step_m.unwrap_or(nominal_step_m);
        Some(Self::weigh(open, step_m / 2.0, step_m))
    }

    fn weigh(line: OpenLine, after_m: f64, step_m: f64) -> Weighted {
        let weight_m = line.before_m.unwrap_or(step_m / 2.0) + after_m;
        Weighted { y_m: line.y_m, weight_m }
    }

    /// Y of the latest line.
    pub(crate) fn y_m(&self) -> Option<f64> {
        self.last_y_m
    }

    /// Way from the first line to the latest.
    pub(crate) fn advance_m(&self) -> Option<f64> {
        Some(self.last_y_m? - self.first_y_m?)
    }

    /// The way that the lines so far stand for: half a step before the first to half a step behind the latest.
    pub(crate) fn covered_m(&self) -> Option<f64> {
        // Rounding must not ask for a line more.
        self.advance_m().map(|advance_m| advance_m + self.step_m.unwrap_or(0.0) + 1e-9)
    }

    /// Gaps not filled, and the metres left out.
    pub(crate) fn unfilled(&self) -> (u64, f64) {
        (self.gaps, self.unfilled_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn weights(lines: &[(f64, u32)]) -> (Vec<f64>, Advance) {
        let mut advance = Advance::new(5.0);
        let mut weights = Vec::new();
        for (i, &(y_m, steps)) in lines.iter().enumerate() {
            let link = if i == 0 { Link::First } else { Link::Steps(steps) };
            if let Step::Opened(closed) = advance.next(y_m, link, 0.02) {
                weights.extend(closed.map(|w| w.weight_m));
            }
        }
        weights.extend(advance.close(0.02).map(|w| w.weight_m));
        (weights, advance)
    }

    fn close_to(found: &[f64], expected: &[f64]) {
        assert_eq!(found.len(), expected.len());
        for (f, e) in found.iter().zip(expected) {
            assert!((f - e).abs() < 1e-12, "found {found:?}, expected {expected:?}");
        }
    }

    #[test]
    fn evenly_spaced_lines_weigh_a_step_each_ends_included() {
        let (w, _) = weights(&[(0.0, 0), (0.1, 1), (0.2, 1), (0.3, 1)]);
        close_to(&w, &[0.1; 4]);
    }

    #[test]
    fn neighbours_of_a_lost_line_share_its_weight() {
        let (w, _) = weights(&[(0.0, 0), (0.1, 1), (0.3, 2), (0.4, 1)]);
        close_to(&w, &[0.1, 0.15, 0.15, 0.1]);
        // Next to an end as well: the outer half stays half a step.
        let (w, _) = weights(&[(0.0, 0), (0.2, 2), (0.3, 1)]);
        close_to(&w, &[0.15, 0.15, 0.1]);
    }

    #[test]
    fn a_long_gap_is_not_filled_but_counted() {
        let (w, advance) = weights(&[(0.0, 0), (0.1, 1), (1.1, 10), (1.2, 1)]);
        close_to(&w, &[0.1, 0.3, 0.3, 0.1]);
        assert_eq!(advance.unfilled().0, 1);
        assert!((advance.unfilled().1 - 0.5).abs() < 1e-12);
        // Five steps are filled.
        let (w, advance) = weights(&[(0.0, 0), (0.1, 1), (0.6, 5), (0.7, 1)]);
        assert!((w.iter().sum::<f64>() - 0.8).abs() < 1e-12);
        assert_eq!(advance.unfilled(), (0, 0.0));
    }

    #[test]
    fn lines_as_far_apart_as_the_way_is_told_are_neighbours() {
        let mut advance = Advance::new(5.0);
        advance.resolve(0.5);
        let lines = [(0.0, 0), (0.0, 1), (0.0, 1), (0.5, 1), (0.5, 1), (1.0, 1), (3.0, 100)];
        let mut sum_m = 0.0;
        for (y_m, steps) in lines {
            let link = if steps == 0 { Link::First } else { Link::Steps(steps) };
            if let Step::Opened(Some(closed)) = advance.next(y_m, link, 0.02) {
                sum_m += closed.weight_m;
            }
        }
        // A metre by two ticks, and a quarter of one beside the gap.
        assert!((sum_m - 1.25).abs() < 1e-9, "{sum_m}");
        assert_eq!(advance.unfilled().0, 1);
    }

    #[test]
    fn a_tractor_at_standstill_adds_nothing() {
        let (w, _) = weights(&[(0.0, 0), (0.0, 1), (0.0, 1)]);
        close_to(&w, &[0.0; 3]);
    }

    #[test]
    fn a_stretch_driven_over_twice_counts_once() {
        let there_and_back = [(0.0, 0), (0.1, 1), (0.2, 1), (0.1, 1), (0.0, 1), (0.1, 1), (0.2, 1), (0.3, 1)];
        let (w, advance) = weights(&there_and_back);
        assert!((w.iter().sum::<f64>() - 0.4).abs() < 1e-12, "{w:?}");
        assert_eq!(advance.unfilled(), (0, 0.0));
    }

    #[test]
    fn a_stop_for_an_hour_adds_nothing_and_loses_nothing() {
        let mut lines = vec![(0.0, 0), (0.1, 1), (0.2, 1)];
        lines.extend(vec![(0.2, 1); 180_000]);
        lines.extend([(0.3, 1), (0.4, 1)]);
        let (w, advance) = weights(&lines);
        assert!((w.iter().sum::<f64>() - 0.5).abs() < 1e-9, "{}", w.iter().sum::<f64>());
        assert_eq!(advance.unfilled(), (0, 0.0));
    }

    #[test]
    fn one_line_alone_weighs_the_nominal_step() {
        let (w, _) = weights(&[(3.0, 0)]);
        close_to(&w, &[0.02]);
    }

    /// So many metres are scanned with the line that stands for the last of them, and not with one more.
    #[test]
    fn lines_cover_the_way_from_the_first_to_the_latest_and_a_step() {
        let mut advance = Advance::new(5.0);
        assert_eq!(advance.covered_m(), None);
        let mut lines = 0;
        while advance.covered_m() < Some(18.0) {
            let link = if lines == 0 { Link::First } else { Link::Steps(1) };
            let _ = advance.next(0.02 * f64::from(lines), link, 0.02);
            lines += 1;
        }
        assert_eq!(lines, 900);
    }
}
