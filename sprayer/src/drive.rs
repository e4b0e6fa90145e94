//! The tractor's drive as pieces of cubics: where it is at a time, and at what times it passes a place.

use rowscan_protocol::time::SimTime;
use rowscan_vehicle::trajectory::{Alley, Motion};
use serde::{Deserialize, Serialize};

use crate::span::{Span, Spans};

/// How far a piece may be off the drive, metres.
const OFF_M: f64 = 1e-7;
/// The longest piece that is tried, ns.
const LONGEST_NS: u64 = 250_000_000;
/// The shortest: speed may jump, ns.
const SHORTEST_NS: u64 = 200;
/// A piece that is no longer may be what is left of a jump, seconds.
const JUMP_S: f64 = 1e-6;

/// A stretch of time in which Y is a cubic.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DrivePiece {
    /// When, seconds.
    pub time: Span,
    /// Y of the tractor at its ends, metres.
    pub y_m: [f64; 2],
    /// Its speed along Y at its ends, m/s.
    pub along_m_s: [f64; 2],
    /// The alley it is in, and whether that is driven towards −Y; none on the headland.
    pub alley: Option<(i32, bool)>,
    /// The row at whose foot the tractor stands, on a slope; none: of each nozzle the row that it sprays at.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stands_by: Option<i32>,
}

impl DrivePiece {
    /// Y at `at`, metres.
    pub fn y_m(&self, at: f64) -> f64 {
        let long_s = self.time.length();
        if long_s <= 0.0 {
            return self.y_m[0];
        }
        let u = (at - self.time.from) / long_s;
        let ([y0, y1], [v0, v1]) = (self.y_m, self.along_m_s);
        let (w, square) = (1.0 - u, u * u);
        y0 * (1.0 + 2.0 * u) * w * w + y1 * square * (3.0 - 2.0 * u) + long_s * u * w * (v0 * w - v1 * u)
    }

    /// Speed along Y at `at`, m/s, as `a u² + b u + c` of the share of time u.
    fn speed(&self) -> [f64; 3] {
        let ([y0, y1], [v0, v1]) = (self.y_m, self.along_m_s);
        let mean = (y1 - y0) / self.time.length();
        [3.0 * (v0 + v1 - 2.0 * mean), 2.0 * (3.0 * mean - 2.0 * v0 - v1), v0]
    }

    /// Speed along Y at `at`, m/s.
    pub fn along_m_s(&self, at: f64) -> f64 {
        let [a, b, c] = self.speed();
        let u = (at - self.time.from) / self.time.length();
        (a * u + b) * u + c
    }

    /// 1 where the tractor's own direction is +Y, −1 where it is −Y.
    pub fn ahead(&self) -> f64 {
        if self.alley.is_some_and(|(_, backwards)| backwards) { -1.0 } else { 1.0 }
    }

    /// The times of the piece at which the speed along Y is `v_m_s`.
    fn times_of_speed(&self, v_m_s: f64) -> impl Iterator<Item = f64> {
        let [a, b, c] = self.speed();
        let (from, long_s) = (self.time.from, self.time.length());
        let roots = quadratic(a, b, c - v_m_s).into_iter().flatten();
        roots.filter(|u| *u > 0.0 && *u < 1.0).map(move |u| from + u * long_s)
    }

    /// How much higher the tractor stands than the foot of this row, metres, where each row stands so much higher than the one before.
    pub(crate) fn above_m(&self, row: i32, rise_a_row_m: f64) -> f64 {
        self.stands_by.map_or(0.0, |stands_by| rise_a_row_m * f64::from(stands_by - row))
    }

    /// The piece in parts, in each of which Y only grows or only falls.
    pub fn monotone(&self) -> impl Iterator<Item = Span> + use<> {
        let mut cuts: Vec<f64> =
            [self.time.from].into_iter().chain(self.times_of_speed(0.0)).chain([self.time.to]).collect();
        cuts.sort_by(f64::total_cmp);
        let pairs: Vec<Span> = cuts.windows(2).map(|pair| Span::new(pair[0], pair[1])).collect();
        pairs.into_iter().filter(|part| part.length() > 0.0)
    }

