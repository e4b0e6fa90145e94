//! A signal's course: its value from each sample to the next one.

use rowscan_protocol::time::SimTime;

use super::Sample;

/// Samples of a signal in their order.
#[derive(Clone, Copy, Debug)]
pub(super) struct Course<'a>(pub(super) &'a [Sample]);

impl<'a> Course<'a> {
    /// What was heard last before `at`.
    pub(super) fn before(self, at: SimTime) -> Option<Sample> {
        self.0.iter().take_while(|sample| sample.at < at).last().copied()
    }

    /// What is heard from `from` to `to`, both included.
    pub(super) fn within(self, from: SimTime, to: SimTime) -> &'a [Sample] {
        let start = self.0.partition_point(|sample| sample.at < from);
        let end = self.0.partition_point(|sample| sample.at <= to);
        self.0.get(start..end.max(start)).unwrap_or_default()
    }

    /// When a value was heard first, if nobody knows what it was from `from` until then: a signal says each value again by its longest pause.
    pub(super) fn unknown_until(self, from: SimTime) -> Option<SimTime> {
        let first = self.0.first().filter(|sample| sample.at > from)?.at;
        let pauses = self.0.iter().zip(self.0.iter().skip(1)).map(|(one, next)| next.at.0 - one.at.0);
        (first.0 - from.0 > pauses.max().unwrap_or_default()).then_some(first)
    }

    /// The stretches of `from` to `to` in which the value that was heard last fulfils `holds`, in their order. What was heard before counts at `from`.
    pub(super) fn stretches(
        self,
        from: SimTime,
        to: SimTime,
        holds: impl Fn(f64) -> bool,
    ) -> Vec<(SimTime, SimTime)> {
        let mut stretches: Vec<(SimTime, SimTime)> = Vec::new();
        let held = self.before(from).map(|sample| Sample { at: from, ..sample });
        let all: Vec<Sample> = held.into_iter().chain(self.within(from, to).iter().copied()).collect();
        for (number, sample) in all.iter().enumerate() {
            let until = all.get(number + 1).map_or(to, |next| next.at);
            if !sample.value.is_some_and(&holds) {
                continue;
            }
            match stretches.last_mut() {
                Some((_, end)) if *end == sample.at => *end = until,
                _ => stretches.push((sample.at, until)),
            }
        }
        stretches
    }

    /// The values one after the other, equal ones once, and when each came.
    pub(super) fn steps(self) -> Vec<Sample> {
        let mut steps: Vec<Sample> = Vec::new();
        for sample in self.0 {
            if steps.last().is_none_or(|last| last.value != sample.value) {
                steps.push(*sample);
            }
        }
        steps
    }
}
