//! A reference controller: an example, a baseline, and the neighbour of the oracle. It knows scans, speed and course, and nothing of the orchard.
//!
//! Each scan is kept with the way that was driven when it was made. A section is told to open where a nozzle of it will be at canopy by the time that flow begins, and to
//! close likewise: everything is a distance, so stop-and-go needs no care. All is shut at standstill, in reverse, on the headland, and when scans or speed stay away.

use std::collections::VecDeque;
use std::f64::consts::PI;

use rowscan_protocol::rig::{Axes, Mount, Orientation, Rig};
use rowscan_protocol::scan::Scan;
use rowscan_protocol::time::DeviceClock;

use crate::boom::{Boom, Nozzle, Side};
use crate::valve::{Kind, Phase};

/// Beams of a scan that must see canopy before a nozzle, where nothing else is asked for: one may be an insect.
pub const LEAST_BEAMS: u16 = 2;
/// Nearer returns are the machine itself, metres across.
const NEAR_M: f64 = 0.3;
/// So far behind its axis a row ends, metres.
const BEHIND_AXIS_M: f64 = 1.0;
/// Scans are kept for so much more way than the nozzles are behind, metres.
const KEPT_M: f64 = 3.0;
/// Speeds that may come without a scan between them: the ECU says ten a second.
const MOST_SPEEDS: u32 = 3;
/// Without a speed for so long in the scanner's time all is shut, seconds.
const SILENT_S: f64 = 0.3;
/// A longer step is a clock that was set, seconds.
const LONGEST_STEP_S: f64 = 2.0;
/// Farther off the rows' direction it is the headland, radians.
const TURNED_RAD: f64 = 0.35;
/// Slower, a course is noise, m/s.
const COURSE_M_S: f64 = 0.3;

/// Why a controller cannot be.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ControllerError {
    /// No scanner for a side.
    #[error(
        "the boom sprays to the {side}, and no scanner looks there; name a rig with a side scanner on that side, or another boom"
    )]
    Blind {
        /// The side.
        side: &'static str,
    },
    /// A mount that it does not read.
    #[error("expected scanners that look to the side, found one that looks up")]
    LooksUp,
}

/// What one scanner has seen, by the way driven in its own time.
#[derive(Clone, Debug)]
struct Eye {
    mount: Mount,
    /// Of its scan plane, whose roll, pitch and yaw the mount tells.
    axes: Axes,
    /// How far ahead of the mirror it meets the row's near side, at the height of each nozzle, metres; 0 of a plane square to the row.
    near_ahead_m: Vec<f64>,
    side: Side,
    /// Z of the ground at the row's axis, how much it rises a metre towards the row, and how high above it canopy begins.
    foot_m: f64,
    rise: f64,
    clearance_m: f64,
    clock: DeviceClock,
    at_s: Option<f64>,
    way_m: f64,
    /// Time of the last speed in this scanner's time.
    speed_at_s: Option<f64>,
    /// Speeds since the last scan; none before the first.
    speeds: Option<u32>,
    seen: VecDeque<Sight>,
    /// Way from a scan to the next, metres.
    step_m: f64,
}

/// What a scan has seen.
#[derive(Clone, Debug)]
struct Sight {
    /// Where the mirror was.
    at_m: f64,
    /// How far ahead of it, from and to, there was canopy before each nozzle.
    ahead_m: Vec<Option<[f64; 2]>>,
}

/// How far the foremost nozzle is ahead of the place where the scanners of its side meet the row's axis, metres; `None` where no nozzle is. Such a nozzle passes
/// leaves before any scanner has seen them, and opens late.
pub fn nozzles_ahead_m(boom: &Boom, mounts: &[Mount]) -> Option<f64> {
    let first_m = |side: Side| {
        let of_side = mounts.iter().filter(|mount| Side::from(mount.row) == side);
        of_side.map(Mount::meets_axis_m).fold(f64::NEG_INFINITY, f64::max)
    };
    let ahead_m =
        boom.nozzles().iter().map(|nozzle| nozzle.ahead_m - first_m(nozzle.side)).fold(0.0, f64::max);
    (ahead_m > 0.0 && ahead_m.is_finite()).then_some(ahead_m)
}

