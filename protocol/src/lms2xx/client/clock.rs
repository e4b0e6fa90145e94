//! When a scan was made: telegrams carry no time, so it is told from how they follow one another.

use core::time::Duration;

use crate::lms2xx::Rate;
use crate::lms2xx::model::TURNS_PER_SECOND;

/// Telegrams whose bytes are remembered.
const REMEMBERED: i64 = 64;
/// How many telegrams more or fewer may have gone by than the host's clock says, beside a share of them.
const HOST_TOLERANCE: f64 = 2.0;
/// That share: clocks drift.
const HOST_TOLERANCE_SHARE: f64 = 2e-4;

/// Telegrams of one output differ in length by no more bytes than this: interlaced parts of a scan have a value more or fewer.
const SAME_LENGTH: usize = 8;

/// The two indices behind a telegram's values, each modulo 256.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Indices {
    /// Turns of the mirror.
    pub(super) turn: u8,
    /// Telegrams of values that were sent. `None` of bytes that have the first only.
    pub(super) telegram: Option<u8>,
}

/// Where a telegram stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Place {
    /// Its number, lost ones counted.
    pub(super) number: u64,
    /// Turns of the mirror since number 0; `None` where nobody counts them.
    pub(super) turns: Option<u64>,
    /// The same in times from one telegram to the next, as long as those were then.
    pub(super) periods: u64,
    /// The device counts anew from here on.
    pub(super) begins_anew: bool,
}

/// Counts scan telegrams, those that were lost too.
///
/// An index alone says nothing of 256 telegrams more, and that of turns nothing of as few as make 256 turns: both together are held against each other, and against the
/// host's clock where that is known. A telegram that is older than the newest one came late, or again, or the device began anew: what it holds tells which.
#[derive(Clone, Debug)]
pub(super) struct ScanClock {
    last: Option<Last>,
    /// How many turns go by from one telegram to the next: the fewest that were seen since telegrams are about as long as the last one.
    stride: Option<u8>,
    /// How long that is, bytes.
    length: usize,
    /// Numbers of telegrams that have come, with what stands for their bytes.
    came: [Option<(i64, u32)>; REMEMBERED as usize],
}

/// The newest telegram.
#[derive(Clone, Copy, Debug)]
struct Last {
    indices: Option<Indices>,
    number: i64,
    turns: i64,
    periods: i64,
    at: Option<Duration>,
}

impl Default for ScanClock {
    fn default() -> Self {
        Self { last: None, stride: None, length: 0, came: [None; REMEMBERED as usize] }
    }
}

/// Stands for a telegram's bytes (FNV-1a).
pub(super) fn fingerprint(bytes: &[u8]) -> u32 {
    bytes.iter().fold(0x811c_9dc5, |hash: u32, byte| (hash ^ u32::from(*byte)).wrapping_mul(0x0100_0193))
}

/// The time from one scan telegram to the next: the first multiple of the scan's own time that is not shorter than the transmission.
pub(super) fn period(rate: Rate, frame: usize, turns_a_scan: u32) -> Duration {
    let scan = scan_time(turns_a_scan);
    // Both are rounded to a nanosecond.
    let sending = rate.transmission(frame).saturating_sub(Duration::from_nanos(100));
    let scans = sending.as_nanos().div_ceil(scan.as_nanos().max(1)).max(1);
    scan.saturating_mul(u32::try_from(scans).unwrap_or(u32::MAX))
}

fn scan_time(turns_a_scan: u32) -> Duration {
    Duration::from_secs(1) * turns_a_scan / TURNS_PER_SECOND
}

impl ScanClock {
    /// The time from one telegram to the next by the mirror turns between them, once they have been counted.
    pub(super) fn period(&self, turns_a_scan: u32) -> Option<Duration> {
        let turns = u32::from(self.stride?);
        (turns > 0).then(|| scan_time(turns_a_scan).saturating_mul(turns.div_ceil(turns_a_scan.max(1))))
    }

