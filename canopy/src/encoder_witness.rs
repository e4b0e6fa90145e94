//! What speaks against the encoder that the way goes by: scans that change where it says that they are of one place, and a speed that is not the rig's.
//!
//! Past a canopy scans differ the more, the farther they are apart along the row, up to where nothing of one is in the other. Each scan is compared with
//! the one [`LAG`] scans before: a pair is described by the share of its beams whose range changed by more than [`CHANGED_M`], of those that met
//! something in one of both, and by how far it is apart by the encoder. Pairs that it counts no farther apart than neighbours are elsewhere, and that
//! differ nearly as much as those a whole lag apart, refute it: it has stuck there, or misses most of its ticks. Leaves in the wind swing back: of one place,
//! a scan is like one of the last [`ANCHORS`] lags, and of several like none. Past what looks the same everywhere (bare ground, a wall) nothing changes
//! anywhere: then nothing is known, and nothing is said.
//!
//! Ticks that are missed evenly over all the way, or a wrong number of them a metre, make another speed. The speed of a drive is the one at which half its
//! way was driven: neither stops nor slow stretches between them change it much.

use std::collections::VecDeque;
use std::ops::RangeInclusive;

use rowscan_protocol::angle::BeamGrid;

use crate::changed_pairs::ChangedPairs;
use crate::picture_speed::PictureSpeed;
use crate::speeds::Speeds;
use crate::warning::Warning;

/// A range that changed by more is no noise, metres: several standard deviations of any scanner here.
const CHANGED_M: f64 = 0.1;
/// Scans from one to the one that it is compared with.
const LAG: usize = 10;
/// So many lags farther back, a scan that is of the same place by the encoder is compared with as well: a second or two, in which leaves swing to and fro.
const ANCHORS: usize = 9;
/// So near by the encoder, in lags at the rig's speed, scans may be of one place.
const NEAR_LAGS: f64 = 0.5;
/// Of a way that comes back, a scan is compared with one from before that is so near, in lags.
const SAME_PLACE_LAGS: f64 = 0.05;
/// Where such scans differ by so much of what a lag changes there, on average, they are of other places: 0.7 at most where leaves swing in 6 m/s.
const OTHER_PLACE: f64 = 0.75;
/// How much of the latest pair counts in what a lag changes just there.
const LATEST: f64 = 0.1;
/// Beams of a pair that must have met something.
const LEAST_BEAMS: u32 = 30;
/// Pairs that a share is told of.
const LEAST_PAIRS: u32 = 5;
/// Share of beams that must change while it counts, for scans to tell anything.
const LEAST_SHARE: f64 = 0.05;
/// Where neighbours differ by less than this less than scans a lag apart, only a stand can be told.
const LEAST_DIFFERENCE: f64 = 0.04;
/// From what neighbours differ by to what scans a lag apart do, so far lies the border of what refutes it.
const BORDER: f64 = 0.6;
/// Of the way between neighbours, pairs that are no farther apart are of one place; what lies between is told by how fast the picture moves.
const ROUNDED: f64 = 0.3;
/// The same for a stand, of what scans a lag apart differ by.
const BORDER_OF_STAND: f64 = 0.8;
/// A picture of which less changes over a lag stands still.
const STILL: f64 = 0.05;
/// An encoder whose ticks are farther apart than so many lines tells too little of where scans are.
const COARSEST_LINES: f64 = 2.0;

/// Share of scans that must refute it to be told.
const LEAST_STUCK: f64 = 0.01;
/// Share of scans that may before the way is unknown.
const MOST_STUCK: f64 = 0.03;
/// Speed by the encoder over the rig's that is no doubt.
const NO_DOUBT: RangeInclusive<f64> = 2.0 / 3.0..=1.5;
/// Beyond, one of both is of another scale, and the way is unknown.
const SAME_SCALE: RangeInclusive<f64> = 0.25..=4.0;
/// A speed is told of so much way, by the rig or by the encoder, metres.
const LEAST_WAY_M: f64 = 1.5;

