//! The GNSS receiver on the tractor: where the antenna is on Earth, how well that is known, and when it is not.
//!
//! A fix is a function of the instant: its noise is drawn from a stream keyed by the millisecond, so it does not depend on who asked
//! before, or how often.

use std::f64::consts::TAU;

use rowscan_protocol::random::Stream;
use rowscan_protocol::time::SimTime;
use serde::{Deserialize, Serialize};

use crate::earth::metres_per_degree;
use crate::parameter::{ParameterError, require, require_within as within};
use crate::trajectory::Motion;
use crate::utc::utc_seconds;

/// What a receiver's random streams are keyed by, before the millisecond. Part of the scene format.
pub const STREAM: u64 = 3;

/// How a position was determined.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FixQuality {
    /// No position.
    None,
    /// By satellites alone.
    Gps,
    /// With corrections.
    Differential,
    /// With carrier phases, ambiguities fixed: centimetres.
    RtkFixed,
    /// With carrier phases, ambiguities not fixed yet: decimetres.
    RtkFloat,
}

impl FixQuality {
    /// The digit in GGA, and the method in NMEA 2000.
    pub fn code(self) -> u8 {
        match self {
            Self::None => 0,
            Self::Gps => 1,
            Self::Differential => 2,
            Self::RtkFixed => 4,
            Self::RtkFloat => 5,
        }
    }
}

/// The `[gnss]` table of a scene file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Gnss {
    /// Latitude of the scene's origin, degrees north.
    pub latitude_deg: f64,
    /// Longitude of the scene's origin, degrees east.
    pub longitude_deg: f64,
    /// Height of the ground above mean sea level, metres.
    pub altitude_m: f64,
    /// Height of mean sea level above the ellipsoid, metres.
    pub geoid_m: f64,
    /// Which way the rows run: azimuth of +Y, degrees clockwise from north.
    pub azimuth_deg: f64,
    /// Lever arm: the antenna ahead of the scanners, metres.
    pub antenna_forward_m: f64,
    /// Lever arm: the antenna right of the tractor's middle, metres.
    pub antenna_right_m: f64,
    /// Lever arm: the antenna above the ground, metres.
    pub antenna_up_m: f64,
    /// What time it is when the simulation begins, UTC.
    pub utc: String,
    /// Sentences of one kind a second, 1 to 20.
    pub rate_hz: f64,
    /// Quality of the fix outside the events.
    pub quality: FixQuality,
    /// Standard deviation of north and of east each, metres; up has twice as much.
    pub noise_m: f64,
    /// Changes of the fix, in simulated time; where several overlap the last one counts.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub events: Vec<GnssEvent>,
}

/// A change of the fix for a span of simulated time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GnssEvent {
    /// Begins, seconds.
    #[schemars(example = 20.0)]
    pub from_s: f64,
    /// Ends, seconds.
    #[schemars(example = 30.0)]
    pub to_s: f64,
    /// Quality of the fix during the event.
    #[schemars(example = &"gps")]
    pub quality: FixQuality,
    /// Noise during the event, metres; otherwise unchanged.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = 0.5)]
    pub noise_m: Option<f64>,
}

impl Default for Gnss {
    fn default() -> Self {
        Self {
            latitude_deg: 41.6,
            longitude_deg: 0.87,
            altitude_m: 200.0,
            geoid_m: 50.0,
            azimuth_deg: 0.0,
            antenna_forward_m: 0.0,
            antenna_right_m: 0.0,
            antenna_up_m: 2.5,
            utc: "2026-05-01T06:00:00Z".to_owned(),
            rate_hz: 10.0,
            quality: FixQuality::RtkFixed,
            noise_m: 0.0,
            events: Vec::new(),
        }
    }
}