/// The controller. It tells the duty of each section of its boom, in the boom's order.
#[derive(Clone, Debug)]
pub struct Controller {
    boom: Boom,
    nozzles: Vec<Nozzle>,
    eyes: Vec<Eye>,
    /// What passes between a scan and the valve's command, seconds.
    late_s: f64,
    /// Beams of a scan that must see canopy before a nozzle.
    least_beams: u16,
    speed_m_s: f64,
    /// Direction of the rows, and of the tractor.
    course_rad: Option<(f64, f64)>,
}

impl Controller {
    /// For a boom and the scanners of a rig; `late_s` is the time from the end of a scan until valves hear of it: computing, and the bus.
    ///
    /// # Errors
    /// A side of the boom without a scanner, a scanner that looks up.
    pub fn new(boom: Boom, mounts: &[Mount], late_s: f64) -> Result<Self, ControllerError> {
        if mounts.iter().any(|mount| mount.orientation == Orientation::Up) {
            return Err(ControllerError::LooksUp);
        }
        let nozzles = boom.nozzles();
        let eye = |mount: &Mount| Eye {
            mount: mount.clone(),
            axes: mount.attitude().axes(),
            near_ahead_m: nozzles
                .iter()
                .map(|Nozzle { height, .. }| {
                    let near_m = (mount.distance_m - BEHIND_AXIS_M).max(NEAR_M);
                    mount.ahead_m(near_m, 0.5 * (height.from + height.to) - mount.height_m).unwrap_or(0.0)
                })
                .collect(),
            side: mount.row.into(),
            foot_m: 0.0,
            rise: 0.0,
            clearance_m: f64::NEG_INFINITY,
            clock: DeviceClock::default(),
            at_s: None,
            way_m: 0.0,
            speed_at_s: None,
            speeds: None,
            seen: VecDeque::new(),
            step_m: 0.0,
        };
        let eyes: Vec<Eye> = mounts.iter().map(eye).collect();
        let is_blind = |nozzle: &&Nozzle| !eyes.iter().any(|eye| eye.side == nozzle.side);
        if let Some(nozzle) = nozzles.iter().find(is_blind) {
            let side = if nozzle.side == Side::Left { "left" } else { "right" };
            return Err(ControllerError::Blind { side });
        }
        Ok(Self { boom, nozzles, eyes, late_s, least_beams: LEAST_BEAMS, speed_m_s: 0.0, course_rad: None })
    }

    /// The same, which takes so many beams of a scan before a nozzle for canopy; [`LEAST_BEAMS`] until then.
    #[must_use]
    pub fn with_least_beams(self, least_beams: u16) -> Self {
        Self { least_beams: least_beams.max(1), ..self }
    }

    /// The same on the ground of a rig, whose slope it tells: what lies there is no canopy.
    #[must_use]
    pub fn with_ground(mut self, rig: &Rig) -> Self {
        let rise = rig.ground_slope_deg.unwrap_or(0.0).to_radians().tan();
        for eye in &mut self.eyes {
            eye.rise = eye.mount.side() * rise;
            eye.foot_m = rise * rig.row_axis_m(&eye.mount, None);
            eye.clearance_m = rig.ground_clearance_m;
        }
        self
    }

    /// The boom.
    pub fn boom(&self) -> &Boom {
        &self.boom
    }

    /// Speed ahead over ground; none where it is not available.
    pub fn on_speed(&mut self, speed_m_s: Option<f64>) {
        for eye in &mut self.eyes {
            eye.speeds = eye.speeds.map(|speeds| speeds + 1);
            eye.speed_at_s = if speed_m_s.is_some() { eye.at_s.or(Some(0.0)) } else { None };
        }
        self.speed_m_s = speed_m_s.unwrap_or(0.0);
    }