    /// When Y is `y_m` in a part in which it only grows or only falls; its nearer end where it is not.
    pub fn time_at(&self, part: Span, y_m: f64) -> f64 {
        let (first, last) = (self.y_m(part.from), self.y_m(part.to));
        let grows = last > first;
        if last == first {
            return part.from;
        }
        if (y_m <= first) == grows {
            return part.from;
        }
        if (y_m >= last) == grows {
            return part.to;
        }
        let (mut low, mut high) = (part.from, part.to);
        // A straight line is hit at once; else halves, with the secant where that is inside.
        let mut guess = low + (high - low) * (y_m - first) / (last - first);
        for _ in 0..200 {
            let off = self.y_m(guess) - y_m;
            if off.abs() < 1e-13 {
                return guess;
            }
            if (off < 0.0) == grows {
                low = guess
            } else {
                high = guess
            }
            let slope = self.along_m_s(guess);
            let newton = guess - off / slope;
            guess = if newton > low && newton < high { newton } else { low.midpoint(high) };
            if high - low < 1e-13 {
                return guess;
            }
        }
        guess
    }
}

/// Real roots of a u² + b u + c.
fn quadratic(a: f64, b: f64, c: f64) -> [Option<f64>; 2] {
    if a.abs() < 1e-12 {
        return [(b.abs() > 1e-12).then(|| -c / b), None];
    }
    let root = b * b - 4.0 * a * c;
    if root < 0.0 {
        return [None, None];
    }
    let q = -0.5 * (b + root.sqrt().copysign(b));
    [Some(q / a), (q != 0.0).then(|| c / q)]
}

/// A drive, from a time to another.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Drive(Vec<DrivePiece>);

impl Drive {
    /// The drive that `motion` is, between two instants. Pieces are as long as a cubic follows it to a tenth of a micrometre.
    pub fn of(motion: impl Fn(SimTime) -> Motion, from: SimTime, to: SimTime) -> Self {
        let mut drive = Self(Vec::new());
        let mut at = from.0;
        while at < to.0 {
            let next = (at + LONGEST_NS).min(to.0);
            drive.add(&motion, (at, &State::of(&motion, at)), (next, &State::of(&motion, next)));
            at = next;
        }
        drive
    }

    fn add(
        &mut self,
        motion: &impl Fn(SimTime) -> Motion,
        (t0, first): (u64, &State),
        (t1, last): (u64, &State),
    ) {
        let time = Span::new(SimTime(t0).as_secs_f64(), SimTime(t1).as_secs_f64());
        let y_m = [first.y_m, last.y_m];
        let piece = DrivePiece {
            time,
            y_m,
            along_m_s: [first.along_m_s, last.along_m_s],
            alley: first.alley,
            stands_by: first.stands_by,
        };
        let middle = t0 + (t1 - t0) / 2;
        let fits = |at: u64| {
            let (state, s) = (State::of(motion, at), SimTime(at).as_secs_f64());
            // A speed that jumps between is seen in the speed sooner than in the way.
            let is_near = (piece.y_m(s) - state.y_m).abs() < OFF_M
                && (piece.along_m_s(s) - state.along_m_s).abs() < 1e-4;
            state.alley == first.alley && is_near
        };
        let is_whole = last.alley == first.alley
            && [t0 + (t1 - t0) / 4, middle, t0 + (t1 - t0) / 4 * 3].into_iter().all(fits);
        if t1 - t0 > SHORTEST_NS && !is_whole {
            let between = State::of(motion, middle);
            self.add(motion, (t0, first), (middle, &between));
            self.add(motion, (middle, &between), (t1, last));
            return;
        }
        let piece = if is_whole { piece } else { piece.jumped() };
        match self.0.last_mut() {
            Some(before) if before.goes_on_in(&piece) => {
                (before.time.to, before.y_m[1]) = (piece.time.to, piece.y_m[1])
            }
            _ => self.0.push(piece),
        }
    }