    /// A telegram of this length with these indices came, read at `at`; `bytes` stand for what it holds.
    pub(super) fn count(
        &mut self,
        indices: Option<Indices>,
        (length, bytes): (usize, u32),
        at: Option<Duration>,
    ) -> Place {
        if length.abs_diff(self.length) > SAME_LENGTH {
            // Another resolution or angle: scans take another number of turns.
            self.stride = None;
        }
        self.length = length;
        let Some(last) = self.last else {
            return self.newest(Last { indices, number: 0, turns: 0, periods: 0, at }, bytes);
        };
        let Some((before, now)) = last.indices.zip(indices) else {
            // Nobody counts: what was lost is not known, and is not made up from times that hosts delay.
            let (number, periods) = (last.number + 1, last.periods + 1);
            return self.newest(Last { indices, number, periods, turns: last.turns, at }, bytes);
        };
        let turned = now.turn.wrapping_sub(before.turn);
        let telegrams = match before.telegram.zip(now.telegram) {
            Some((before, now)) => i64::from(now.wrapping_sub(before) as i8),
            // To the last byte, its index too: the same one again.
            None if self.came.get(slot(last.number)).copied().flatten() == Some((last.number, bytes)) => {
                return place(&last, false);
            }
            None if turned == 0 => 1,
            None => self.telegrams_by_turns(turned),
        };
        let telegrams = self.by_host(telegrams, last.at, at);
        if telegrams <= 0 {
            return self.behind(last, indices, telegrams, bytes, at);
        }
        if telegrams == 1 && turned > 0 {
            self.stride = Some(self.stride.map_or(turned, |stride| stride.min(turned)));
        }
        let turns = self.turns(turned, telegrams);
        let next = Last {
            indices,
            number: last.number + telegrams,
            turns: last.turns + turns,
            periods: last.periods + self.periods(turns, telegrams),
            at,
        };
        self.newest(next, bytes)
    }

    /// A telegram that is newer than all before it.
    fn newest(&mut self, last: Last, bytes: u32) -> Place {
        self.last = Some(last);
        self.keep(last.number, bytes);
        place(&last, false)
    }

    /// A telegram that is so many behind the newest, or as old.
    fn behind(
        &mut self,
        last: Last,
        indices: Option<Indices>,
        telegrams: i64,
        bytes: u32,
        at: Option<Duration>,
    ) -> Place {
        let number = last.number + telegrams;
        let turned = last.indices.zip(indices).map_or(0, |(before, now)| now.turn.wrapping_sub(before.turn));
        let turned = self.turns(turned, telegrams);
        let (turns, periods) = (last.turns + turned, last.periods + self.periods(turned, telegrams));
        let there = Last { number, turns, periods, ..last };
        let came = self.came.get(slot(number)).copied().flatten().filter(|(kept, _)| *kept == number);
        let is_near = -telegrams < REMEMBERED && number > 0 && turns >= 0;
        match came {
            Some((_, kept)) if kept == bytes => place(&there, false),
            None if is_near && telegrams < 0 => {
                self.keep(number, bytes);
                place(&there, false)
            }
            _ => {
                self.came = [None; REMEMBERED as usize];
                let place = self.newest(Last { indices, number: 0, turns: 0, periods: 0, at }, bytes);
                Place { begins_anew: true, ..place }
            }
        }
    }

    fn keep(&mut self, number: i64, bytes: u32) {
        if let Some(kept) = self.came.get_mut(slot(number)) {
            *kept = Some((number, bytes));
        }
    }

    /// So many telegrams forward, or 256, 512, … more where the host's clock says just that.
    fn by_host(&self, telegrams: i64, before: Option<Duration>, at: Option<Duration>) -> i64 {
        let passed_s =
            before.zip(at).and_then(|(before, at)| at.checked_sub(before)).map(|d| d.as_secs_f64());
        let each_s = self.stride.map(|stride| f64::from(stride) / f64::from(TURNS_PER_SECOND));
        let Some((passed_s, each_s)) = passed_s.zip(each_s.filter(|each_s| *each_s > 0.0)) else {
            return telegrams;
        };
        let expected = passed_s / each_s;
        let wraps = libm::round((expected - telegrams as f64) / 256.0);
        let found = telegrams as f64 + 256.0 * wraps;
        let tolerance = HOST_TOLERANCE + HOST_TOLERANCE_SHARE * expected;
        if wraps >= 1.0 && libm::fabs(expected - found) <= tolerance { found as i64 } else { telegrams }
    }