    /// Course over ground. The first one of a drive is that of the rows.
    pub fn on_course(&mut self, course_rad: f64) {
        if self.speed_m_s > COURSE_M_S {
            let rows_rad = self.course_rad.map_or(course_rad, |(rows_rad, _)| rows_rad);
            self.course_rad = Some((rows_rad, course_rad));
        }
    }

    /// A scan of scanner number `scanner` of the rig.
    pub fn on_scan(&mut self, scanner: usize, scan: &Scan) {
        let (is_turning, speed_m_s) = (self.is_turning(), self.speed_m_s);
        let Some(eye) = self.eyes.get_mut(scanner) else { return };
        eye.advance(scan, speed_m_s);
        let ahead_m = eye.canopy(scan, &self.nozzles, self.least_beams);
        eye.seen.push_back(Sight { at_m: eye.way_m + eye.mount.offset_y_m, ahead_m });
        let farthest_m = self.nozzles.iter().map(|nozzle| -nozzle.ahead_m).fold(0.0, f64::max);
        let kept_from_m = eye.way_m - farthest_m - KEPT_M;
        while eye.seen.front().is_some_and(|sight| is_turning || sight.at_m < kept_from_m) {
            eye.seen.pop_front();
        }
    }

    /// The scanner is lost: nothing of it holds until it is back.
    pub fn on_scanner_lost(&mut self, scanner: usize) {
        if let Some(eye) = self.eyes.get_mut(scanner) {
            eye.speeds = None;
        }
    }

    /// What each section is to do now: 0 or 1.
    pub fn duties(&self) -> Vec<f64> {
        let mut duties = vec![0.0; self.boom.sections.len()];
        if self.speed_m_s < self.boom.standstill_m_s || self.is_turning() {
            return duties;
        }
        for nozzle in &self.nozzles {
            let eyes = self.eyes.iter().filter(|eye| eye.side == nozzle.side && eye.is_awake());
            let (on_m, off_m) = self.leads_m(nozzle);
            let is_wanted = eyes.into_iter().any(|eye| {
                let at_m = eye.way_m + nozzle.ahead_m;
                eye.has_canopy(nozzle.number, (at_m + off_m, at_m + on_m))
            });
            if is_wanted && let Some(duty) = duties.get_mut(nozzle.section) {
                *duty = 1.0;
            }
        }
        duties
    }

    /// How far the tractor drives until flow begins, and until it has ended.
    fn leads_m(&self, nozzle: &Nozzle) -> (f64, f64) {
        let valve = nozzle.valve;
        let (mut on_s, mut off_s) = (valve.on_ms / 1e3, (valve.off_ms + valve.fall_ms) / 1e3);
        match (valve.kind, valve.phase) {
            // It may wait for a whole period before it opens, and may not before it closes.
            (Kind::Pwm, Phase::Free) => on_s += 1.0 / valve.hz,
            (Kind::Proportional, _) => {
                on_s += 0.05 * valve.tau_s;
                off_s += valve.tau_s;
            }
            _ => {}
        }
        let half_m = self.boom.strip_m / 2.0;
        (self.speed_m_s * (self.late_s + on_s) + half_m, self.speed_m_s * (self.late_s + off_s) - half_m)
    }

    fn is_turning(&self) -> bool {
        self.course_rad.is_some_and(|(rows_rad, course_rad)| {
            // Rows are driven either way.
            let off = (course_rad - rows_rad).rem_euclid(PI);
            off.min(PI - off) > TURNED_RAD
        })
    }
}