    /// Its pieces, in the order of time.
    pub fn pieces(&self) -> &[DrivePiece] {
        &self.0
    }

    /// From its beginning to its end, seconds.
    pub fn time(&self) -> Span {
        match (self.0.first(), self.0.last()) {
            (Some(first), Some(last)) => Span::new(first.time.from, last.time.to),
            _ => Span::new(0.0, 0.0),
        }
    }

    /// The piece at `at`; the nearest one before and after the drive.
    pub fn piece(&self, at: f64) -> Option<&DrivePiece> {
        let next = self.0.partition_point(|piece| piece.time.from <= at);
        self.0.get(next.saturating_sub(1))
    }

    /// Y at `at`, metres.
    pub fn y_m(&self, at: f64) -> f64 {
        self.piece(at).map_or(0.0, |piece| piece.y_m(at.clamp(piece.time.from, piece.time.to)))
    }

    /// Speed ahead at `at`, m/s; negative in reverse.
    pub fn speed_m_s(&self, at: f64) -> f64 {
        self.piece(at)
            .map_or(0.0, |piece| piece.ahead() * piece.along_m_s(at.clamp(piece.time.from, piece.time.to)))
    }

    /// When it goes ahead in an alley faster than `least_m_s`.
    pub fn going(&self, least_m_s: f64) -> Spans {
        let in_alleys = self.0.iter().filter(|piece| piece.alley.is_some());
        in_alleys.flat_map(|piece| piece.faster(piece.ahead() * least_m_s, piece.ahead())).collect()
    }

    /// When it goes backwards in an alley faster than `least_m_s`.
    pub fn reversing(&self, least_m_s: f64) -> Spans {
        let in_alleys = self.0.iter().filter(|piece| piece.alley.is_some());
        in_alleys.flat_map(|piece| piece.faster(-piece.ahead() * least_m_s, -piece.ahead())).collect()
    }

    /// Where the speed along Y jumps, with the number of metres per second by which it does.
    pub fn jumps(&self) -> Vec<(Span, f64)> {
        // Between the pieces before and behind a jump are such as are made of it. Beside another alley, place and direction jump, too.
        let whole: Vec<&DrivePiece> = self.0.iter().filter(|piece| piece.time.length() > JUMP_S).collect();
        let pairs =
            whole.iter().zip(whole.iter().skip(1)).filter(|(before, behind)| before.alley == behind.alley);
        pairs
            .map(|(before, behind)| {
                let ([_, v0], [v1, _]) = (before.along_m_s, behind.along_m_s);
                (Span::new(before.time.to, behind.time.from), v1 - v0)
            })
            .collect()
    }

    /// When it is on the headland.
    pub fn turning(&self) -> Spans {
        self.0.iter().filter(|piece| piece.alley.is_none()).map(|piece| piece.time).collect()
    }
}

impl DrivePiece {
    /// When `sign` times the speed along Y is above `sign` times `v_m_s`.
    fn faster(&self, v_m_s: f64, sign: f64) -> Vec<Span> {
        let mut cuts: Vec<f64> =
            [self.time.from].into_iter().chain(self.times_of_speed(v_m_s)).chain([self.time.to]).collect();
        cuts.sort_by(f64::total_cmp);
        let parts = cuts.windows(2).map(|pair| Span::new(pair[0], pair[1]));
        parts.filter(|part| sign * (self.along_m_s(part.from.midpoint(part.to)) - v_m_s) > 0.0).collect()
    }

    /// The same, straight from its beginning to its end: something jumps in it.
    fn jumped(self) -> Self {
        let mean = (self.y_m[1] - self.y_m[0]) / self.time.length();
        Self { along_m_s: [mean; 2], ..self }
    }