    /// Turns that so many telegrams took, which moved the index by so much.
    fn turns(&self, turned: u8, telegrams: i64) -> i64 {
        let Some(stride) = self.stride else { return i64::from(turned) };
        let expected = telegrams * i64::from(stride);
        if telegrams == 1 {
            return if turned == 0 { 256 } else { i64::from(turned) };
        }
        expected + i64::from(turned.wrapping_sub(expected as u8) as i8)
    }

    /// Of bytes that have the index of turns alone.
    fn telegrams_by_turns(&mut self, step: u8) -> i64 {
        let stride = *self.stride.get_or_insert(step).min(&mut step.clone());
        self.stride = Some(stride);
        ((i64::from(step) + i64::from(stride / 2)) / i64::from(stride)).max(1)
    }

    /// How many times as long as from one telegram to the next so many turns take, which so many telegrams took.
    fn periods(&self, turns: i64, telegrams: i64) -> i64 {
        let Some(stride) = self.stride.map(i64::from).filter(|stride| *stride > 0) else { return telegrams };
        let half = stride / 2;
        (turns + if turns < 0 { -half } else { half }) / stride
    }
}

fn place(last: &Last, begins_anew: bool) -> Place {
    let turns = u64::try_from(last.turns).ok().filter(|_| last.indices.is_some());
    Place { number: last.number.unsigned_abs(), turns, periods: last.periods.unsigned_abs(), begins_anew }
}

