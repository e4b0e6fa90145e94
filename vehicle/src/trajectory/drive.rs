//! The `[drive]` table of a scene file: how the tractor drives.

use rowscan_protocol::rig::Rig;
use serde::{Deserialize, Serialize};

use super::course::Course;
use super::motion::{DEFAULT_ACCELERATION_M_S2, Trajectory};
use super::profile::{SpeedProfile, SpeedProfileBuilder};
use super::track::{Track, TrackError, TrackValue};
use crate::parameter::ParameterError;
use crate::road::Road;
use crate::scene_file::{FileError, SceneFile};

/// How the tractor drives. Without any of `legs`, `stop_and_go` and `track` it keeps the rig's speed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Drive {
    /// Legs one after the other; the first begins at standstill, the last one's speed goes on.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub legs: Vec<Leg>,
    /// After the last leg the first comes again.
    pub repeat: bool,
    /// Alternates between driving and standing, forever.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stop_and_go: Option<StopAndGo>,
    /// A recorded drive, CSV or GPX, beside the scene file; after its end the tractor stands.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = &"drive.csv")]
    pub track: Option<SceneFile>,
    /// Share of the wheels' distance that is slip, for legs that do not state their own.
    pub slip: f64,
    /// Acceleration towards a commanded speed, m/s².
    pub acceleration_m_s2: f64,
    /// The alley of the start: its number is that of the row on its right; 1 with a scanner that looks left, else 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = 1)]
    pub alley: Option<i32>,
    /// Alleys driven one after the other; it turns where the rows end, and nothing stands behind their ends. Absent or 1: one alley without end, whose rows repeat.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = 3)]
    pub alleys: Option<u32>,
    /// How rough the ground is; level where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub road: Option<Road>,
}

impl Default for Drive {
    fn default() -> Self {
        Self {
            legs: Vec::new(),
            repeat: false,
            stop_and_go: None,
            track: None,
            slip: 0.0,
            acceleration_m_s2: DEFAULT_ACCELERATION_M_S2,
            alley: None,
            alleys: None,
            road: None,
        }
    }
}

/// The speed changes linearly to `speed_m_s`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Leg {
    /// Duration, seconds; 0 changes the speed at once.
    #[schemars(example = 10.0, extend("x-unit" = "s"))]
    pub seconds: f64,
    /// Speed at its end, m/s; negative in reverse.
    #[schemars(example = 1.2)]
    pub speed_m_s: f64,
    /// Share of the wheels' distance that is slip; the drive's where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = 0.05)]
    pub slip: Option<f64>,
}

/// Ramp up, drive, ramp down, stand; at the rig's speed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StopAndGo {
    /// Seconds at full speed.
    #[schemars(example = 10.0)]
    pub go_s: f64,
    /// Seconds at standstill.
    #[schemars(example = 5.0)]
    pub stop_s: f64,
    /// Seconds from one to the other.
    #[serde(default)]
    pub ramp_s: f64,
}