    /// True if both are one straight line.
    fn goes_on_in(&self, next: &Self) -> bool {
        let [v, ..] = self.along_m_s;
        let speeds = self.along_m_s.iter().chain(&next.along_m_s);
        let is_steady = speeds.into_iter().all(|other| (other - v).abs() < 1e-9);
        let expected_m = self.y_m[0] + v * (next.time.to - self.time.from);
        is_steady && self.alley == next.alley && (expected_m - next.y_m[1]).abs() < OFF_M
    }
}

/// The tractor at one instant, as far as rows are concerned.
struct State {
    y_m: f64,
    along_m_s: f64,
    alley: Option<(i32, bool)>,
    stands_by: Option<i32>,
}

impl State {
    fn of(motion: &impl Fn(SimTime) -> Motion, at: u64) -> Self {
        let motion = motion(SimTime(at));
        let along_m_s = motion.speed_m_s * libm::cos(motion.place.heading_rad);
        let alley = motion.place.alley.map(|Alley { number, backwards }| (number, backwards));
        Self { y_m: motion.place.y_m, along_m_s, alley, stands_by: motion.place.stands_by }
    }
}

#[cfg(test)]
mod tests {
    use rowscan_vehicle::Tractor;
    use rowscan_vehicle::trajectory::{Course, SpeedProfile, Trajectory};

    use super::*;

    fn drive_of(trajectory: Trajectory, began_s: f64, to_s: f64) -> (Drive, Tractor) {
        let ns = |s: f64| SimTime((s * 1e9) as u64);
        let tractor = Tractor::new(trajectory);
        tractor.begin(ns(began_s));
        (Drive::of(|at| tractor.motion(at), SimTime::ZERO, ns(to_s)), tractor)
    }

    #[test]
    fn a_steady_drive_is_a_line_and_a_stop_two_cubics_more() {
        let (drive, _) = drive_of(Trajectory::straight(-1.0, 1.5), 0.0, 60.0);
        assert_eq!(drive.pieces().len(), 1);
        assert!((drive.y_m(40.0) - 59.0).abs() < 1e-6);
        let (waits, _) = drive_of(Trajectory::straight(-1.0, 1.5), 2.0, 60.0);
        assert!((2..=4).contains(&waits.pieces().len()), "{:?}", waits.pieces());
        assert!((waits.going(0.1).length() - 58.0).abs() < 1e-6);
    }

    #[test]
    fn it_follows_stops_reverse_and_turns() {
        let profile = SpeedProfile::builder(0.0, 0.0)
            .leg(2.0, 1.5, 0.0)
            .steady(8.0, 1.5, 0.0)
            .leg(1.3, -0.5, 0.0)
            .steady(2.0, -0.5, 0.0)
            .leg(3.0, 2.0, 0.0);
        let course = Course { start_m: -1.0, turns: Some((3, 15.0)), ..Course::default() };
        let (drive, tractor) = drive_of(Trajectory::new(profile.hold(), course, 0.5), 0.7, 40.0);
        for step in 0..4000_u64 {
            let at = SimTime(step * 9_876_543);
            let (motion, s) = (tractor.motion(at), at.as_secs_f64());
            assert!((drive.y_m(s) - motion.place.y_m).abs() < 1e-5, "{s}");
            let alley = motion.place.alley.map(|alley| alley.number);
            let found = drive.piece(s).and_then(|piece| Some(piece.alley?.0));
            assert_eq!(found, alley, "{s}");
            assert_eq!(drive.going(0.1).has(s), alley.is_some() && motion.speed_m_s > 0.1, "{s}");
            assert_eq!(drive.reversing(0.1).has(s), alley.is_some() && motion.speed_m_s < -0.1, "{s}");
        }
        // Every place is passed when the drive says so.
        for piece in drive.pieces() {
            for part in piece.monotone() {
                let y_m = piece.y_m(part.from + part.length() * 0.37);
                let found = piece.y_m(piece.time_at(part, y_m));
                assert!((found - y_m).abs() < 1e-9, "{piece:?} {part:?}: {found} {y_m}");
            }
        }
    }
}
