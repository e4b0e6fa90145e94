//! Which beams may meet an organ: an interval of them, for eight organs at a time.

use pulp::Simd;

use crate::lanes::{Lanes, Row, WIDTH};

/// Added to a whole number of beams, this leaves the number in the low bits: the last place of what comes out is one.
const UNITS: f64 = (1u64 << 52) as f64;

/// Intervals of beams, for eight organs. In a fan they come round again after a turn.
#[derive(Clone, Debug)]
pub(super) struct Spans {
    /// The beams as fractions.
    low: Row,
    high: Row,
    /// First and last beam, plus [`UNITS`].
    first: Row,
    last: Row,
    /// True if any of them comes round again while there are beams.
    again: bool,
    count: f64,
    turn: f64,
    /// Beams are coarser than half a turn: an interval is all of them.
    coarse: bool,
}

impl Spans {
    /// Intervals of `count` beams that come round again after `turn` of them (infinite where they do not).
    pub(super) fn of(turn: f64, count: usize) -> Self {
        let row = Row::splat(f64::INFINITY);
        let coarse = turn < 2.0;
        Self {
            low: row,
            high: row,
            first: row,
            last: row,
            again: false,
            count: count as f64,
            turn: if coarse { f64::INFINITY } else { turn },
            coarse,
        }
    }

    /// Sets part `part`: the beams from `low` to `high`, widened beyond all rounding; none where `low` is infinite.
    #[inline(always)]
    pub(super) fn set<S: Simd>(&mut self, part: usize, low: Lanes<S>, high: Lanes<S>) {
        let (zero, half, count) = (low.of(0.0), low.of(0.5), low.of(self.count));
        let (mut low, mut high) = (low, high);
        if self.coarse {
            let met = low.lt(zero.of(f64::INFINITY));
            (low, high) = (met.select(zero, low), count);
        }
        let again = !(low + zero.of(self.turn)).lt(count).is_empty();
        self.again = again || (part > 0 && self.again);
        self.low.store(part, low);
        self.high.store(part, high);
        // To the nearest number: up from below, down from above. None is what begins beyond the last beam.
        let (low, high) =
            ((low + half).max(zero).min(count), (high - half).min(count - zero.of(1.0)).max(zero));
        self.first.store(part, low + zero.of(UNITS));
        self.last.store(part, high + zero.of(UNITS));
    }

    /// First and last beam that may meet organ `lane`. If none does, the first is past all beams: whoever asks at least the first finds
    /// none there that counts.
    #[inline(always)]
    pub(super) fn run(&self, lane: usize) -> (usize, usize) {
        let beam = |row: &Row| (row.0[lane].to_bits() & u64::from(u32::MAX)) as usize;
        (beam(&self.first), beam(&self.last))
    }

    /// The organs that any beam may meet.
    #[inline(always)]
    pub(super) fn asked(&self) -> Asked {
        let mut asked = Asked { lanes: [0; WIDTH], count: 0 };
        for lane in 0..WIDTH {
            // Without a jump: which of them are asked is hard to foresee.
            asked.lanes[asked.count % WIDTH] = lane;
            asked.count += usize::from(self.first.0[lane] <= self.last.0[lane] || self.again);
        }
        asked
    }

    /// True if the span of any of the eight organs comes round again.
    pub(super) fn again(&self) -> bool {
        self.again
    }

    /// The same span a turn later, from beam `from` on: beams before it have been asked.
    #[cold]
    pub(super) fn next_run(&mut self, lane: usize, from: usize) -> Option<(usize, usize)> {
        let lane = lane % WIDTH;
        while self.low.0[lane] + self.turn < self.count {
            self.low.0[lane] += self.turn;
            self.high.0[lane] += self.turn;
            let first = (self.low.0[lane].max(0.0).ceil() as usize).max(from);
            let last = self.high.0[lane].min(self.count - 1.0).floor();
            if last >= first as f64 {
                return Some((first, last as usize));
            }
        }
        None
    }
}

/// Those of eight organs that beams may meet.
pub(super) struct Asked {
    lanes: [usize; WIDTH],
    count: usize,
}

impl Asked {
    #[inline(always)]
    pub(super) fn iter(&self) -> impl Iterator<Item = usize> {
        self.lanes.get(..self.count).unwrap_or(&[]).iter().copied()
    }
}

/// Does `$body` with every register full of beams that organ `$lane` of `$spans` may be met by. The register's first beam is `$beam`.
macro_rules! for_beams {
    ($simd:ty, $spans:expr, $lane:expr, |$beam:ident, $last:ident| $body:block) => {
        let (mut $beam, mut $last) = $spans.run($lane);
        loop {
            // At least once: a jump not taken is dearer than a register of beams that meet nothing.
            loop {
                $body
                $beam += <$simd>::F64_LANES;
                if $beam > $last {
                    break;
                }
            }
            if !$spans.again() {
                break;
            }
            let Some(run) = $spans.next_run($lane, $beam) else { break };
            ($beam, $last) = run;
        }
    };
}
pub(super) use for_beams;