impl Gnss {
    /// Checks all values.
    ///
    /// # Errors
    /// The first key with an invalid value.
    pub fn validate(&self) -> Result<(), ParameterError> {
        // Beyond 80 degrees a flat piece of Earth is not flat.
        within("gnss.latitude_deg", self.latitude_deg, -80.0, 80.0)?;
        within("gnss.longitude_deg", self.longitude_deg, -180.0, 180.0)?;
        within("gnss.altitude_m", self.altitude_m, -500.0, 9000.0)?;
        within("gnss.geoid_m", self.geoid_m, -150.0, 150.0)?;
        within("gnss.azimuth_deg", self.azimuth_deg, -360.0, 360.0)?;
        within("gnss.antenna_forward_m", self.antenna_forward_m, -20.0, 20.0)?;
        within("gnss.antenna_right_m", self.antenna_right_m, -20.0, 20.0)?;
        within("gnss.antenna_up_m", self.antenna_up_m, 0.0, 20.0)?;
        within("gnss.rate_hz", self.rate_hz, 1.0, 20.0)?;
        within("gnss.noise_m", self.noise_m, 0.0, 100.0)?;
        for event in &self.events {
            require(event.from_s < event.to_s, "gnss.events", "from_s before to_s", event.from_s)?;
            within("gnss.events.noise_m", event.noise_m.unwrap_or(0.0), 0.0, 100.0)?;
        }
        let known = utc_seconds(&self.utc).is_some();
        require(known, "gnss.utc", "a time such as 2026-05-01T06:00:00Z", &self.utc)
    }
}

/// A receiver's output at one instant. Position and speed are the antenna's; without a fix they are what they would be with one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fix {
    /// How the position was determined.
    pub quality: FixQuality,
    /// Seconds since 1970, UTC.
    pub unix_s: f64,
    /// Degrees north.
    pub latitude_deg: f64,
    /// Degrees east.
    pub longitude_deg: f64,
    /// Above mean sea level, metres.
    pub altitude_m: f64,
    /// Mean sea level above the ellipsoid, metres.
    pub geoid_m: f64,
    /// Where the tractor points, degrees clockwise from north, [0, 360).
    pub heading_deg: f64,
    /// Course over ground of the antenna: the heading, or its opposite in reverse, and beside it in a turn.
    pub course_deg: f64,
    /// Speed over ground, m/s, never negative.
    pub speed_m_s: f64,
    /// Satellites used.
    pub satellites: u8,
    /// Horizontal dilution of precision.
    pub hdop: f64,
}

impl Fix {
    /// The same without a position.
    pub(crate) fn lost(self) -> Self {
        Self { quality: FixQuality::None, satellites: 0, hdop: 99.9, ..self }
    }
}

/// A receiver built from the table.
#[derive(Clone, Debug)]
pub struct Receiver {
    gnss: Gnss,
    seed: u64,
    start_s: f64,
    /// Metres per degree of latitude and of longitude at the origin.
    m_per_deg: (f64, f64),
}

impl Receiver {
    /// The receiver of a scene with this seed.
    pub fn new(gnss: Gnss, seed: u64) -> Self {
        let start_s = utc_seconds(&gnss.utc).unwrap_or(0.0);
        let m_per_deg = metres_per_degree(gnss.latitude_deg);
        Self { gnss, seed, start_s, m_per_deg }
    }

    /// Its time of day at simulated time zero, seconds since 1970.
    pub fn start_s(&self) -> f64 {
        self.start_s
    }

    /// Sentences of one kind a second.
    pub fn rate_hz(&self) -> f64 {
        self.gnss.rate_hz
    }

    /// Its output at `at` for a tractor in `motion`.
    pub fn fix(&self, at: SimTime, motion: &Motion) -> Fix {
        self.fix_as(at, motion, None)
    }

    /// The same, with this quality and noise instead of its own, if any.
    pub(crate) fn fix_as(&self, at: SimTime, motion: &Motion, instead: Option<(FixQuality, f64)>) -> Fix {
        let gnss = &self.gnss;
        let t_s = at.as_secs_f64();
        let event = gnss.events.iter().rev().find(|event| (event.from_s..event.to_s).contains(&t_s));
        let (quality, noise_m) = match event {
            Some(event) => (event.quality, event.noise_m.unwrap_or(gnss.noise_m)),
            None => (gnss.quality, gnss.noise_m),
        };
        let (quality, noise_m) = instead.unwrap_or((quality, noise_m));
        let place = motion.place;
        let (sin, cos) = (libm::sin(place.heading_rad), libm::cos(place.heading_rad));
        let x_m = place.x_m + gnss.antenna_forward_m * sin + gnss.antenna_right_m * cos;
        let y_m = place.y_m + gnss.antenna_forward_m * cos - gnss.antenna_right_m * sin;
        let azimuth = gnss.azimuth_deg.to_radians();
        let (sin, cos) = (libm::sin(azimuth), libm::cos(azimuth));
        let [north, east, up] = self.noise(at);
        let north_m = y_m * cos - x_m * sin + noise_m * north;
        let east_m = y_m * sin + x_m * cos + noise_m * east;
        let turned = |deg: f64| {
            let deg = deg.rem_euclid(360.0);
            if deg < 360.0 { deg } else { 0.0 }
        };
        let heading_deg = turned(gnss.azimuth_deg + place.heading_rad.to_degrees());
        // In a turn the antenna moves about the tractor's reference point as well.
        let turns_rad_s = motion.speed_m_s * place.curvature_1_m;
        let ahead_m_s = motion.speed_m_s - turns_rad_s * gnss.antenna_right_m;
        let right_m_s = turns_rad_s * gnss.antenna_forward_m;
        let off_heading = libm::atan2(right_m_s, ahead_m_s).to_degrees();
        let fix = Fix {
            quality,
            unix_s: self.start_s + t_s,
            latitude_deg: gnss.latitude_deg + north_m / self.m_per_deg.0,
            longitude_deg: longitude(gnss.longitude_deg + east_m / self.m_per_deg.1),
            altitude_m: gnss.altitude_m + gnss.antenna_up_m + motion.up_m + 2.0 * noise_m * up,
            geoid_m: gnss.geoid_m,
            heading_deg,
            course_deg: turned(heading_deg + off_heading),
            speed_m_s: libm::hypot(ahead_m_s, right_m_s),
            satellites: 14,
            hdop: 0.7,
        };
        if quality == FixQuality::None { fix.lost() } else { fix }
    }