/// Where a scan was taken, by the encoder, and when, since the first one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Counted {
    pub(crate) y_m: f64,
    pub(crate) travel_s: f64,
}

/// A scan that others are compared with.
#[derive(Clone, Debug)]
struct Kept {
    at: Counted,
    range_m: Vec<f64>,
}

/// Compares each scan with the one [`LAG`] before it.
#[derive(Clone, Debug)]
pub(crate) struct EncoderWitness {
    /// From tick to tick, metres; infinite of a rig without encoder.
    tick_m: f64,
    rig_m_s: f64,
    grid: BeamGrid,
    /// The latest scans, the oldest first.
    kept: VecDeque<Kept>,
    /// Of those before, each [`LAG`]th, the oldest first; and scans since the last of them.
    anchors: VecDeque<Kept>,
    since_anchor: usize,
    ticks: Option<u32>,
    /// When and where it counted last.
    counted: Option<Counted>,
    /// The way at each speed.
    speeds: Speeds,
    /// The latest scan, seconds of travel; and its way so far by the encoder, metres.
    latest_s: f64,
    way_m: f64,
    pairs: ChangedPairs,
    /// Of one place by the encoder: by what changed over what a lag changes there.
    at_place: ChangedPairs,
    /// What a lag changed on average lately, and ever: Σ and count.
    lately: Option<f64>,
    ever: (f64, f64),
    /// Where the way comes back: Σ of what changed over what a lag changes there, and pairs; the farthest place, metres, and scans well before it.
    again: (f64, u32),
    farthest_m: f64,
    behind: u64,
    /// Σ way between neighbours, and of that times the share that changed.
    neighbours: (f64, f64),
    picture: PictureSpeed,
}

/// The share of two scans' beams that changed; `None` where too few met anything.
fn changed(before: &[f64], now: &[f64]) -> Option<f64> {
    let (mut compared, mut changed) = (0, 0);
    for (before, now) in before.iter().zip(now) {
        let (was_hit, is_hit) = (before.is_finite(), now.is_finite());
        // Of a range that is not a number nobody knows what was met.
        if before.is_nan() || now.is_nan() || !(was_hit || is_hit) {
            continue;
        }
        compared += 1;
        changed += u32::from(was_hit != is_hit || (before - now).abs() > CHANGED_M);
    }
    (compared >= LEAST_BEAMS).then(|| f64::from(changed) / f64::from(compared))
}

impl EncoderWitness {
    /// Of an encoder with ticks so far apart, on a tractor that drives as fast by its rig.
    pub(crate) fn new(tick_m: f64, rig_m_s: f64) -> Self {
        Self {
            tick_m,
            rig_m_s,
            grid: BeamGrid::default(),
            kept: VecDeque::new(),
            anchors: VecDeque::new(),
            since_anchor: 0,
            ticks: None,
            counted: None,
            speeds: Speeds::default(),
            latest_s: 0.0,
            way_m: 0.0,
            pairs: ChangedPairs::default(),
            at_place: ChangedPairs::default(),
            lately: None,
            ever: (0.0, 0.0),
            again: (0.0, 0),
            farthest_m: f64::NEG_INFINITY,
            behind: 0,
            neighbours: (0.0, 0.0),
            picture: PictureSpeed::of_lag(LAG),
        }
    }

    /// From tick to tick, metres; infinite of a rig without encoder.
    pub(crate) fn tick_m(&self) -> f64 {
        self.tick_m
    }

