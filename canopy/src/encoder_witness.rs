//! What speaks against the encoder that the way goes by: scans that change while it stands, and a speed that is not the rig's.
//!
//! Past a canopy consecutive scans differ as long as the tractor drives; while it stands they are alike, up to noise. A pair of scans is described by the
//! share of its beams whose range changed by more than [`CHANGED_M`], of those that met something in one of both. The share while the encoder counts
//! is what driving looks like here; an encoder that stands while scans differ about as much has stuck. Past what looks the same everywhere (bare
//! ground, a wall) nothing changes while it counts either: then nothing is known, and nothing is said.
//!
//! Ticks that are missed evenly, or a wrong number of them a metre, make another speed of all the way. The speed of a drive is the one at which half its
//! way was driven: neither stops nor slow stretches between them change it much.

use std::ops::RangeInclusive;

use rowscan_protocol::angle::BeamGrid;

use crate::speeds::Speeds;
use crate::warning::Warning;

/// A range that changed by more is no noise, metres: several standard deviations of any scanner here.
const CHANGED_M: f64 = 0.1;
/// An encoder that has not counted for so long stands, seconds; a coarse one for longer.
const STANDS_AFTER_S: f64 = 0.5;
/// A coarse one: so many times as long as the rig's speed takes for a tick.
const STANDS_AFTER_TICKS: f64 = 4.0;
/// Pairs of scans that a share is told of.
const LEAST_PAIRS: u64 = 5;
/// Beams of all those pairs that must have changed while it counted.
const LEAST_CHANGED: u64 = 50;
/// Share of beams that must change while it counts, for scans to tell anything.
const LEAST_SHARE: f64 = 0.02;
/// Of what changes while it counts, so much may change while it stands: edges flicker.
const STILL: f64 = 0.5;

/// Share of scans in which the encoder may have stuck before the way is unknown.
const MOST_STUCK: f64 = 0.03;
/// Speed by the encoder over the rig's that is no doubt.
const NO_DOUBT: RangeInclusive<f64> = 2.0 / 3.0..=1.5;
/// Beyond, one of both is of another scale, and the way is unknown.
const SAME_SCALE: RangeInclusive<f64> = 0.25..=4.0;
/// A speed is told of so long a drive, seconds, and of so much way at the rig's speed, metres.
const LEAST_S: f64 = 2.0;
const LEAST_RIG_WAY_M: f64 = 2.0;

/// Where a scan was taken, by the encoder, and when, since the first one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Counted {
    pub(crate) y_m: f64,
    pub(crate) travel_s: f64,
}

/// Pairs of consecutive scans, and their beams.
#[derive(Clone, Copy, Debug, Default)]
struct Pairs {
    pairs: u64,
    /// Beams that met something in one of both scans.
    compared: u64,
    /// Those whose range changed.
    changed: u64,
}

impl Pairs {
    fn add(&mut self, before: &[f64], now: &[f64]) {
        self.pairs += 1;
        for (before, now) in before.iter().zip(now) {
            let (was_hit, is_hit) = (before.is_finite(), now.is_finite());
            // Of a range that is not a number nobody knows what was met.
            if before.is_nan() || now.is_nan() || !(was_hit || is_hit) {
                continue;
            }
            self.compared += 1;
            self.changed += u64::from(was_hit != is_hit || (before - now).abs() > CHANGED_M);
        }
    }

    fn share(&self) -> f64 {
        self.changed as f64 / self.compared.max(1) as f64
    }
}

/// Compares each scan with the one before it.
#[derive(Clone, Debug, Default)]
pub(crate) struct EncoderWitness {
    grid: BeamGrid,
    before: Vec<f64>,
    ticks: Option<u32>,
    /// When it counted last, seconds of travel.
    counted_s: f64,
    /// Where that was, metres.
    counted_y_m: f64,
    /// The way at each speed, from count to count.
    speeds: Speeds,
    /// The latest scan, seconds of travel.
    latest_s: f64,
    /// While it counted.
    driving: Pairs,
    /// Since it stands.
    stretch: Pairs,
    /// Scans while it stood and others changed.
    stuck: u64,
}