fn slot(number: i64) -> usize {
    number.rem_euclid(REMEMBERED) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec::Vec;

    #[test]
    fn periods_are_those_of_the_recorded_device() {
        // 361 values at 38 400: 190.6 ms on the line, 213.3 ms from scan to scan.
        assert_eq!(period(Rate::R38400, 732, 2).as_micros(), 213_333);
        assert_eq!(period(Rate::R500000, 732, 2).as_micros(), 26_666);
        assert_eq!(period(Rate::R9600, 372, 1).as_micros(), 399_999);
    }

    /// Numbers of telegrams with these turns and telegrams, each with its own bytes; `anew` where the device begins to count anew.
    fn counted(indices: &[(u8, Option<u8>)]) -> Vec<(u64, bool)> {
        let mut clock = ScanClock::default();
        let mut bytes = 0;
        let places = indices.iter().map(|(turn, telegram)| {
            bytes += 1;
            clock.count(Some(Indices { turn: *turn, telegram: *telegram }), (732, bytes), None)
        });
        places.map(|place| (place.number, place.begins_anew)).collect()
    }

    #[test]
    fn without_an_index_nothing_is_known_to_be_lost() {
        let mut clock = ScanClock::default();
        let counted: Vec<u64> = (0..4).map(|n| clock.count(None, (732, n), None).number).collect();
        assert_eq!(counted, [0, 1, 2, 3]);
    }

    #[test]
    fn a_gap_in_the_index_of_turns_alone_is_lost_telegrams() {
        let of = |indices: &[u8]| {
            let places = counted(&indices.iter().map(|turn| (*turn, None)).collect::<Vec<_>>());
            places.into_iter().map(|(number, _)| number).collect::<Vec<_>>()
        };
        assert_eq!(of(&[250, 10, 26, 58, 74]), [0, 1, 2, 4, 5]);
        assert_eq!(of(&[0, 16, 14]), [0, 1, 17]);
    }

    /// The device's telegrams: 16 turns each at 38 400 with 0.5 deg, and numbered.
    fn sent(number: i64, stride: i64) -> Indices {
        Indices { turn: (number * stride) as u8, telegram: Some(number as u8) }
    }

    #[test]
    fn however_many_are_lost_they_are_counted_and_take_their_time() {
        for stride in [2_i64, 3, 8, 16, 30, 59, 100] {
            for first in [0_i64, 7, 250] {
                for lost in (0..120).chain([254, 255, 256, 300, 1000]) {
                    let mut clock = ScanClock::default();
                    let at = |number: i64| Duration::from_millis((number * stride * 1000 / 75) as u64 + 11);
                    let mut told = Place::default();
                    for number in (first..first + 5).chain(first + 5 + lost..first + 10 + lost) {
                        // With few lost, nobody needs a host's clock.
                        let read = (lost >= 120).then(|| at(number));
                        told = clock.count(Some(sent(number, stride)), (732, number as u32), read);
                    }
                    let expected = 9 + lost;
                    let place = Place {
                        number: expected as u64,
                        turns: Some((expected * stride) as u64),
                        periods: expected as u64,
                        begins_anew: false,
                    };
                    assert_eq!(told, place, "stride {stride}, first {first}, {lost} lost");
                }
            }
        }
    }

    #[test]
    fn a_clock_of_the_host_that_jumps_loses_nothing() {
        for jump_s in [-100_i64, 50, 100, 3600] {
            let mut clock = ScanClock::default();
            for number in 0..40_i64 {
                let at_ms = 200_000 + number * 16 * 1000 / 75 + if number > 20 { jump_s * 1000 } else { 0 };
                let place = clock.count(
                    Some(sent(number, 16)),
                    (732, number as u32),
                    Some(Duration::from_millis(at_ms as u64)),
                );
                assert_eq!((place.number, place.begins_anew), (number as u64, false), "{jump_s} s");
            }
        }
    }

    #[test]
    fn what_is_older_came_late_or_again_or_the_device_began_anew() {
        let mut clock = ScanClock::default();
        let mut count = |number: i64, bytes: u32| {
            let place = clock.count(Some(sent(number, 16)), (732, bytes), None);
            (place.number, place.begins_anew)
        };
        let told: Vec<(u64, bool)> =
            [(5, 1), (6, 2), (8, 3), (7, 4), (9, 5), (8, 3), (7, 4), (9, 5), (10, 6)]
                .map(|(number, bytes)| count(number, bytes))
                .into();
        let numbers: Vec<u64> = told.iter().map(|(number, _)| *number).collect();
        assert_eq!(numbers, [0, 1, 3, 2, 4, 3, 2, 4, 5]);
        assert!(told.iter().all(|(_, anew)| !anew), "{told:?}");
        // The same indices with other bytes.
        assert_eq!([count(8, 30), count(9, 31), count(10, 32)], [(0, true), (1, false), (2, false)]);
        // From before the first.
        assert_eq!(count(4, 33), (0, true));
    }

    #[test]
    fn a_turn_that_a_device_left_out_takes_its_time_and_is_no_lost_telegram() {
        let mut clock = ScanClock::default();
        let told = [(0, 0), (16, 1), (48, 2), (64, 3)].map(|(turn, telegram)| {
            let indices = Indices { turn, telegram: Some(telegram) };
            let place = clock.count(Some(indices), (732, u32::from(turn)), None);
            (place.number, place.turns, place.periods)
        });
        assert_eq!(told.map(|(number, ..)| number), [0, 1, 2, 3]);
        assert_eq!(told.map(|(_, turns, _)| turns), [Some(0), Some(16), Some(48), Some(64)]);
        assert_eq!(told.map(|(.., periods)| periods), [0, 1, 3, 4]);
    }

    #[test]
    fn another_resolution_leaves_no_turn_out_and_parts_of_a_scan_are_one_output() {
        // One turn each at 1 deg, then two at 0.5; parts of 181 and of 180 values.
        for (lengths, strides) in [([372_usize, 732], [1_u8, 2]), ([732, 372], [2, 1]), ([372, 370], [4, 4])]
        {
            let mut clock = ScanClock::default();
            let (mut turn, mut told) = (0_u8, Place::default());
            for n in 0..60_u8 {
                let part = if lengths[0].abs_diff(lengths[1]) > SAME_LENGTH { n / 30 } else { n % 2 };
                let indices = Indices { turn, telegram: Some(n) };
                let at = usize::from(part);
                told = clock.count(Some(indices), (lengths[at], n.into()), None);
                let next =
                    usize::from(if lengths[0].abs_diff(lengths[1]) > SAME_LENGTH { (n + 1) / 30 } else { 0 });
                turn = turn.wrapping_add(strides[next.min(1)]);
            }
            assert_eq!((told.number, told.periods), (59, 59), "{lengths:?}");
        }
    }
}