    /// Takes a scan whose encoder had counted so far, at this place and time; at the rig's speed lines are `line_m` apart.
    pub(crate) fn observe(&mut self, ticks: u32, at: Counted, line_m: f64, grid: BeamGrid, range_m: &[f64]) {
        if self.ticks != Some(ticks)
            && let Some(before) = self.counted.replace(at)
        {
            let way_m = (at.y_m - before.y_m).abs();
            self.way_m += way_m;
            self.speeds.count(way_m, at.travel_s - before.travel_s);
        }
        (self.ticks, self.latest_s) = (Some(ticks), at.travel_s);
        if self.tick_m > COARSEST_LINES * line_m {
            return;
        }
        if self.grid != grid || self.kept.back().is_some_and(|kept| kept.range_m.len() != range_m.len()) {
            self.kept.clear();
            self.anchors.clear();
            self.picture.forget_neighbours();
            self.grid = grid;
        }
        if let Some(neighbour) = self.kept.back() {
            let way_m = (at.y_m - neighbour.at.y_m).abs();
            let share = changed(&neighbour.range_m, range_m);
            if let Some(share) = share.filter(|_| way_m > 0.0) {
                self.neighbours.0 += way_m;
                self.neighbours.1 += way_m * share;
            }
            self.picture.add_neighbours(way_m, share);
        }
        let mut room = Vec::new();
        if self.kept.len() >= LAG
            && let Some(oldest) = self.kept.pop_front()
        {
            if let Some(share) = changed(&oldest.range_m, range_m) {
                let lag_m = LAG as f64 * line_m;
                let lags = |kept: &Kept| (at.y_m - kept.at.y_m).abs() / lag_m;
                let is_near = |kept: &Kept| lags(kept) < NEAR_LAGS;
                let lags_now = lags(&oldest);
                self.picture.add(lags_now, lags_now * lag_m, share);
                if is_near(&oldest) {
                    let least = self.least_changed(share, range_m, is_near);
                    least.into_iter().for_each(|least| self.add_at_place(lags_now, least));
                } else {
                    self.pairs.add(lags_now, share);
                    let here = |kept: &&Kept| lags(kept) < SAME_PLACE_LAGS;
                    let again =
                        self.anchors.iter().find(here).and_then(|kept| changed(&kept.range_m, range_m));
                    if let Some(of_a_lag) = again.and_then(|share| self.of_a_lag(share)) {
                        self.again = (self.again.0 + of_a_lag, self.again.1 + 1);
                    }
                    self.lately =
                        Some(self.lately.map_or(share, |before| before + LATEST * (share - before)));
                    self.ever = (self.ever.0 + share, self.ever.1 + 1.0);
                }
                self.farthest_m = self.farthest_m.max(at.y_m);
                self.behind += u64::from(self.farthest_m - at.y_m > NEAR_LAGS * lag_m);
            }
            room = self.anchor(oldest);
        }
        room.clear();
        room.extend_from_slice(range_m);
        self.kept.push_back(Kept { at, range_m: room });
    }

    /// What changed over what a lag changes just there, 1 at most: where trees are dense, leaves in the wind change more than the row does on average. `None`
    /// before it ever counted.
    fn of_a_lag(&self, share: f64) -> Option<f64> {
        let a_lag = self.lately?.max(self.ever.0 / self.ever.1);
        Some(if a_lag > 0.0 { (share / a_lag).min(1.0) } else { 0.0 })
    }

    /// Adds a pair of one place by the encoder.
    fn add_at_place(&mut self, lags: f64, share: f64) {
        match self.of_a_lag(share) {
            Some(of_a_lag) => self.at_place.add(lags, of_a_lag),
            None => self.pairs.add(lags, share),
        }
    }

    /// How much changed since the scan of this place that is most like it, a lag before or more; `None` where there is none but that a lag before: a stop that
    /// is over by then tells nothing.
    fn least_changed(&self, since_lag: f64, range_m: &[f64], is_near: impl Fn(&Kept) -> bool) -> Option<f64> {
        let mut near = self.anchors.iter().rev().take_while(|kept| is_near(kept)).peekable();
        near.peek()?;
        Some(near.filter_map(|kept| changed(&kept.range_m, range_m)).fold(since_lag, f64::min))
    }

    /// Keeps each [`LAG`]th of the scans a lag back; the room of one that is not needed any more.
    fn anchor(&mut self, kept: Kept) -> Vec<f64> {
        self.since_anchor += 1;
        if self.since_anchor < LAG {
            return kept.range_m;
        }
        self.since_anchor = 0;
        let oldest = if self.anchors.len() >= ANCHORS { self.anchors.pop_front() } else { None };
        self.anchors.push_back(kept);
        oldest.map_or_else(Vec::new, |oldest| oldest.range_m)
    }

