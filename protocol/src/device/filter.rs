//! The device's own filters, over the raw line and before the output range cuts it. A device applies them as set: particle, then median,
//! then mean. Their exact rules inside real devices are not published; what is done here is what the manual's words say.

use alloc::vec::Vec;

use super::measured::{MeasuredEcho, MeasuredLine};
use crate::angle::BeamGrid;
use crate::telegram::lfp_filter::{MeanFilter, MedianFilter, ParticleFilter};

/// Neighbours a median is made of.
pub(super) const MEDIAN_BEAMS: u16 = 3;
/// Scans a mean can be made of.
pub(super) const MEAN_SCANS: core::ops::RangeInclusive<u16> = 2..=100;

/// Buffers of the filters.
#[derive(Clone, Debug, Default)]
pub(super) struct Filters {
    line: Vec<MeasuredEcho>,
    /// One an echo.
    sums: Vec<Sum>,
    /// Scans in the sums.
    summed: u16,
    /// The beams of those scans.
    grid: BeamGrid,
}

/// One echo's sums over scans.
#[derive(Clone, Debug, Default)]
struct Sum {
    /// One a beam: ranges, remissions, how many scans had an echo there.
    beams: Vec<(u32, u32, u16)>,
}

/// Which filters are on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Active {
    pub(super) mean: MeanFilter,
    pub(super) median: MedianFilter,
    pub(super) particle: ParticleFilter,
}

impl Filters {
    /// The filtered line; `None` while a mean still collects scans: all of them give one telegram.
    pub(super) fn apply<'a>(
        &'a mut self,
        active: Active,
        line: &MeasuredLine<'a>,
    ) -> Option<MeasuredLine<'a>> {
        let Active { mean, median, particle } = active;
        if !(mean.active || median.active || particle.active) {
            *self = Self::default();
            return Some(*line);
        }
        self.line.resize_with(line.echoes.len(), MeasuredEcho::default);
        for (filtered, raw) in self.line.iter_mut().zip(line.echoes) {
            filtered.clone_from(raw);
            if particle.active {
                take_particles_away(filtered, particle.threshold_mm);
            }
            if median.active {
                median_of_neighbours(filtered);
            }
        }
        if !mean.active {
            self.summed = 0;
            return Some(MeasuredLine { grid: line.grid, echoes: &self.line });
        }
        self.add(line.grid);
        if self.summed < mean.scans {
            return None;
        }
        self.means();
        Some(MeasuredLine { grid: line.grid, echoes: &self.line })
    }

    fn add(&mut self, grid: BeamGrid) {
        self.sums.resize_with(self.line.len(), Sum::default);
        // Another scan mode: the scans so far do not fit.
        let fits = |(sum, echo): (&Sum, &MeasuredEcho)| sum.beams.len() == echo.range_mm.len();
        if self.summed == 0 || self.grid != grid || !self.sums.iter().zip(&self.line).all(fits) {
            self.summed = 0;
            self.grid = grid;
            for (sum, echo) in self.sums.iter_mut().zip(&self.line) {
                sum.beams.clear();
                sum.beams.resize(echo.range_mm.len(), (0, 0, 0));
            }
        }
        for (sum, echo) in self.sums.iter_mut().zip(&self.line) {
            for (beam, (range_mm, remission, scans)) in sum.beams.iter_mut().enumerate() {
                let value = echo.range_mm.get(beam).copied().unwrap_or_default();
                if value > 0 {
                    *range_mm += u32::from(value);
                    *remission += u32::from(echo.remission.get(beam).copied().unwrap_or_default());
                    *scans += 1;
                }
            }
        }
        self.summed += 1;
    }

    /// Beams without an echo in any of the scans stay without.
    fn means(&mut self) {
        self.summed = 0;
        for (sum, echo) in self.sums.iter().zip(&mut self.line) {
            let mean = |sum: u32, scans: u16| {
                let scans = u32::from(scans);
                (sum + scans / 2).checked_div(scans).unwrap_or_default() as u16
            };
            for (to, (range_mm, _, scans)) in echo.range_mm.iter_mut().zip(&sum.beams) {
                *to = mean(*range_mm, *scans);
            }
            for (to, (_, remission, scans)) in echo.remission.iter_mut().zip(&sum.beams) {
                *to = mean(*remission, *scans);
            }
        }
    }
}

