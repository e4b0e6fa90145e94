//! The tractor's motion: profile and course joined.

use super::course::{Course, Place};
use super::detour::Detours;
use super::profile::{ProfileState, SpeedProfile};
use crate::road::{Ground, Stance};

/// Acceleration towards a commanded speed where nothing else is set, m/s².
pub(super) const DEFAULT_ACCELERATION_M_S2: f64 = 0.5;

/// The tractor at one instant. Scene frame; the reference point is the middle of the alley, abreast of the scanners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Where it is, and what stands beside it.
    pub place: Place,
    /// Ground speed along the heading, m/s; negative in reverse.
    pub speed_m_s: f64,
    /// Distance over ground since the start, metres; it decreases in reverse.
    pub way_m: f64,
    /// Distance that the wheels have rolled, slip included, metres.
    pub wheel_m: f64,
    /// Speed of the wheels' rims, m/s.
    pub wheel_speed_m_s: f64,
    /// Metres driven over ground, either direction counted up.
    pub driven_m: f64,
    /// Metres that the wheels have rolled, either direction counted up.
    pub rolled_m: f64,
    /// To the right of its way, metres; `place` has it too.
    pub right_m: f64,
    /// Above where it stands on level ground, metres.
    pub up_m: f64,
    /// Rolled right side down, radians.
    pub roll_rad: f64,
    /// Pitched nose up, radians.
    pub pitch_rad: f64,
}

/// How the tractor drives: place and speed at any time of driving.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    profile: SpeedProfile,
    course: Course,
    acceleration_m_s2: f64,
    detours: Detours,
    /// None is level.
    ground: Option<Ground>,
}

impl Trajectory {
    /// Driven as `profile` says, along `course`; commands are obeyed with this acceleration, m/s².
    pub fn new(profile: SpeedProfile, course: Course, acceleration_m_s2: f64) -> Self {
        Self { profile, course, acceleration_m_s2, detours: Detours::default(), ground: None }
    }

    /// The same drive over this ground.
    #[must_use]
    pub fn over(self, ground: Option<Ground>) -> Self {
        Self { ground, ..self }
    }

    /// Straight ahead at constant speed: y(t) = start + speed · t.
    pub fn straight(start_m: f64, speed_m_s: f64) -> Self {
        let course = Course { start_m, ..Course::default() };
        Self::new(SpeedProfile::constant(speed_m_s), course, DEFAULT_ACCELERATION_M_S2)
    }

    /// The tractor after `t_s` seconds of driving (before 0 it stands at its start).
    pub fn at(&self, t_s: f64) -> Motion {
        let run = self.detours.at(&self.profile, t_s);
        let ProfileState { way_m, speed_m_s, wheel_m, wheel_speed_m_s, driven_m, rolled_m } = run;
        let place = self.course.at(way_m);
        let Stance { up_m, roll_rad, pitch_rad } =
            self.ground.as_ref().map_or_else(Stance::default, |ground| ground.stance(way_m));
        Motion {
            place,
            speed_m_s,
            way_m,
            wheel_m,
            wheel_speed_m_s,
            driven_m,
            rolled_m,
            right_m: 0.0,
            up_m,
            roll_rad,
            pitch_rad,
        }
    }

    /// From `t_s` on the tractor makes for `speed_m_s`, whatever its profile says: how a controller drives it. What was before `t_s`
    /// stays as it was; commands come in the order of time.
    pub fn command(&mut self, t_s: f64, speed_m_s: f64) {
        self.profile.command(t_s, speed_m_s, self.acceleration_m_s2);
    }

    /// From `t_s` on the tractor makes for `speed_m_s` instead of what its profile and its commands say, until that ends by its key.
    pub(crate) fn detour(&mut self, key: u64, t_s: f64, speed_m_s: f64, change_m_s2: f64) {
        self.detours.begin(&self.profile, (key, speed_m_s, change_m_s2), t_s);
    }

    /// From `t_s` on it makes for its own speed again; false if there is no such detour.
    pub(crate) fn rejoin(&mut self, key: u64, t_s: f64) -> bool {
        self.detours.end(&self.profile, key, t_s)
    }

    /// From `t_s` on the tractor stands, from one moment to the next.
    pub fn halt(&mut self, t_s: f64) {
        self.profile.halt(t_s);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fifty_hertz_at_a_metre_a_second_is_twenty_millimetres_a_line() {
        let line = Trajectory::straight(-0.5, 1.0);
        let y_m = |t_s: f64| line.at(t_s).place.y_m;
        assert!((y_m(51.0 / 50.0) - y_m(1.0) - 0.020).abs() < 1e-12);
        assert_eq!(y_m(0.0), -0.5);
    }

    #[test]
    fn a_command_changes_what_comes_and_nothing_before() {
        let mut trajectory = Trajectory::straight(0.0, 1.0);
        let before = trajectory.at(3.0);
        trajectory.command(4.0, 2.0);
        assert_eq!(trajectory.at(3.0), before);
        assert_eq!(trajectory.at(4.0).way_m, 4.0);
        // Half a metre a second squared: a metre a second more takes two seconds and three metres.
        let there = trajectory.at(6.0);
        assert!((there.speed_m_s - 2.0).abs() < 1e-12 && (there.way_m - 7.0).abs() < 1e-12, "{there:?}");
        assert!((trajectory.at(10.0).way_m - 15.0).abs() < 1e-12);
        // A second command takes over in the middle of the first one's ramp.
        trajectory.command(5.0, 0.0);
        assert!((trajectory.at(5.0).speed_m_s - 1.5).abs() < 1e-12);
        assert!((trajectory.at(8.0).speed_m_s).abs() < 1e-12);
        assert_eq!(trajectory.at(8.0).way_m, trajectory.at(3600.0).way_m);
    }
}