    /// Scans that the encoder says are of one place, and that differ as those of several.
    pub(crate) fn stuck(&self) -> u64 {
        let Some(speed_m_s) = self.speeds.median_m_s() else { return 0 };
        let typical = speed_m_s / self.rig_m_s;
        let slow_beside_picture = self.picture.refuting(typical);
        let (pairs, far) = ChangedPairs::mean(self.pairs.between(typical / 2.0, f64::INFINITY));
        if pairs < LEAST_PAIRS || far < LEAST_SHARE {
            return slow_beside_picture;
        }
        let near = self.neighbours.1 / self.neighbours.0;
        let (most, border) = if far - near >= LEAST_DIFFERENCE {
            // Neighbours are a lag's part apart.
            (ROUNDED * typical / LAG as f64, near + BORDER * (far - near))
        } else {
            (0.0, BORDER_OF_STAND * far)
        };
        let beyond = |pairs: &ChangedPairs, border: f64| -> u64 {
            let at_one_place = pairs.between(0.0, most);
            at_one_place.filter(|(share, _)| *share > border).map(|(_, pairs)| u64::from(pairs)).sum()
        };
        // A way that comes back over other places goes on.
        let (sum, again) = self.again;
        let is_other = again >= LEAST_PAIRS && sum > OTHER_PLACE * f64::from(again);
        let behind = if is_other { self.behind } else { 0 };
        beyond(&self.pairs, border) + beyond(&self.at_place, border / far) + behind + slow_beside_picture
    }

    /// True where the picture stood still while the encoder counted nothing: the tractor stands, or drives along what looks the same everywhere.
    pub(crate) fn stands(&self) -> bool {
        let (pairs, share) = ChangedPairs::mean(self.pairs.between(0.0, 0.0));
        self.way_m == 0.0 && pairs >= LEAST_PAIRS && share < STILL
    }

    /// The speed by the encoder at which half the way was driven, m/s, if it lies outside `range` times the rig's.
    fn speed_outside(&self, range: &RangeInclusive<f64>) -> Option<f64> {
        let is_told = self.latest_s * self.rig_m_s >= LEAST_WAY_M || self.way_m >= LEAST_WAY_M;
        let speed_m_s = self.speeds.median_m_s().filter(|_| is_told)?;
        (!range.contains(&(speed_m_s / self.rig_m_s))).then_some(speed_m_s)
    }

    /// True where too many scans refute it for the way to be known, of so many valid ones.
    pub(crate) fn is_stuck(&self, valid: u64) -> bool {
        self.stuck() as f64 > MOST_STUCK * valid as f64
    }

    /// True where its speed and the rig's are of different scales, so that the way is not known.
    pub(crate) fn has_other_scale(&self) -> bool {
        self.speed_outside(&SAME_SCALE).is_some()
    }

