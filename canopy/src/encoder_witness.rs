//! Whether the tractor stood while its encoder did: the scans themselves tell.
//!
//! Past a canopy consecutive scans differ as long as the tractor drives; while it stands they are alike, up to noise. A pair of scans is described by the
//! share of its beams whose range changed by more than [`CHANGED_M`], of those that met something in one of both. The share while the encoder counts
//! is what driving looks like here; an encoder that stands while scans differ about as much has stuck. Past what looks the same everywhere (bare
//! ground, a wall) nothing changes while it counts either: then nothing is known, and nothing is said.

use rowscan_protocol::angle::BeamGrid;

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
/// Mean speed by the encoder over the rig's that is no doubt.
const SPEED_RATIO: std::ops::RangeInclusive<f64> = 2.0 / 3.0..=1.5;
/// Way and time that a mean speed is told of.
const LEAST_WAY_M: f64 = 1.0;
const LEAST_S: f64 = 1.0;

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
    /// The way it counted without standing between, metres.
    way_m: f64,
    /// How long that took, seconds.
    way_s: f64,
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
            if self.ticks.is_some() && !stands {
                self.way_m += (y_m - self.counted_y_m).abs();
                self.way_s += travel_s - self.counted_s;
            }
            (self.counted_s, self.counted_y_m) = (travel_s, y_m);
        }
        self.ticks = Some(ticks);
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

    /// Mean speed by the encoder while it counted, m/s, once that was a while.
    pub(crate) fn speed_m_s(&self) -> Option<f64> {
        (self.way_m >= LEAST_WAY_M && self.way_s >= LEAST_S).then(|| self.way_m / self.way_s)
    }

    /// True where too many scans say that it sticks for the way to be known, of so many valid ones.
    pub(crate) fn is_refuted(&self, valid: u64) -> bool {
        self.stuck() as f64 > MOST_STUCK * valid as f64
    }

    /// What is to be told of it: scans against it, of so many valid ones, and a mean speed far off the rig's.
    pub(crate) fn doubts(&self, valid: u64, rig_m_s: f64) -> [Option<Warning>; 2] {
        let scans = self.stuck();
        let is_off = |encoder_m_s: &f64| !SPEED_RATIO.contains(&(encoder_m_s / rig_m_s));
        let off = self.speed_m_s().filter(is_off);
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
            assert_eq!((even.stuck(), even.is_refuted(scans)), (0, false), "{ticks_per_m}");
            let (stood, scans) = drive(8.0, past_canopy, stops, stops, ticks_per_m);
            assert_eq!((stood.stuck(), stood.is_refuted(scans)), (0, false), "{ticks_per_m}");
        }
        for ticks_per_m in [100.0, 1000.0] {
            let (stuck, scans) = drive(8.0, past_canopy, |s| s, stops, ticks_per_m);
            assert!((100..150).contains(&stuck.stuck()) && stuck.is_refuted(scans), "{}", stuck.stuck());
            // To the end of the row.
            let (stuck, scans) = drive(6.0, past_canopy, |s| s, |s| s.min(3.0), ticks_per_m);
            assert!((100..150).contains(&stuck.stuck()) && stuck.is_refuted(scans), "{}", stuck.stuck());
            assert!(matches!(stuck.doubts(scans, 1.0)[0], Some(Warning::EncoderStuck { .. })));
        }
    }

    #[test]
    fn where_all_looks_the_same_nothing_is_known() {
        let (wall, scans) = drive(8.0, |_| vec![1.5; 200], |s| s, |s| s.min(3.0), 1000.0);
        assert_eq!((wall.stuck(), wall.is_refuted(scans)), (0, false));
        let (bare, scans) = drive(8.0, |_| vec![f64::INFINITY; 200], |s| s, |s| s.min(3.0), 1000.0);
        assert_eq!((bare.stuck(), bare.is_refuted(scans)), (0, false));
    }

    #[test]
    fn a_mean_speed_far_off_the_rigs_is_told() {
        for (counted, told) in [(0.5, true), (0.7, false), (1.0, false), (1.4, false), (2.0, true)] {
            let (witness, scans) = drive(6.0, past_canopy, |s| s, |s| counted * s, 1000.0);
            let off = witness.doubts(scans, 1.0);
            assert_eq!(off[1].is_some(), told, "{counted}: {:?}", witness.speed_m_s());
            assert_eq!(off[0], None);
        }
        // Standing is no speed: by stop and go it is that of going.
        let (witness, _) =
            drive(20.0, past_canopy, |s| s, |s| (s / 4.0).floor() + (s % 4.0).min(1.0), 1000.0);
        let speed_m_s = witness.speed_m_s().unwrap();
        assert!((speed_m_s - 1.0).abs() < 0.1, "{speed_m_s}");
    }
}
