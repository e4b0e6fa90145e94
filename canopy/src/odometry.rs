//! Where the tractor is along the row when a line is taken: by the encoder in the scan, by a measured ground speed, or by the speed the
//! rig states.

use rowscan_protocol::rig::Rig;
use serde::Serialize;

/// No tractor drives faster past a row, m/s, ahead or back: an encoder that counts so counts anew, by fewer bits, or was read wrongly.
const FASTEST_M_S: f64 = 10.0;
/// So much farther it may seem to have come, metres: times of scans scatter.
const FARTHER_M: f64 = 0.05;
/// And so many ticks: a coarse encoder's are far apart.
const FARTHER_TICKS: f64 = 2.0;
/// The way over a restart by the count and by the speed before differ by less than this factor where the encoder went on counting.
const SAME_WAY: f64 = 2.0;
/// Share of scans in which the encoder may have jumped before the way is unknown.
const MOST_JUMPS: f64 = 0.03;

/// What the advance is taken from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum AdvanceSource {
    /// The rig's speed, on the device clock.
    #[default]
    Constant,
    /// The wheel encoder in the scan telegrams.
    Encoder,
    /// Ground speed by GNSS, on the device clock.
    Gnss,
    /// Ground speed on the CAN bus, on the device clock.
    Can,
}

impl AdvanceSource {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Constant => "the rig's constant speed",
            Self::Encoder => "the wheel encoder",
            Self::Gnss => "GNSS",
            Self::Can => "CAN",
        }
    }
}

/// A ground speed as someone measured it, signed: negative in reverse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundSpeed {
    /// Who measured it.
    pub source: AdvanceSource,
    /// m/s; `None` while it is lost: the last one known is held.
    pub speed_m_s: Option<f64>,
}

/// Keeps the tractor's place.
#[derive(Clone, Debug, Default)]
pub(crate) struct Odometry {
    source: Option<AdvanceSource>,
    y_m: f64,
    speed_m_s: f64,
    ticks: u32,
    travel_s: f64,
    held_s: f64,
    choice: EncoderChoice,
    /// The encoder has counted.
    moved: bool,
    /// The device has restarted since the last line.
    restarted: bool,
    /// Lines without a reading of the rig's encoder, where one was to be taken.
    unread: u64,
    /// How often the encoder's count jumped as no tractor drives.
    jumps: u64,
    /// What it counted lately.
    recent: RecentWay,
}

/// The way between the latest lines. From one line to the next an encoder counts so few ticks that a speed by them is off by a tenth.
#[derive(Clone, Copy, Debug, Default)]
struct RecentWay {
    /// Seconds and metres from line to line; a new one takes the place of the oldest.
    steps: [(f64, f64); LINES],
    latest: usize,
}

/// Lines that are kept: those of [`SPEED_S`] at 100 Hz.
const LINES: usize = 20;
/// Over how long a speed is told, seconds.
const SPEED_S: f64 = 0.2;

impl RecentWay {
    fn push(&mut self, passed_s: f64, way_m: f64) {
        self.latest = (self.latest + 1) % LINES;
        if let Some(step) = self.steps.get_mut(self.latest) {
            *step = (passed_s, way_m);
        }
    }

    /// The mean speed over the latest lines; `None` where no time has passed.
    fn speed_m_s(&self) -> Option<f64> {
        let (mut passed_s, mut way_m) = (0.0, 0.0);
        let (newer, older) = self.steps.split_at((self.latest + 1).min(LINES));
        for (step_s, step_m) in newer.iter().rev().chain(older.iter().rev()) {
            if passed_s + step_s > SPEED_S && passed_s > 0.0 {
                break;
            }
            passed_s += step_s;
            way_m += step_m;
        }
        (passed_s > 0.0).then(|| way_m / passed_s)
    }
}

/// What is done with the encoder of the scan telegrams.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum EncoderChoice {
    /// Taken if it is there.
    #[default]
    IfThere,
    /// Taken, and nothing else.
    Only,
    /// Left.
    Never,
}

impl Odometry {
    /// This one from its first line on, with another choice.
    pub(crate) fn with_encoder(self, choice: EncoderChoice) -> Self {
        Self { choice, ..self }
    }

    /// True while the advance hangs on an encoder that has not counted yet, and another source could be taken.
    pub(crate) fn may_be_dead(&self) -> bool {
        self.source == Some(AdvanceSource::Encoder) && self.choice == EncoderChoice::IfThere && !self.moved
    }

    /// The device has restarted: if its encoder counts less than before at the next line, it counts anew.
    pub(crate) fn restart(&mut self) {
        self.restarted = true;
    }

    /// How often the encoder's count jumped as no tractor drives, while the device went on; the speed before was held then.
    pub(crate) fn jumps(&self) -> u64 {
        self.jumps
    }