impl Eye {
    /// Goes on to the end of a scan, with the speed that holds.
    fn advance(&mut self, scan: &Scan, speed_m_s: f64) {
        let turn_s = if scan.scan_frequency_hz > 0.0 { 1.0 / scan.scan_frequency_hz } else { 0.0 };
        let at_s = self.clock.seconds(scan.scan_time_us) + turn_s;
        let step_s = self.at_s.map_or(0.0, |before_s| at_s - before_s);
        if !(0.0..LONGEST_STEP_S).contains(&step_s) {
            self.seen.clear();
        } else {
            self.step_m = speed_m_s * step_s;
            self.way_m += self.step_m;
        }
        if self.at_s.is_none() {
            self.speed_at_s = self.speed_at_s.map(|_| at_s);
        }
        (self.at_s, self.speeds) = (Some(at_s), Some(0));
    }

    /// Before which nozzles a scan sees canopy, and how far ahead.
    fn canopy(&self, scan: &Scan, nozzles: &[Nozzle], least_beams: u16) -> Vec<Option<[f64; 2]>> {
        let mut found = vec![(0_u32, [f64::INFINITY, f64::NEG_INFINITY]); nozzles.len()];
        let far_m = self.mount.distance_m + BEHIND_AXIS_M;
        for (beam, range_m) in scan.echoes.first().map_or(&[][..], |echo| &echo.range_m).iter().enumerate() {
            let theta_rad = self.mount.theta_deg(scan.beams.angle_deg(beam)).to_radians();
            let [across, ahead, up] = self.axes.beam(libm::cos(theta_rad), libm::sin(theta_rad));
            if !(NEAR_M..far_m).contains(&(range_m * across)) {
                continue;
            }
            let (ahead_m, z_m) = (range_m * ahead, self.mount.height_m + range_m * up);
            let ground_m = self.foot_m + self.rise * (range_m * across - self.mount.distance_m);
            if z_m < ground_m + self.clearance_m {
                continue;
            }
            for (nozzle, (beams, [from_m, to_m])) in nozzles.iter().zip(&mut found) {
                if (nozzle.height.from..nozzle.height.to).contains(&z_m) {
                    *beams += 1;
                    (*from_m, *to_m) = (from_m.min(ahead_m), to_m.max(ahead_m));
                }
            }
        }
        let is_canopy = |beams: u32| beams >= u32::from(least_beams);
        found.into_iter().map(|(beams, ahead_m)| is_canopy(beams).then_some(ahead_m)).collect()
    }

    /// True while scans and speeds come.
    fn is_awake(&self) -> bool {
        let spoke_s = self.speed_at_s.zip(self.at_s).map(|(speed_s, at_s)| at_s - speed_s);
        self.speeds.is_some_and(|speeds| speeds <= MOST_SPEEDS) && spoke_s.is_some_and(|s| s <= SILENT_S)
    }

    /// True if a scan has seen canopy before a nozzle where it will be from when it would have closed until it would have opened; where closing takes longer, at both.
    fn has_canopy(&self, nozzle: usize, (off_m, on_m): (f64, f64)) -> bool {
        // A scan looks at the middle of its turn, and stands for the way of one.
        let half_m = self.step_m / 2.0;
        let near_m = self.near_ahead_m.get(nozzle).copied().unwrap_or_default();
        // What lies ahead of the newest scan is decided by that one: late, and not never.
        let newest_m = self.seen.back().map_or(f64::NEG_INFINITY, |sight| sight.at_m - half_m + near_m);
        let (off_m, on_m) = (off_m.min(newest_m), on_m.min(newest_m));
        let seen = |from_m: f64, to_m: f64| {
            self.seen.iter().any(|sight| {
                let at_m = sight.at_m - half_m;
                let ahead_m = sight.ahead_m.get(nozzle).copied().flatten();
                ahead_m.is_some_and(|[first_m, last_m]| {
                    at_m + last_m >= from_m - half_m && at_m + first_m <= to_m + half_m
                })
            })
        };
        if off_m <= on_m { seen(off_m, on_m) } else { seen(on_m, on_m) && seen(off_m, off_m) }
    }
}
