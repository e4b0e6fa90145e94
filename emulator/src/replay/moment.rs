//! Where a frame stands in a recording. Several may have one time: what came in one piece, or from an emulator that ran as fast as it could.

/// A place in a recording.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Moment {
    /// Recorded instant, ns.
    pub at_ns: u64,
    /// Which of the frames of that instant, from 0, in the recording's order.
    pub number: u64,
}

impl Moment {
    /// Behind all that is recorded.
    pub const END: Self = Self { at_ns: u64::MAX, number: u64::MAX };
}

impl From<u64> for Moment {
    fn from(at_ns: u64) -> Self {
        Self { at_ns, number: 0 }
    }
}

/// Tells the frames of one instant apart.
#[derive(Debug, Default)]
pub(super) struct Moments(Option<Moment>);

impl Moments {
    /// Where the next frame stands, which has this time.
    pub(super) fn next(&mut self, at_ns: u64) -> Moment {
        let before = self.0.filter(|before| before.at_ns == at_ns);
        let number = before.map_or(0, |before| before.number + 1);
        *self.0.insert(Moment { at_ns, number })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_of_one_time_are_told_apart_by_their_order() {
        let mut moments = Moments::default();
        let found = [0, 0, 5, 5, 5, 9].map(|at_ns| moments.next(at_ns));
        assert_eq!(found.map(|moment| moment.number), [0, 1, 0, 1, 2, 0]);
        assert!(found.is_sorted() && found.iter().all(|moment| *moment < Moment::END));
        assert!(Moment::from(5) <= found[2] && Moment::from(5) > found[1]);
    }
}