impl EncoderWitness {
    /// Takes a scan whose encoder had counted so far, at this place and time; `tick_s` is what the rig's speed takes for a tick.
    pub(crate) fn observe(&mut self, ticks: u32, at: Counted, tick_s: f64, grid: BeamGrid, range_m: &[f64]) {
        let Counted { y_m, travel_s } = at;
        let is_pair = self.ticks.is_some() && self.grid == grid && self.before.len() == range_m.len();
        let counts = self.ticks != Some(ticks);
        let stands = travel_s - self.counted_s > STANDS_AFTER_S.max(STANDS_AFTER_TICKS * tick_s);
        match (counts, is_pair) {
            // The first count after a stand: some of the time between both scans it stood.
            (true, _) if self.stretch.pairs > 0 => self.end_stretch(),
            (true, true) => self.driving.add(&self.before, range_m),
            (false, true) if stands => self.stretch.add(&self.before, range_m),
            _ => {}
        }
        if counts {
            if self.ticks.is_some() {
                self.speeds.add((y_m - self.counted_y_m).abs(), travel_s - self.counted_s);
            }
            (self.counted_s, self.counted_y_m) = (travel_s, y_m);
        }
        self.ticks = Some(ticks);
        self.latest_s = travel_s;
        self.grid = grid;
        self.before.clear();
        self.before.extend_from_slice(range_m);
    }

    fn end_stretch(&mut self) {
        self.stuck += self.stuck_now();
        self.stretch = Pairs::default();
    }

    /// Scans of the stretch in which it stands now, if others changed meanwhile.
    fn stuck_now(&self) -> u64 {
        let Self { driving, stretch, .. } = self;
        let is_known = driving.pairs.min(stretch.pairs) >= LEAST_PAIRS
            && driving.changed >= LEAST_CHANGED
            && driving.share() >= LEAST_SHARE;
        if is_known && stretch.share() > STILL * driving.share() { stretch.pairs } else { 0 }
    }

    /// The speed by the encoder at which half the way was driven, m/s, if it lies outside `range` times the rig's.
    fn speed_outside(&self, range: &RangeInclusive<f64>, rig_m_s: f64) -> Option<f64> {
        let is_told = self.latest_s >= LEAST_S && self.latest_s * rig_m_s >= LEAST_RIG_WAY_M;
        let speed_m_s = self.speeds.median_m_s().filter(|_| is_told)?;
        (!range.contains(&(speed_m_s / rig_m_s))).then_some(speed_m_s)
    }

    /// True where too many scans say that it sticks for the way to be known, of so many valid ones.
    pub(crate) fn is_stuck(&self, valid: u64) -> bool {
        self.stuck() as f64 > MOST_STUCK * valid as f64
    }

    /// True where its speed and the rig's are of different scales, so that the way is not known.
    pub(crate) fn has_other_scale(&self, rig_m_s: f64) -> bool {
        self.speed_outside(&SAME_SCALE, rig_m_s).is_some()
    }

    /// What is to be told of it: scans against it, of so many valid ones, and a speed far off the rig's.
    pub(crate) fn doubts(&self, valid: u64, rig_m_s: f64) -> [Option<Warning>; 2] {
        let scans = self.stuck();
        let off = self.speed_outside(&NO_DOUBT, rig_m_s);
        [
            (scans > 0).then_some(Warning::EncoderStuck { scans, of: valid }),
            off.map(|encoder_m_s| Warning::EncoderSpeed { encoder_m_s, rig_m_s }),
        ]
    }