/// An invalid `[drive]` table.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DriveError {
    /// A value out of range.
    #[error("drive.{key} must be {expected}, found {found}")]
    Value {
        /// The key, below `drive`.
        key: &'static str,
        /// The values allowed.
        expected: &'static str,
        /// The value found.
        found: f64,
    },
    /// A value in `[drive.road]`.
    #[error(transparent)]
    Road(#[from] ParameterError),
    /// More than one way to drive.
    #[error("drive.{one} and drive.{other} both say how to drive; leave one of them out")]
    Both {
        /// One key.
        one: &'static str,
        /// The other key.
        other: &'static str,
    },
    /// A recorded drive that was not read, or is not text.
    #[error(transparent)]
    File(#[from] FileError),
    /// A recorded drive that cannot be driven.
    #[error("{path}: {cause}")]
    Track {
        /// The file.
        path: String,
        /// What is wrong.
        cause: TrackError,
    },
}

impl Drive {
    /// Checks all values.
    ///
    /// # Errors
    /// The first key with an invalid value.
    pub fn validate(&self) -> Result<(), DriveError> {
        let check = |key, value: f64, expected, sound: bool| match sound && value.is_finite() {
            true => Ok(()),
            false => Err(DriveError::Value { key, expected, found: value }),
        };
        let seconds = |key, value: f64| check(key, value, "0 or more seconds", value >= 0.0);
        let slip = |key, value: f64| check(key, value, "from -0.5 to 0.95", (-0.5..=0.95).contains(&value));
        let ways = [
            ("legs", !self.legs.is_empty()),
            ("stop_and_go", self.stop_and_go.is_some()),
            ("track", self.track.is_some()),
        ];
        let mut given = ways.into_iter().filter(|(_, given)| *given).map(|(key, _)| key);
        if let (Some(one), Some(other)) = (given.next(), given.next()) {
            return Err(DriveError::Both { one, other });
        }
        if let Some(file) = self.track.as_ref().filter(|file| file.is_filled()) {
            recorded(file)?;
        }
        if let Some(road) = &self.road {
            road.validate()?;
        }
        for leg in &self.legs {
            seconds("legs.seconds", leg.seconds)?;
            check("legs.speed_m_s", leg.speed_m_s, "from -20 to 20 m/s", leg.speed_m_s.abs() <= 20.0)?;
            slip("legs.slip", leg.slip.unwrap_or(0.0))?;
        }
        if let Some(StopAndGo { go_s, stop_s, ramp_s }) = self.stop_and_go {
            seconds("stop_and_go.go_s", go_s)?;
            seconds("stop_and_go.stop_s", stop_s)?;
            seconds("stop_and_go.ramp_s", ramp_s)?;
            let sum = go_s + stop_s + 2.0 * ramp_s;
            check("stop_and_go", sum, "longer than 0 seconds in all", sum > 0.0)?;
        }
        slip("slip", self.slip)?;
        let acceleration = self.acceleration_m_s2;
        check("acceleration_m_s2", acceleration, "from 0.01 to 20", (0.01..=20.0).contains(&acceleration))?;
        let alley = f64::from(self.alley.unwrap_or(0));
        check("alley", alley, "from -100 to 100", alley.abs() <= 100.0)?;
        let alleys = f64::from(self.alleys.unwrap_or(1));
        check("alleys", alleys, "1 to 1000", (1.0..=1000.0).contains(&alleys))
    }

    /// True if it goes from alley to alley: rows have ends, and headlands lie behind them.
    pub fn has_headlands(&self) -> bool {
        self.alleys.is_some_and(|alleys| alleys > 1)
    }

    /// The number of the alley of the start, of a tractor with this rig.
    pub fn first_alley(&self, rig: &Rig) -> i32 {
        self.alley.unwrap_or(i32::from(rig.looks_left()))
    }

    /// The drive of `rig` past rows of this length, metres.
    pub fn trajectory(&self, rig: &Rig, row_m: f64) -> Trajectory {
        let course = Course {
            start_m: rig.start_m,
            alley: self.first_alley(rig),
            row_spacing_m: rig.row_spacing_m.unwrap_or(Course::default().row_spacing_m),
            looks_left: rig.looks_left(),
            turns: self
                .alleys
                .filter(|_| self.has_headlands() && row_m.is_finite())
                .map(|alleys| (alleys, row_m)),
        };
        Trajectory::new(self.profile(rig.speed_m_s), course, self.acceleration_m_s2)
    }

    fn profile(&self, speed_m_s: f64) -> SpeedProfile {
        let slip = self.slip;
        if let Some(file) = &self.track {
            // A drive of which nothing is known stands.
            return follow(&recorded(file).unwrap_or_default(), slip);
        }
        if let Some(StopAndGo { go_s, stop_s, ramp_s }) = self.stop_and_go {
            let standing = SpeedProfile::builder(0.0, slip);
            let going = standing.leg(ramp_s, speed_m_s, slip).steady(go_s, speed_m_s, slip);
            return going.leg(ramp_s, 0.0, slip).steady(stop_s, 0.0, slip).again();
        }
        if self.legs.is_empty() {
            return SpeedProfile::builder(speed_m_s, slip).hold();
        }
        let legs = self.legs.iter().fold(SpeedProfile::builder(0.0, slip), |made, leg| {
            made.leg(leg.seconds, leg.speed_m_s, leg.slip.unwrap_or(slip))
        });
        if self.repeat { legs.again() } else { legs.hold() }
    }
}

/// Parses the file of `track`.
fn recorded(file: &SceneFile) -> Result<Track, DriveError> {
    Track::parse(file.text()?).map_err(|cause| DriveError::Track { path: file.path().to_owned(), cause })
}

/// A recorded drive as legs; it stands after the last point.
fn follow(track: &Track, slip: f64) -> SpeedProfile {
    let first = match track.points.first().map(|point| point.known) {
        Some(TrackValue::Speed(speed_m_s)) => speed_m_s,
        _ => 0.0,
    };
    let pairs = track.points.iter().zip(track.points.iter().skip(1));
    let legs: SpeedProfileBuilder = pairs.fold(SpeedProfile::builder(first, slip), |legs, (from, to)| {
        let seconds = to.t_s - from.t_s;
        match (from.known, to.known) {
            (TrackValue::Way(here_m), TrackValue::Way(there_m)) => {
                legs.steady(seconds, (there_m - here_m) / seconds, slip)
            }
            (_, TrackValue::Speed(speed_m_s)) => legs.leg(seconds, speed_m_s, slip),
            (_, TrackValue::Way(_)) => legs,
        }
    });
    legs.leg(0.0, 0.0, slip).hold()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drive(text: &str) -> Drive {
        let drive: Drive = toml::from_str(text).unwrap();
        drive.validate().unwrap();
        drive
    }

    #[test]
    fn without_a_word_it_keeps_the_rigs_speed() {
        let rig = Rig { start_m: -1.0, speed_m_s: 1.2, ..Rig::default() };
        let made = Drive::default().trajectory(&rig, 18.0);
        for t_s in [0.0, 0.02, 7.34, 1234.5] {
            assert_eq!(made.at(t_s).place.y_m, rig.y_m(t_s), "the same bits");
        }
    }

    #[test]
    fn stop_and_go_stands_and_goes() {
        let made =
            drive("stop_and_go = { go_s = 4, stop_s = 3, ramp_s = 2 }").trajectory(&Rig::default(), 18.0);
        // Six metres a round of eleven seconds: two ramps at half the speed, four seconds at full.
        assert!((made.at(11.0).way_m - 6.0).abs() < 1e-12);
        assert_eq!(made.at(9.0).way_m, made.at(10.5).way_m);
        assert_eq!(made.at(10.0).speed_m_s, 0.0);
    }

    #[test]
    fn a_track_of_places_is_driven_through_its_points() {
        let content = "t_s,way_m\n0,0\n2,1\n5,1\n6,0.5\n".as_bytes();
        let track = Some(SceneFile::with_content("drive.csv", content));
        let made = Drive { track, ..Drive::default() }.trajectory(&Rig::default(), 18.0);
        for (t_s, way_m) in [(0.0, 0.0), (1.0, 0.5), (2.0, 1.0), (4.0, 1.0), (6.0, 0.5), (60.0, 0.5)] {
            assert!((made.at(t_s).way_m - way_m).abs() < 1e-12, "{t_s}");
        }
    }

    #[test]
    fn what_cannot_be_driven_is_refused() {
        let refused = |text: &str| toml::from_str::<Drive>(text).unwrap().validate().unwrap_err().to_string();
        assert!(refused("slip = 1.0").contains("drive.slip must be from -0.5 to 0.95, found 1"));
        assert!(refused("legs = [{ seconds = -1, speed_m_s = 1 }]").contains("drive.legs.seconds"));
        assert!(refused("legs = [{ seconds = 1, speed_m_s = 1 }]\ntrack = 'a.csv'").contains("leave one"));
        let mut backwards = SceneFile::named("drive.csv");
        let drive = |track: &SceneFile| Drive { track: Some(track.clone()), ..Drive::default() };
        assert_eq!(drive(&backwards).validate(), Ok(()), "not read yet");
        assert_eq!(drive(&backwards).trajectory(&Rig::default(), 18.0).at(9.0).way_m, 0.0, "so it stands");
        backwards.fill("t_s,way_m\n1,0\n0,1\n".as_bytes());
        let why = drive(&backwards).validate().unwrap_err().to_string();
        assert!(why.contains("drive.csv: line 3: time runs backwards"), "{why}");
        assert!(refused("stop_and_go = { go_s = 0, stop_s = 0 }").contains("longer than 0"));
    }
}