    /// Moves a fix, metres north and east.
    pub(crate) fn shift(&self, fix: &mut Fix, north_m: f64, east_m: f64) {
        fix.latitude_deg += north_m / self.m_per_deg.0;
        fix.longitude_deg = longitude(fix.longitude_deg + east_m / self.m_per_deg.1);
    }

    /// Three standard normal numbers of this millisecond (Box and Muller).
    fn noise(&self, at: SimTime) -> [f64; 3] {
        let ms = at.0 / 1_000_000;
        let mut stream = Stream::keyed(self.seed, &[STREAM, ms >> 32, ms & u64::from(u32::MAX)]);
        std::array::from_fn(|_| {
            let radius = libm::sqrt(-2.0 * libm::log(1.0 - stream.unit()));
            radius * libm::cos(TAU * stream.unit())
        })
    }
}

/// A longitude that may lie beyond the date line, from -180 up to 180 degrees.
fn longitude(deg: f64) -> f64 {
    match deg {
        east if east >= 180.0 => east - 360.0,
        west if west < -180.0 => west + 360.0,
        _ => deg,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trajectory::{Place, Trajectory};

    const SECOND: u64 = 1_000_000_000;

    #[test]
    fn it_is_where_the_tractor_is() {
        let receiver = Receiver::new(Gnss { azimuth_deg: 90.0, antenna_right_m: 1.0, ..Gnss::default() }, 1);
        let trajectory = Trajectory::straight(0.0, 1.5);
        let (start, later) = (
            receiver.fix(SimTime::ZERO, &trajectory.at(0.0)),
            receiver.fix(SimTime(100 * SECOND), &trajectory.at(100.0)),
        );
        let (north, east) = receiver.m_per_deg;
        // Rows run east: 150 m farther east, no farther north; the middle of alley 0 lies 2 m north of row 0, the antenna a metre south.
        assert!(((later.longitude_deg - start.longitude_deg) * east - 150.0).abs() < 1e-6);
        assert!(((start.latitude_deg - 41.6) * north - 1.0).abs() < 1e-6);
        assert_eq!((later.heading_deg, later.course_deg, later.unix_s - start.unix_s), (90.0, 90.0, 100.0));
        // One degree of latitude at 41.6 degrees, by the tables of WGS 84.
        assert!((north - 111_080.0).abs() < 20.0, "{north}");
        assert!((east - 83_360.0).abs() < 30.0, "{east}");
    }

    /// A tractor at (3, 5), looking 60 degrees right of the rows, at this speed.
    fn askew(speed_m_s: f64) -> Motion {
        let place = Place { x_m: 3.0, y_m: 5.0, heading_rad: 60f64.to_radians(), ..Place::default() };
        Motion { place, speed_m_s, ..Trajectory::straight(0.0, 0.0).at(0.0) }
    }

    #[test]
    fn lever_arm_and_rows_are_turned_by_their_own_angles() {
        let gnss =
            Gnss { azimuth_deg: 30.0, antenna_forward_m: 2.0, antenna_right_m: 1.0, ..Gnss::default() };
        let receiver = Receiver::new(gnss, 1);
        let fix = receiver.fix(SimTime::ZERO, &askew(1.0));
        let (north_m, east_m) = (
            (fix.latitude_deg - 41.6) * receiver.m_per_deg.0,
            (fix.longitude_deg - 0.87) * receiver.m_per_deg.1,
        );
        // By compass: 5 m at 30 degrees along the rows, 3 m at 120 across them, 2 m ahead to the east, 1 m right to the south.
        let root3 = 3f64.sqrt();
        assert!((north_m - (2.5 * root3 - 1.5 - 1.0)).abs() < 1e-6, "{north_m}");
        assert!((east_m - (2.5 + 1.5 * root3 + 2.0)).abs() < 1e-6, "{east_m}");
        assert!((fix.heading_deg - 90.0).abs() < 1e-9);
        assert_eq!((fix.altitude_m, fix.geoid_m), (202.5, 50.0));
    }

    #[test]
    fn longitudes_go_on_beyond_the_date_line() {
        for (start_deg, azimuth_deg) in [(179.9999, 90.0), (180.0, 90.0), (-179.9999, -90.0), (-180.0, -90.0)]
        {
            let receiver =
                Receiver::new(Gnss { longitude_deg: start_deg, azimuth_deg, ..Gnss::default() }, 1);
            let mut fix = receiver.fix(SimTime(100 * SECOND), &Trajectory::straight(0.0, 1.0).at(100.0));
            let side = f64::signum(azimuth_deg);
            let apart_m = |deg: f64| (deg - start_deg).rem_euclid(360.0) * side * receiver.m_per_deg.1;
            let driven_m = apart_m(fix.longitude_deg).rem_euclid(360.0 * receiver.m_per_deg.1);
            assert!(
                (driven_m - 100.0).abs() < 1e-3 && fix.longitude_deg * side < 0.0,
                "{start_deg}: {fix:?}"
            );
            // A jump back over it.
            receiver.shift(&mut fix, 0.0, -200.0 * side);
            assert!(
                (-180.0..180.0).contains(&fix.longitude_deg) && fix.longitude_deg * side > 0.0,
                "{fix:?}"
            );
        }
    }

    /// In turns either way, ahead and in reverse, an antenna anywhere on the tractor goes where it says, and as fast.
    #[test]
    fn course_and_speed_are_the_antennas() {
        use crate::trajectory::{Course, SpeedProfile};
        for (forward_m, right_m) in [(0.0, 0.0), (0.4, 0.0), (3.0, 2.0), (-1.0, -0.5)] {
            let gnss = Gnss {
                azimuth_deg: 30.0,
                antenna_forward_m: forward_m,
                antenna_right_m: right_m,
                ..Gnss::default()
            };
            let receiver = Receiver::new(gnss, 1);
            for speed_m_s in [1.5, -1.5] {
                let course = Course {
                    start_m: if speed_m_s > 0.0 { 0.0 } else { 60.0 },
                    alley: 0,
                    turns: Some((3, 20.0)),
                    ..Course::default()
                };
                let profile = SpeedProfile::constant(speed_m_s);
                let trajectory = Trajectory::new(profile, course, 0.5);
                let at = |ms: u64| receiver.fix(SimTime(ms * 1_000_000), &trajectory.at(ms as f64 / 1000.0));
                for ms in (100..30_000).step_by(130) {
                    let (before, here, after) = (at(ms - 5), at(ms), at(ms + 5));
                    let north_m = (after.latitude_deg - before.latitude_deg) * receiver.m_per_deg.0;
                    let east_m = (after.longitude_deg - before.longitude_deg) * receiver.m_per_deg.1;
                    let moved_m_s = libm::hypot(north_m, east_m) / 0.01;
                    // But where a turn begins or ends, and the antenna jerks.
                    let course_change_deg =
                        (before.course_deg - after.course_deg + 540.0).rem_euclid(360.0) - 180.0;
                    if course_change_deg.abs() > 1.0 {
                        continue;
                    }
                    assert!((moved_m_s - here.speed_m_s).abs() < 1e-3, "{ms} ms: {moved_m_s} m/s, {here:?}");
                    let towards_deg = libm::atan2(east_m, north_m).to_degrees();
                    let off = (towards_deg - here.course_deg + 540.0).rem_euclid(360.0) - 180.0;
                    assert!(off.abs() < 0.1, "{ms} ms: {towards_deg}, {here:?}");
                }
            }
        }
    }

    #[test]
    fn in_reverse_it_goes_against_its_heading_and_angles_stay_below_360() {
        let towards = |azimuth_deg: f64, speed_m_s: f64| {
            let fix = Receiver::new(Gnss { azimuth_deg, ..Gnss::default() }, 1)
                .fix(SimTime::ZERO, &askew(speed_m_s));
            (fix.heading_deg.round(), fix.course_deg.round(), fix.speed_m_s)
        };
        assert_eq!(towards(30.0, -1.5), (90.0, 270.0, 1.5));
        assert_eq!(towards(30.0, 0.0), (90.0, 90.0, 0.0));
        assert_eq!(towards(200.0, -0.5), (260.0, 80.0, 0.5));
        assert_eq!(towards(330.0, 1.0), (30.0, 30.0, 1.0));
        // A hair below zero is rounded up to a whole turn, which is north again.
        let north = Receiver::new(Gnss { azimuth_deg: -1e-17, ..Gnss::default() }, 1);
        let fix = north.fix(SimTime::ZERO, &Trajectory::straight(0.0, 1.0).at(0.0));
        assert_eq!((fix.heading_deg, fix.course_deg), (0.0, 0.0));
    }

    #[test]
    fn noise_upwards_is_twice_as_large_and_of_its_own() {
        let receiver = Receiver::new(Gnss { noise_m: 0.5, ..Gnss::default() }, 7);
        let motion = Trajectory::straight(0.0, 0.0).at(0.0);
        let fixes: Vec<Fix> = (0..4000).map(|k| receiver.fix(SimTime(k * SECOND / 10), &motion)).collect();
        let up_m: Vec<f64> = fixes.iter().map(|fix| fix.altitude_m - 202.5).collect();
        let east_m: Vec<f64> =
            fixes.iter().map(|fix| (fix.longitude_deg - 0.87) * receiver.m_per_deg.1 + 2.0).collect();
        let spread = |values: &[f64]| (values.iter().map(|m| m * m).sum::<f64>() / 4000.0).sqrt();
        assert!((spread(&up_m) - 1.0).abs() < 0.04, "{}", spread(&up_m));
        assert!((spread(&east_m) - 0.5).abs() < 0.02, "{}", spread(&east_m));
        let together = up_m.iter().zip(&east_m).map(|(u, e)| u * e).sum::<f64>() / 4000.0;
        assert!(together.abs() < 0.03, "{together}");
    }

    #[test]
    fn noise_has_its_size_and_repeats() {
        let receiver = Receiver::new(Gnss { noise_m: 0.5, ..Gnss::default() }, 7);
        let motion = Trajectory::straight(0.0, 0.0).at(0.0);
        let fixes: Vec<Fix> = (0..4000).map(|k| receiver.fix(SimTime(k * SECOND / 10), &motion)).collect();
        let north_m: Vec<f64> =
            fixes.iter().map(|fix| (fix.latitude_deg - 41.6) * receiver.m_per_deg.0).collect();
        let mean = north_m.iter().sum::<f64>() / 4000.0;
        let sd = (north_m.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / 4000.0).sqrt();
        assert!(mean.abs() < 0.03 && (sd - 0.5).abs() < 0.02, "{mean} {sd}");
        assert_eq!(receiver.fix(SimTime(300 * SECOND / 10), &motion), fixes[300]);
        assert_ne!(Receiver::new(receiver.gnss.clone(), 8).fix(SimTime(SECOND), &motion), fixes[10]);
    }

    #[test]
    fn events_change_the_fix_and_pass() {
        let event = GnssEvent { from_s: 5.0, to_s: 15.0, quality: FixQuality::None, noise_m: None };
        let receiver = Receiver::new(Gnss { events: vec![event], ..Gnss::default() }, 1);
        let motion = Trajectory::straight(0.0, 1.0).at(0.0);
        let quality = |s| receiver.fix(SimTime(s * SECOND), &motion).quality;
        assert_eq!(
            [quality(4), quality(5), quality(14), quality(15)],
            [FixQuality::RtkFixed, FixQuality::None, FixQuality::None, FixQuality::RtkFixed]
        );
    }

    #[test]
    fn what_no_receiver_has_is_refused() {
        let refused = |text: &str| toml::from_str::<Gnss>(text).unwrap().validate().unwrap_err().to_string();
        assert_eq!(refused("rate_hz = 50"), "gnss.rate_hz must be from 1 to 20, found 50");
        assert!(refused("utc = 'noon'").contains("2026-05-01T06:00:00Z"));
        assert!(
            refused("events = [{ from_s = 5, to_s = 5, quality = 'none' }]").contains("from_s before to_s")
        );
    }
}