    /// Scans in which the encoder stood, and the tractor did not.
    pub(crate) fn stuck(&self) -> u64 {
        self.stuck + self.stuck_now()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ranges past a canopy at `y_m`: leaves of 5 cm with gaps between them; the ground looks the same everywhere.
    fn past_canopy(y_m: f64) -> Vec<f64> {
        let leaf = (y_m / 0.05).floor() as i64;
        let beams = (0..200_i64).map(|beam| match (beam * 7919 + leaf * 104_729).rem_euclid(10) {
            _ if beam >= 150 => 2.0,
            0..=3 => f64::INFINITY,
            depth => 1.0 + 0.2 * depth as f64,
        });
        beams.collect()
    }

    /// A drive at 1 m/s and 50 scans a second: where the tractor is, and what its encoder has counted, at each time.
    fn drive(
        seconds: f64,
        range_m: impl Fn(f64) -> Vec<f64>,
        y_m: impl Fn(f64) -> f64,
        counted_m: impl Fn(f64) -> f64,
        ticks_per_m: f64,
    ) -> (EncoderWitness, u64) {
        let mut witness = EncoderWitness::default();
        let scans = (seconds * 50.0) as u64;
        for scan in 0..scans {
            let travel_s = scan as f64 / 50.0;
            let ticks = (counted_m(travel_s) * ticks_per_m) as u32;
            let at = Counted { y_m: f64::from(ticks) / ticks_per_m, travel_s };
            let grid = BeamGrid::spanning(0, 1_990_000, 10_000);
            witness.observe(ticks, at, 1.0 / ticks_per_m, grid, &range_m(y_m(travel_s)));
        }
        (witness, scans)
    }

    #[test]
    fn an_encoder_that_sticks_is_told_and_a_tractor_that_stands_is_not() {
        let stops = |at_s: f64| at_s.min(2.0) + (at_s - 5.0).max(0.0);
        // A coarse encoder has a tick each half metre: between two of them it does not stand.
        for ticks_per_m in [2.0, 100.0, 1000.0] {
            let (even, scans) = drive(8.0, past_canopy, |s| s, |s| s, ticks_per_m);
            assert_eq!((even.stuck(), even.is_stuck(scans)), (0, false), "{ticks_per_m}");
            let (stood, scans) = drive(8.0, past_canopy, stops, stops, ticks_per_m);
            assert_eq!((stood.stuck(), stood.is_stuck(scans)), (0, false), "{ticks_per_m}");
        }
        for ticks_per_m in [100.0, 1000.0] {
            let (stuck, scans) = drive(8.0, past_canopy, |s| s, stops, ticks_per_m);
            assert!((100..150).contains(&stuck.stuck()) && stuck.is_stuck(scans), "{}", stuck.stuck());
            // To the end of the row.
            let (stuck, scans) = drive(6.0, past_canopy, |s| s, |s| s.min(3.0), ticks_per_m);
            assert!((100..150).contains(&stuck.stuck()) && stuck.is_stuck(scans), "{}", stuck.stuck());
            assert!(matches!(stuck.doubts(scans, 1.0)[0], Some(Warning::EncoderStuck { .. })));
        }
    }

    #[test]
    fn where_all_looks_the_same_nothing_is_known() {
        let (wall, scans) = drive(8.0, |_| vec![1.5; 200], |s| s, |s| s.min(3.0), 1000.0);
        assert_eq!((wall.stuck(), wall.is_stuck(scans)), (0, false));
        let (bare, scans) = drive(8.0, |_| vec![f64::INFINITY; 200], |s| s, |s| s.min(3.0), 1000.0);
        assert_eq!((bare.stuck(), bare.is_stuck(scans)), (0, false));
    }

    #[test]
    fn a_speed_far_off_the_rigs_is_told_and_of_another_scale_no_way_is_known() {
        // All but a part of the ticks are missed, or each is counted more than once; down to a few ticks a row.
        for ticks_per_m in [2.0, 100.0, 1000.0] {
            for (counted, told, unknown) in [
                (0.002, true, true),
                (0.01, true, true),
                (0.1, true, true),
                (0.5, true, false),
                (0.75, false, false),
                (1.0, false, false),
                (1.4, false, false),
                (2.0, true, false),
                (5.0, true, true),
            ] {
                let (witness, scans) = drive(20.0, past_canopy, |s| s, |s| counted * s, ticks_per_m);
                if counted * 20.0 * ticks_per_m < 2.0 {
                    // It has counted once or never, which others tell.
                    continue;
                }
                let off = witness.doubts(scans, 1.0)[1].is_some();
                let found = (off, witness.has_other_scale(1.0));
                assert_eq!(found, (told, unknown), "{counted} of {ticks_per_m} ticks");
            }
        }
    }

    #[test]
    fn stops_and_slow_stretches_are_no_doubt() {
        let stop_and_go = |s: f64| (s / 4.0).floor() + (s % 4.0).min(1.0);
        // At walking pace at each tree, and as told between them.
        let slow_at_trees =
            |s: f64| (s / 4.0).floor() * 2.0 + if s % 4.0 < 2.5 { 0.2 * (s % 4.0) } else { s % 4.0 - 2.0 };
        for ticks_per_m in [2.0, 100.0, 1000.0] {
            for way in [&stop_and_go as &dyn Fn(f64) -> f64, &slow_at_trees] {
                let (witness, scans) = drive(40.0, past_canopy, way, way, ticks_per_m);
                assert_eq!(witness.doubts(scans, 1.0), [None, None], "{ticks_per_m}");
            }
        }
    }
}
