//! When the bytes of a telegram leave the device: at the rate of the line, and no more than so many in one mirror turn.
//!
//! At 500 000 bits a second this is the pause of up to 14 ms inside a telegram: 508 bytes in the turn after the scan, the rest in the next
//! (telegram listing, page 22 and figure 10-10). Slower lines carry less than that in a turn.

use core::time::Duration;

use super::Device;
use super::sweep::Sweep;
use crate::lms2xx::Rate;
use crate::time::SimTime;

/// How fast one telegram leaves. What other telegrams have used of a turn is not counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pace {
    /// The line's.
    pub rate: Rate,
    /// Most bytes that leave in one mirror turn.
    pub bytes_a_turn: usize,
}

/// Bytes that leave one after the other.
struct Run {
    from: SimTime,
    bytes: usize,
}

impl Pace {
    /// When so many bytes have left, if the first began at `began`.
    pub fn end(self, began: SimTime, bytes: usize) -> SimTime {
        let mut end = began;
        for Run { from, bytes } in self.runs(began, bytes) {
            end = from + self.rate.transmission(bytes);
        }
        end
    }

    /// How many of `bytes` have left by `now`.
    pub fn left(self, began: SimTime, bytes: usize, now: SimTime) -> usize {
        let left = |Run { from, bytes }| {
            let elapsed = u128::from(now.0.saturating_sub(from.0));
            let gone = elapsed * u128::from(self.rate.bits_per_second()) / 10_000_000_000;
            usize::try_from(gone).unwrap_or(usize::MAX).min(bytes)
        };
        self.runs(began, bytes).map(left).sum()
    }

    fn runs(self, began: SimTime, bytes: usize) -> impl Iterator<Item = Run> {
        let turn = Sweep::turn_at(1).elapsed();
        let limit = self.bytes_a_turn.max(1);
        let is_limited = self.rate.transmission(limit) < turn;
        let (mut from, mut rest) = (began, bytes);
        core::iter::from_fn(move || {
            if rest == 0 {
                return None;
            }
            let next_turn = Sweep::turn_at(Sweep::turn_of(from) + 1);
            let run = match is_limited {
                true => limit.min(self.begun(Duration::from_nanos(next_turn.0 - from.0))).min(rest),
                false => rest,
            };
            let this = Run { from, bytes: run };
            rest -= run;
            from = (from + self.rate.transmission(run)).max(next_turn);
            Some(this)
        })
    }

    /// How many bytes begin within this time; at least one.
    fn begun(self, time: Duration) -> usize {
        let byte = self.rate.transmission(1).as_nanos().max(1);
        usize::try_from(time.as_nanos().div_ceil(byte)).unwrap_or(usize::MAX).max(1)
    }
}

impl Device {
    /// How fast its telegrams leave.
    pub fn pace(&self) -> Pace {
        Pace { rate: self.rate, bytes_a_turn: self.model.bytes_a_turn }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pace(rate: Rate) -> Pace {
        Pace { rate, bytes_a_turn: 508 }
    }

    #[test]
    fn a_fast_telegram_leaves_in_two_mirror_turns() {
        let (began, pace) = (Sweep::turn_at(7), pace(Rate::R500000));
        let first = began + Duration::from_micros(508 * 20);
        assert_eq!(pace.end(began, 508), first);
        assert_eq!(pace.left(began, 732, first), 508);
        // Nothing until the next turn; 3.17 ms, below the 14 ms that a host must bear.
        let next = Sweep::turn_at(8);
        assert!(next.0 - first.0 < 14_000_000);
        assert_eq!(pace.left(began, 732, next), 508);
        assert_eq!(pace.end(began, 509), next + Duration::from_micros(20));
        assert_eq!(pace.end(began, 732), next + Duration::from_micros(224 * 20));
        assert_eq!(pace.left(began, 732, pace.end(began, 732)), 732);
    }

    #[test]
    fn one_that_begins_late_in_a_turn_has_the_next_one_whole() {
        let began = Sweep::turn_at(8) + Duration::from_micros(19);
        let began = SimTime(began.0 - 119_000);
        // Five bytes begin in what is left of the turn.
        assert_eq!(pace(Rate::R500000).end(began, 5), began + Duration::from_micros(100));
        let whole = pace(Rate::R500000).end(began, 5 + 508);
        assert!(whole < Sweep::turn_at(9), "{whole:?}");
        assert!(pace(Rate::R500000).end(began, 5 + 509) > Sweep::turn_at(9));
    }

    #[test]
    fn slower_lines_never_pause() {
        for rate in [Rate::R9600, Rate::R19200, Rate::R38400] {
            let began = SimTime(5);
            assert_eq!(pace(rate).end(began, 812), began + rate.transmission(812));
        }
    }
}