    /// True where it jumped in too many of so many scans for the way to be known.
    pub(crate) fn is_lost(&self, scans: u64) -> bool {
        self.jumps as f64 > MOST_JUMPS * scans as f64
    }

    /// True if the rig has an encoder, and it is taken where scans have it.
    pub(crate) fn wants_encoder(&self, rig: &Rig) -> bool {
        self.choice == EncoderChoice::IfThere && rig.encoder_ticks_per_m.is_some()
    }

    /// Lines without a reading of the rig's encoder, where one was to be taken.
    pub(crate) fn unread(&self) -> u64 {
        self.unread
    }

    /// Y of a line taken `travel_s` after the first. The source is settled by the first line: a measured speed if there is one, an
    /// encoder that the rig knows, else the rig's speed.
    /// `ticks` is what the encoder had counted then, of 32 bits.
    pub(crate) fn y_m(
        &mut self,
        rig: &Rig,
        ticks: Option<u32>,
        travel_s: f64,
        speed: Option<GroundSpeed>,
    ) -> f64 {
        let encoder = match self.choice {
            EncoderChoice::Never => None,
            EncoderChoice::IfThere | EncoderChoice::Only => rig.encoder_ticks_per_m.zip(ticks),
        };
        let source = *self.source.get_or_insert_with(|| {
            // A stretch that begins later begins farther on.
            self.y_m = rig.y_m(travel_s);
            self.ticks = encoder.map_or(0, |(_, ticks)| ticks);
            self.travel_s = travel_s;
            self.speed_m_s = speed.and_then(|speed| speed.speed_m_s).unwrap_or(0.0);
            match (speed, encoder) {
                (Some(speed), _) => speed.source,
                (None, Some(_)) => AdvanceSource::Encoder,
                (None, None) if self.choice == EncoderChoice::Only => AdvanceSource::Encoder,
                (None, None) => AdvanceSource::Constant,
            }
        });
        let passed_s = (travel_s - self.travel_s).max(0.0);
        self.travel_s = travel_s;
        match source {
            AdvanceSource::Constant => {
                if ticks.is_none() && speed.is_none() && self.wants_encoder(rig) {
                    self.unread += 1;
                }
                self.speed_m_s = rig.speed_m_s;
                self.y_m = rig.y_m(travel_s);
            }
            AdvanceSource::Encoder => {
                if let Some((ticks_per_m, ticks)) = encoder {
                    // The counter wraps, upwards and back through zero.
                    let counted = ticks.wrapping_sub(self.ticks) as i32;
                    self.ticks = ticks;
                    let mut way_m = f64::from(counted) / ticks_per_m;
                    if std::mem::take(&mut self.restarted) {
                        // It may count anew: what it had counted is not its own then, and the way meanwhile goes by the speed before and the time. Where nobody
                        // knows the time, the count is all there is.
                        let by_speed_m = (self.speed_m_s * passed_s).max(0.0);
                        let same = by_speed_m / SAME_WAY - FARTHER_M..=by_speed_m * SAME_WAY + FARTHER_M;
                        if way_m < 0.0 || passed_s > 0.0 && !same.contains(&way_m) {
                            way_m = by_speed_m;
                        }
                    } else if way_m.abs()
                        > FASTEST_M_S * passed_s + FARTHER_M + FARTHER_TICKS / ticks_per_m.abs()
                    {
                        self.jumps += 1;
                        way_m = self.speed_m_s * passed_s;
                    }
                    self.moved |= counted != 0;
                    self.y_m += way_m;
                    self.recent.push(passed_s, way_m);
                    self.speed_m_s = self.recent.speed_m_s().unwrap_or(self.speed_m_s);
                } else {
                    self.unread += 1;
                }
            }
            AdvanceSource::Gnss | AdvanceSource::Can => {
                let now_m_s = speed.and_then(|speed| speed.speed_m_s).filter(|speed| speed.is_finite());
                if now_m_s.is_none() {
                    self.held_s += passed_s;
                }
                let now_m_s = now_m_s.unwrap_or(self.speed_m_s);
                self.y_m += (self.speed_m_s + now_m_s) / 2.0 * passed_s;
                self.speed_m_s = now_m_s;
            }
        }
        self.y_m
    }

    /// What the advance is taken from, once it is settled.
    pub(crate) fn source(&self) -> Option<AdvanceSource> {
        self.source
    }

    /// Speed at the latest line, m/s.
    pub(crate) fn speed_m_s(&self) -> f64 {
        self.speed_m_s
    }

