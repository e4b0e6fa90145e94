//! What a controller has told the sprayer's nozzles.

use std::collections::VecDeque;

use rowscan_protocol::time::SimTime;

/// Changes that are remembered a nozzle: devices look a little back and ahead, not over the drive.
const REMEMBERED: usize = 16;

/// The duties of the nozzles over time, 0 shut to 1 open, by number.
#[derive(Clone, Debug, Default)]
pub(crate) struct Nozzles {
    told: Vec<VecDeque<(SimTime, f64)>>,
    changes: u64,
}

impl Nozzles {
    /// From `at` on; what a nozzle has been told already changes nothing.
    pub(crate) fn tell(&mut self, at: SimTime, number: u8, duty: f64) {
        let number = usize::from(number);
        if self.told.len() <= number {
            self.told.resize(number + 1, VecDeque::new());
        }
        let Some(told) = self.told.get_mut(number) else { return };
        if told.back().is_some_and(|(_, last)| *last == duty) {
            return;
        }
        if told.len() == REMEMBERED {
            told.pop_front();
        }
        told.push_back((at, duty));
        self.changes += 1;
    }

    /// None while it has been told nothing.
    pub(crate) fn duty(&self, number: usize, at: SimTime) -> Option<f64> {
        let told = self.told.get(number)?;
        told.iter().rev().find(|(from, _)| *from <= at).map(|(_, duty)| *duty)
    }

    /// Changes that are in force at `at`: other duties have another number.
    pub(crate) fn changes(&self, at: SimTime) -> u64 {
        let later = self.told.iter().flatten().filter(|(from, _)| *from > at).count();
        self.changes - later as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_duty_holds_from_its_instant_until_the_next_and_repeats_change_nothing() {
        let mut nozzles = Nozzles::default();
        assert_eq!((nozzles.duty(2, SimTime(9)), nozzles.changes(SimTime(9))), (None, 0));
        nozzles.tell(SimTime(10), 2, 1.0);
        nozzles.tell(SimTime(20), 2, 1.0);
        nozzles.tell(SimTime(30), 2, 0.25);
        let seen = [9, 10, 29, 30].map(|at| (nozzles.duty(2, SimTime(at)), nozzles.changes(SimTime(at))));
        assert_eq!(seen, [(None, 0), (Some(1.0), 1), (Some(1.0), 1), (Some(0.25), 2)]);
        assert_eq!(nozzles.duty(0, SimTime(30)), None);
    }
}