/// No echo is farther than any.
fn depth(range_mm: u16) -> u16 {
    if range_mm == 0 { u16::MAX } else { range_mm }
}

/// A single beam that stands more than the threshold in front of both neighbours loses its echo. The first and the last beam have one
/// neighbour and stay.
fn take_particles_away(echo: &mut MeasuredEcho, threshold_mm: u16) {
    let mut before = None;
    for beam in 0..echo.range_mm.len() {
        let Some(&here) = echo.range_mm.get(beam) else { break };
        let after = echo.range_mm.get(beam + 1).copied();
        if let (Some(before), Some(after)) = (before, after) {
            let in_front =
                |neighbour: u16| depth(neighbour) - depth(here).min(depth(neighbour)) > threshold_mm;
            if here > 0 && in_front(before) && in_front(after) {
                clear(echo, beam);
            }
        }
        before = Some(here);
    }
}

fn clear(echo: &mut MeasuredEcho, beam: usize) {
    for values in [&mut echo.range_mm, &mut echo.remission] {
        if let Some(value) = values.get_mut(beam) {
            *value = 0;
        }
    }
}

/// Every beam but the first and the last becomes the median of itself and its neighbours.
fn median_of_neighbours(echo: &mut MeasuredEcho) {
    let mut before = echo.range_mm.first().copied().unwrap_or_default();
    for beam in 1..echo.range_mm.len().saturating_sub(1) {
        let Some([here, after]) = echo.range_mm.get_mut(beam..=beam + 1) else { break };
        let mut three = [before, *here, *after];
        before = *here;
        three.sort_unstable_by_key(|&range_mm| depth(range_mm));
        *here = three[1];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec;

    fn echo(range_mm: &[u16]) -> MeasuredEcho {
        MeasuredEcho { range_mm: range_mm.into(), remission: vec![100; range_mm.len()] }
    }

    fn grid(count: u16) -> BeamGrid {
        BeamGrid { start: 0, step: 5000, count }
    }

    fn off() -> Active {
        Active {
            mean: MeanFilter::default(),
            median: MedianFilter::default(),
            particle: ParticleFilter::default(),
        }
    }

    #[test]
    fn a_particle_is_one_beam_far_in_front_of_both_neighbours() {
        for (line, expected) in [
            ([2000, 1000, 2000, 2000], [2000, 0, 2000, 2000]),
            ([0, 1000, 0, 0], [0, 0, 0, 0]),
            ([2000, 1000, 1000, 2000], [2000, 1000, 1000, 2000]),
            ([2000, 1500, 2000, 2000], [2000, 1500, 2000, 2000]),
            ([1000, 2000, 2000, 1000], [1000, 2000, 2000, 1000]),
        ] {
            let mut echo = echo(&line);
            take_particles_away(&mut echo, 500);
            assert_eq!(echo.range_mm, expected);
            assert_eq!(echo.remission[1] == 0, expected[1] == 0);
        }
    }

    #[test]
    fn a_median_takes_outliers_and_holes_away() {
        let mut echo = echo(&[1000, 5000, 1002, 0, 1004, 0, 0]);
        median_of_neighbours(&mut echo);
        assert_eq!(echo.range_mm, [1000, 1002, 5000, 1004, 0, 0, 0]);
    }

    #[test]
    fn a_mean_gives_one_line_for_its_scans_and_leaves_misses_out() {
        let mut filters = Filters::default();
        let active = Active { mean: MeanFilter { active: true, scans: 3, reserved: 0 }, ..off() };
        let mut means = Vec::new();
        for turn in 0..9u16 {
            let echoes = [echo(&[1000 + 30 * (turn % 3), if turn % 3 == 0 { 600 } else { 0 }, 0])];
            if let Some(line) = filters.apply(active, &MeasuredLine { grid: grid(3), echoes: &echoes }) {
                means.push(line.echoes[0].range_mm.clone());
            }
        }
        assert_eq!(means, vec![vec![1030, 600, 0]; 3]);
    }

    #[test]
    fn without_filters_the_line_passes_untouched() {
        let echoes = [echo(&[1, 2, 0])];
        let line = MeasuredLine { grid: grid(3), echoes: &echoes };
        assert!(core::ptr::eq(Filters::default().apply(off(), &line).unwrap().echoes, line.echoes));
    }
}