    /// For how long a lost speed was held, seconds.
    pub(crate) fn held_s(&self) -> f64 {
        self.held_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ticks of 2 mm at 50 Hz and 1 m/s: one more or less from line to line is a tenth of the speed.
    #[test]
    fn a_speed_by_an_encoder_is_its_tractors_and_follows_it() {
        let rig = Rig { encoder_ticks_per_m: Some(500.0), ..Rig::default() };
        let mut odometry = Odometry::default();
        // A second that stands, two at 1 m/s, and one that stands again.
        let way_m = |t_s: f64| (t_s - 1.0).clamp(0.0, 2.0);
        for line in 0..200 {
            let t_s = f64::from(line) * 0.02;
            odometry.y_m(&rig, Some((way_m(t_s) * 497.3) as u32), t_s, None);
            let (told_m_s, driven_m_s) = (odometry.speed_m_s(), 497.3 / 500.0);
            match t_s {
                0.1..0.99 | 3.22.. => assert_eq!(told_m_s, 0.0, "at {t_s} s"),
                1.22..2.99 => assert!((told_m_s - driven_m_s).abs() < 0.011, "{told_m_s} m/s at {t_s} s"),
                _ => assert!((0.0..1.1).contains(&told_m_s), "{told_m_s} m/s at {t_s} s"),
            }
        }
    }

    #[test]
    fn an_encoder_wraps_stops_and_comes_back_through_zero() {
        let rig = Rig { encoder_ticks_per_m: Some(1000.0), start_m: 5.0, ..Rig::default() };
        let mut odometry = Odometry::default();
        let ticks = [u32::MAX - 9, 10, 10, 30, u32::MAX];
        let found: Vec<f64> = (0..)
            .zip(ticks)
            .map(|(i, ticks)| odometry.y_m(&rig, Some(ticks), f64::from(i) * 0.02, None))
            .collect();
        for (found, expected) in found.iter().zip([5.0, 5.020, 5.020, 5.040, 5.009]) {
            assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        }
        assert_eq!(odometry.source(), Some(AdvanceSource::Encoder));
    }

    #[test]
    fn an_encoder_that_counts_anew_after_a_restart_has_not_driven_back() {
        let rig = Rig { encoder_ticks_per_m: Some(1000.0), ..Rig::default() };
        // Behind a restart the speed is held for as long as it took. Without one the same ticks are a way back, if a tractor can have gone it; else they begin anew too,
        // and the speed is held.
        for (restarts, passed_s, y_m, jumps) in
            [(true, 0.02, 5.02, 0), (true, 1.5, 6.5, 0), (false, 1.0, 1.0, 0), (false, 0.02, 5.02, 1)]
        {
            let mut odometry = Odometry::default();
            odometry.y_m(&rig, Some(1000), 0.0, None);
            odometry.y_m(&rig, Some(5000), 4.0, None);
            if restarts {
                odometry.restart();
            }
            let at = |odometry: &mut Odometry, ticks, t_s| odometry.y_m(&rig, Some(ticks), t_s, None);
            at(&mut odometry, 1000, 4.0 + passed_s);
            let found = at(&mut odometry, 2000, 6.0);
            assert!((found - y_m).abs() < 1e-9, "{found} {y_m}");
            assert_eq!(odometry.jumps(), jumps);
        }
        // One that went on counting tells the way, as far as the time and the speed before bear it out; without a time it is all there is.
        for (ticks, passed_s, y_m) in
            [(4000, 2.9, 4.0), (4000, 0.0, 4.0), (3000, 10.0, 11.0), (9000, 2.0, 3.0)]
        {
            let mut odometry = Odometry::default();
            odometry.y_m(&rig, Some(0), 0.0, None);
            odometry.y_m(&rig, Some(1000), 1.0, None);
            odometry.restart();
            let found_m = odometry.y_m(&rig, Some(ticks), 1.0 + passed_s, None);
            assert!((found_m - y_m).abs() < 1e-9, "{ticks} after {passed_s} s: {found_m}");
        }
    }

    #[test]
    fn a_measured_speed_is_summed_and_held_when_lost() {
        let (rig, mut odometry) = (Rig::default(), Odometry::default());
        let at = |odometry: &mut Odometry, t_s, speed_m_s| {
            let speed = GroundSpeed { source: AdvanceSource::Gnss, speed_m_s };
            odometry.y_m(&rig, Some(0), t_s, Some(speed))
        };
        at(&mut odometry, 0.0, Some(0.5));
        assert_eq!(at(&mut odometry, 1.0, Some(1.5)), 1.0);
        assert_eq!(at(&mut odometry, 3.0, None), 4.0);
        assert_eq!((odometry.held_s(), odometry.source()), (2.0, Some(AdvanceSource::Gnss)));
    }

    #[test]
    fn without_either_it_is_the_rigs_speed() {
        let (rig, mut odometry) = (Rig { speed_m_s: 1.3, ..Rig::default() }, Odometry::default());
        assert_eq!(odometry.y_m(&rig, Some(7), 2.0, None), rig.y_m(2.0));
        assert_eq!(odometry.source(), Some(AdvanceSource::Constant));
    }
}
