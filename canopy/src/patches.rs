//! Which hits meet a patch of surface that no neighbour has met: several beams end on one leaf where it is wider than they are apart, and
//! are worth one look.

use crate::geometry::{Reading, reading};

/// Returns no farther apart in range than this lie on the same patch, metres.
const ALIKE_M: f64 = 0.04;

/// The line before, and what it says of this one.
#[derive(Clone, Debug, Default)]
pub(crate) struct Patches {
    /// Ranges of the line before; NaN where there was none.
    before_m: Vec<f64>,
    fresh: Vec<bool>,
}

impl Patches {
    /// Takes the next line.
    pub(crate) fn add_line(&mut self, range_m: &[f64]) {
        self.before_m.resize(range_m.len(), f64::NAN);
        self.fresh.clear();
        let mut beside_m = f64::NAN;
        for (before_m, &range_m) in self.before_m.iter_mut().zip(range_m) {
            let range_m = if reading(range_m) == Reading::Return { range_m } else { f64::NAN };
            // NaN is like nothing.
            let alike = |other_m: f64| (range_m - other_m).abs() <= ALIKE_M;
            self.fresh.push(!(alike(beside_m) || alike(*before_m)));
            beside_m = range_m;
            *before_m = range_m;
        }
    }

    /// One a beam of the latest line: true if its return begins a patch. Beams without a return begin one too; they are never asked.
    pub(crate) fn fresh(&self) -> &[bool] {
        &self.fresh
    }

    /// Forgets the line before: the beams are others now.
    pub(crate) fn clear(&mut self) {
        self.before_m.clear();
    }

    #[cfg(test)]
    pub(crate) fn capacities(&self) -> [usize; 2] {
        [self.before_m.capacity(), self.fresh.capacity()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_protocol::scan::NO_ECHO;

    #[test]
    fn a_leaf_of_three_beams_and_two_lines_is_one_patch() {
        let mut patches = Patches::default();
        patches.add_line(&[NO_ECHO, 2.0, 2.01, 2.02, 2.5]);
        assert_eq!(patches.fresh(), [true, true, false, false, true]);
        patches.add_line(&[NO_ECHO, 2.0, 2.01, f64::NAN, 3.0]);
        assert_eq!(patches.fresh(), [true, false, false, true, true]);
        patches.clear();
        patches.add_line(&[2.0, 2.0]);
        assert_eq!(patches.fresh(), [true, false]);
    }
}