    /// What is to be told of it: scans against it, of so many valid ones, and a speed far off the rig's.
    pub(crate) fn doubts(&self, valid: u64) -> [Option<Warning>; 2] {
        let scans = self.stuck();
        let is_told = scans >= u64::from(LEAST_PAIRS) && scans as f64 > LEAST_STUCK * valid as f64;
        let off = self.speed_outside(&NO_DOUBT);
        [
            is_told.then_some(Warning::EncoderStuck { scans, of: valid }),
            off.map(|encoder_m_s| Warning::EncoderSpeed { encoder_m_s, rig_m_s: self.rig_m_s }),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::leaf_depth::leaf_depth_m;

    /// Ranges past a canopy at `y_m`: leaves of 5 cm with gaps between them; the ground looks the same everywhere.
    fn past_canopy(y_m: f64) -> Vec<f64> {
        let beams = (0..200_i64).map(|beam| if beam >= 150 { 2.0 } else { leaf_depth_m(beam, y_m) });
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
        let mut witness = EncoderWitness::new(1.0 / ticks_per_m, 1.0);
        let scans = (seconds * 50.0) as u64;
        for scan in 0..scans {
            let travel_s = scan as f64 / 50.0;
            let ticks = (counted_m(travel_s) * ticks_per_m) as u32;
            let at = Counted { y_m: f64::from(ticks) / ticks_per_m, travel_s };
            let grid = BeamGrid::spanning(0, 1_990_000, 10_000);
            witness.observe(ticks, at, 0.02, grid, &range_m(y_m(travel_s)));
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
            assert!(matches!(stuck.doubts(scans)[0], Some(Warning::EncoderStuck { .. })));
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
                let off = witness.doubts(scans)[1].is_some();
                let found = (off, witness.has_other_scale());
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
                assert_eq!(witness.doubts(scans), [None, None], "{ticks_per_m}");
            }
        }
    }

    #[test]
    fn an_encoder_that_goes_bad_on_the_way_is_told_wherever_that_begins() {
        for ticks_per_m in [100.0, 1000.0] {
            for from_s in [1.0, 3.0, 5.0] {
                for missed in [0.9, 0.95, 0.99] {
                    let counted = |s: f64| s.min(from_s) + (1.0 - missed) * (s - from_s).max(0.0);
                    let (witness, scans) = drive(8.0, past_canopy, |s| s, counted, ticks_per_m);
                    let case = format!("{missed} from {from_s} s at {ticks_per_m}: {}", witness.stuck());
                    assert!(witness.is_stuck(scans), "{case}");
                    assert!(witness.doubts(scans)[0].is_some(), "{case}");
                    // Bad before, and in order from then on.
                    let counted = |s: f64| (1.0 - missed) * s.min(from_s) + (s - from_s).max(0.0);
                    let (witness, scans) = drive(8.0, past_canopy, |s| s, counted, ticks_per_m);
                    assert!(witness.is_stuck(scans), "before: {case}");
                }
            }
        }
    }

    /// Most ticks are missed over a part of the way: the picture goes on at its pace. A tractor that drives slowly there sees a slow one.
    #[test]
    fn an_encoder_that_misses_most_of_its_ticks_for_a_while_is_told_and_a_slow_drive_is_not() {
        for ticks_per_m in [100.0, 1000.0] {
            for counted in [0.15, 0.2, 0.3, 0.4] {
                for slow_s in [3.0, 9.0] {
                    // The way by an encoder that misses them from 4 s on, and that of a tractor that is slow there.
                    let slow = |s: f64| {
                        s.min(4.0) + counted * (s - 4.0).clamp(0.0, slow_s) + (s - 4.0 - slow_s).max(0.0)
                    };
                    let (misses, scans) = drive(16.0, past_canopy, |s| s, slow, ticks_per_m);
                    let case = format!("{counted} for {slow_s} s at {ticks_per_m}");
                    assert!(misses.is_stuck(scans), "{case}: {} of {scans}", misses.stuck());
                    let (slows, _) = drive(16.0, past_canopy, slow, slow, ticks_per_m);
                    assert_eq!(slows.stuck(), 0, "{case}");
                }
            }
        }
    }

    /// Where the tractor crawls, scans a lag apart are as near as neighbours elsewhere, and before a dense tree they change as much as others do over a lag.
    #[test]
    fn a_crawl_before_a_dense_tree_of_a_sparse_row_is_no_doubt() {
        // Leaves from the second metre to the fourth; elsewhere a fifth of them.
        let dense = |y_m: f64| {
            let leaves = past_canopy(y_m).into_iter().enumerate();
            let is_there = |beam: usize| (2.0..4.0).contains(&y_m) || beam.is_multiple_of(5);
            leaves.map(|(beam, range_m)| if is_there(beam) { range_m } else { 2.0 }).collect()
        };
        for ticks_per_m in [100.0, 1000.0] {
            // Slower, a lag is less than a tick of the coarse one, and some pairs have none.
            for crawl in [0.07, 0.08, 0.1, 0.12, 0.15] {
                let way = |s: f64| s.min(1.9) + crawl * (s - 1.9).clamp(0.0, 9.0) + (s - 10.9).max(0.0);
                let (crawls, _) = drive(18.0, dense, way, way, ticks_per_m);
                assert_eq!(crawls.stuck(), 0, "{crawl} at {ticks_per_m}");
                let (misses, scans) = drive(18.0, dense, |s| s, way, ticks_per_m);
                assert!(misses.is_stuck(scans), "{crawl} at {ticks_per_m}: {}", misses.stuck());
                // Of small trees a lag changes a beam in thirty.
                let small = |y_m: f64| past_canopy(y_m).into_iter().chain([2.0; 800]).collect();
                let (crawls, _) = drive(18.0, small, way, way, ticks_per_m);
                assert_eq!(crawls.stuck(), 0, "small trees: {crawl} at {ticks_per_m}");
                let (misses, scans) = drive(18.0, small, |s| s, way, ticks_per_m);
                assert!(misses.is_stuck(scans), "small trees: {crawl} at {ticks_per_m}: {}", misses.stuck());
            }
        }
    }

    /// Leaves that a gust takes as far along the row as they are wide are elsewhere for its time, and back behind it: of a tractor that stands that is no doubt,
    /// and of an encoder that sticks the drive is seen all the same.
    #[test]
    fn leaves_that_swing_back_are_of_one_place() {
        let stops = |s: f64| s.min(2.0) + (s - 8.0).max(0.0);
        for ticks_per_m in [100.0, 1000.0] {
            for (period_s, way_m) in [(0.3, 0.06), (0.7, 0.06), (1.5, 0.06)] {
                let scan = std::cell::Cell::new(0_u32);
                let in_gusts = |y_m: f64| {
                    scan.set(scan.get() + 1);
                    let phase = f64::from(scan.get()) / 50.0 * std::f64::consts::TAU / period_s;
                    past_canopy(y_m + way_m * phase.sin())
                };
                let (stood, scans) = drive(12.0, in_gusts, stops, stops, ticks_per_m);
                let case = format!("{period_s} s, {way_m} m, {ticks_per_m} ticks");
                assert!(!stood.is_stuck(scans), "{case}: {} of {scans}", stood.stuck());
                scan.set(0);
                let (stuck, scans) = drive(12.0, in_gusts, |s| s, stops, ticks_per_m);
                assert!(stuck.is_stuck(scans), "{case}: {}", stuck.stuck());
            }
        }
    }

    /// An encoder whose channels are swapped for a while counts back over places that look otherwise; a tractor that backs up sees them again.
    #[test]
    fn a_way_that_comes_back_is_believed_where_the_picture_does_too() {
        let back = |s: f64| s - 2.0 * (s.clamp(4.0, 7.0) - 4.0);
        for ticks_per_m in [100.0, 1000.0] {
            let (swapped, scans) = drive(14.0, past_canopy, |s| s, back, ticks_per_m);
            assert!(swapped.is_stuck(scans), "{ticks_per_m}: {}", swapped.stuck());
            let (backs_up, scans) = drive(14.0, past_canopy, back, back, ticks_per_m);
            assert_eq!(backs_up.doubts(scans), [None, None], "{ticks_per_m}: {}", backs_up.stuck());
            // Again and again, among leaves that swing.
            let shunts = |s: f64| (s / 4.0).floor() + (s % 4.0).min(2.5) - (s % 4.0 - 2.5).max(0.0);
            let scan = std::cell::Cell::new(0_u32);
            let in_gusts = |y_m: f64| {
                scan.set(scan.get() + 1);
                past_canopy(y_m + 0.02 * (f64::from(scan.get()) / 50.0 * std::f64::consts::TAU / 0.7).sin())
            };
            let (shunted, scans) = drive(40.0, in_gusts, shunts, shunts, ticks_per_m);
            assert!(!shunted.is_stuck(scans), "{ticks_per_m}: {} of {scans}", shunted.stuck());
        }
    }

    /// A bad contact: half of the way is missing, though each second has some.
    #[test]
    fn an_encoder_that_sticks_in_bursts_has_another_speed() {
        for ticks_per_m in [100.0, 1000.0] {
            for period_ms in [40, 120, 200, 300] {
                let half = |s: f64| {
                    let (ms, half_ms) = ((1000.0 * s).round() as u32, period_ms / 2);
                    f64::from(ms / period_ms * half_ms + (ms % period_ms).min(half_ms)) / 1000.0
                };
                let (witness, scans) = drive(12.0, past_canopy, |s| s, half, ticks_per_m);
                assert!(witness.doubts(scans)[1].is_some(), "{period_ms} ms, {ticks_per_m} ticks");
            }
        }
    }

    /// Where trees stand far apart, a lag changes little on average: a stop before a tree whose leaves move is held against what changes there.
    #[test]
    fn a_stop_before_a_tree_of_a_sparse_row_is_no_doubt() {
        let sparse = |y_m: f64| match y_m % 4.0 {
            at_m if at_m < 1.0 => past_canopy(y_m),
            _ => vec![2.0; 200],
        };
        for ticks_per_m in [100.0, 1000.0] {
            let scan = std::cell::Cell::new(0_u32);
            let in_gusts = |y_m: f64| {
                scan.set(scan.get() + 1);
                sparse(y_m + 0.03 * (f64::from(scan.get()) / 50.0 * std::f64::consts::TAU / 0.7).sin())
            };
            let stops = |s: f64| s.min(4.5) + (s - 10.5).max(0.0);
            let (stood, scans) = drive(22.0, in_gusts, stops, stops, ticks_per_m);
            assert!(!stood.is_stuck(scans), "{ticks_per_m}: {} of {scans}", stood.stuck());
            scan.set(0);
            let sticks = |s: f64| s.min(4.2) + (s - 5.2).max(0.0);
            let (stuck, scans) = drive(22.0, in_gusts, |s| s, sticks, ticks_per_m);
            assert!(stuck.stuck() > 0, "{ticks_per_m}: {} of {scans}", stuck.stuck());
        }
    }

    #[test]
    fn a_crawl_and_leaves_in_the_wind_are_no_doubt() {
        // Half of the leaves swing while the tractor stands for three seconds in five.
        let stops = |s: f64| (s / 5.0).floor() * 2.0 + (s % 5.0).min(2.0);
        let crawls = |s: f64| if s < 3.0 { s } else { 3.0 + 0.05 * (s - 3.0) };
        for ticks_per_m in [100.0, 1000.0] {
            let scan = std::cell::Cell::new(0_i64);
            let in_wind = |y_m: f64| {
                scan.set(scan.get() + 1);
                let swings = |beam: i64| (beam * 31 + scan.get() * 17).rem_euclid(5) < 2;
                let beams = past_canopy(y_m).into_iter().zip(0..);
                beams.map(|(range_m, beam)| if beam < 150 && swings(beam) { 0.9 } else { range_m }).collect()
            };
            let (witness, scans) = drive(20.0, in_wind, stops, stops, ticks_per_m);
            assert_eq!(witness.doubts(scans)[0], None, "wind, {ticks_per_m}: {}", witness.stuck());
            let (witness, scans) = drive(20.0, past_canopy, crawls, crawls, ticks_per_m);
            assert_eq!(witness.doubts(scans), [None, None], "crawl, {ticks_per_m}");
        }
    }

    #[test]
    fn a_picture_that_stands_is_a_tractor_that_stands() {
        let (stands, _) = drive(4.0, past_canopy, |_| 1.0, |_| 0.0, 1000.0);
        let (dead, _) = drive(4.0, past_canopy, |s| s, |_| 0.0, 1000.0);
        let (drives, _) = drive(4.0, past_canopy, |s| s, |s| s, 1000.0);
        assert_eq!([stands.stands(), dead.stands(), drives.stands()], [true, false, false]);
    }
}
