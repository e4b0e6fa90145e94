//! Recorded drives: CSV and GPX text to distance over time. The caller reads the file.

use std::f64::consts::PI;

use crate::utc::utc_seconds;

/// Maximum number of points of a track.
const MAX_POINTS: usize = 1_000_000;
/// Metres per degree of latitude, on a sphere of the WGS 84 ellipsoid's mean radius, 6 371 008.8 m.
const M_PER_DEG: f64 = PI / 180.0 * 6_371_008.8;

/// A recorded drive. Times start at 0 and increase.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Track {
    /// The points, by time.
    pub points: Vec<TrackPoint>,
}

/// One point of a track.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackPoint {
    /// Seconds since the first point.
    pub t_s: f64,
    /// What the file states for this instant.
    pub known: TrackValue,
}

/// What a point states.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TrackValue {
    /// Speed, m/s; it changes linearly to the next point's.
    Speed(f64),
    /// Distance since the first point, metres; the speed is constant up to the next point.
    Way(f64),
}

/// Why a text is not a track.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TrackError {
    /// Neither of the two forms.
    #[error(
        "line 1: expected the CSV header `t_s,speed_m_s` or `t_s,way_m`, or GPX with <trkpt>, found `{found}`"
    )]
    Form {
        /// The first line.
        found: String,
    },
    /// A value that is not a number.
    #[error("line {line}: expected {expected}, found `{found}`")]
    Value {
        /// Line, from 1.
        line: usize,
        /// The value expected.
        expected: &'static str,
        /// The value found.
        found: String,
    },
    /// A point that is not later than the one before.
    #[error(
        "line {line}: time runs backwards: {t_s} s after {before_s} s; sort the points by time and leave each time in once"
    )]
    Backwards {
        /// Line, from 1.
        line: usize,
        /// The point's time.
        t_s: f64,
        /// The time before.
        before_s: f64,
    },
    /// Too few points.
    #[error("a track needs at least 2 points, found {found}")]
    TooFew {
        /// Points found.
        found: usize,
    },
    /// Too many points.
    #[error("a track may have {MAX_POINTS} points at most; thin it out")]
    TooMany,
}

impl Track {
    /// Reads either form, told apart by content.
    ///
    /// # Errors
    /// The first invalid line, with the reason.
    pub fn parse(text: &str) -> Result<Self, TrackError> {
        if text.contains("<trkpt") { gpx(text) } else { csv(text) }
    }
}

/// Collects points and checks their order and number.
#[derive(Default)]
struct Points {
    list: Vec<TrackPoint>,
    first_s: Option<f64>,
}

impl Points {
    fn push(&mut self, line: usize, clock_s: f64, known: TrackValue) -> Result<(), TrackError> {
        let t_s = clock_s - *self.first_s.get_or_insert(clock_s);
        if let Some(before) = self.list.last().filter(|before| t_s <= before.t_s) {
            return Err(TrackError::Backwards { line, t_s, before_s: before.t_s });
        }
        if self.list.len() >= MAX_POINTS {
            return Err(TrackError::TooMany);
        }
        self.list.push(TrackPoint { t_s, known });
        Ok(())
    }

    fn done(self) -> Result<Track, TrackError> {
        if self.list.len() < 2 {
            return Err(TrackError::TooFew { found: self.list.len() });
        }
        Ok(Track { points: self.list })
    }
}

fn csv(text: &str) -> Result<Track, TrackError> {
    let mut lines = (1..).zip(text.lines()).filter(|(_, line)| {
        let line = line.trim();
        !line.is_empty() && !line.starts_with('#')
    });
    let header = lines.next().map_or("", |(_, line)| line.trim());
    let known: fn(f64) -> TrackValue = match header.replace(' ', "").as_str() {
        "t_s,speed_m_s" => TrackValue::Speed,
        "t_s,way_m" => TrackValue::Way,
        _ => return Err(TrackError::Form { found: header.chars().take(60).collect() }),
    };
    let mut points = Points::default();
    for (line, text) in lines {
        let wrong = |expected, found: &str| TrackError::Value { line, expected, found: found.to_owned() };
        let (t_s, value) =
            text.split_once(',').ok_or_else(|| wrong("two values with a comma between", text))?;
        let number = |text: &str| {
            let value: Option<f64> = text.trim().parse().ok();
            value.filter(|value| value.is_finite()).ok_or_else(|| wrong("a number", text.trim()))
        };
        points.push(line, number(t_s)?, known(number(value)?))?;
    }
    points.done()
}

fn gpx(text: &str) -> Result<Track, TrackError> {
    let mut points = Points::default();
    let (mut way_m, mut last): (f64, Option<(f64, f64)>) = (0.0, None);
    for (at, _) in text.match_indices("<trkpt") {
        let line = 1 + text.as_bytes().iter().take(at).filter(|byte| **byte == b'\n').count();
        let point = text.get(at..).unwrap_or_default();
        let point = point.split("</trkpt>").next().unwrap_or_default();
        let wrong = |expected| TrackError::Value { line, expected, found: point.chars().take(60).collect() };
        let degrees = |name: &str, most: f64| {
            let value: Option<f64> = attribute(point, name).and_then(|value| value.parse().ok());
            value.filter(|value| value.abs() <= most)
        };
        let lat = degrees("lat", 90.0).ok_or_else(|| wrong("a latitude in `lat`"))?;
        let lon = degrees("lon", 180.0).ok_or_else(|| wrong("a longitude in `lon`"))?;
        let time = point.split_once("<time>").and_then(|(_, rest)| rest.split_once("</time>"));
        let clock_s = time
            .and_then(|(time, _)| utc_seconds(time.trim()))
            .ok_or_else(|| wrong("a <time> such as 2026-05-01T06:00:00Z"))?;
        if let Some((lat0, lon0)) = last {
            let east = (lon - lon0) * libm::cos((lat + lat0) / 2.0 * (PI / 180.0));
            way_m += libm::hypot(lat - lat0, east) * M_PER_DEG;
        }
        last = Some((lat, lon));
        points.push(line, clock_s, TrackValue::Way(way_m))?;
    }
    points.done()
}

fn attribute<'a>(element: &'a str, name: &str) -> Option<&'a str> {
    let head = element.split('>').next()?;
    let (_, rest) = head.split_once(&format!(" {name}="))?;
    let quote = rest.chars().next().filter(|quote| matches!(quote, '"' | '\''))?;
    rest.get(1..)?.split(quote).next()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_csv_track_states_speed_or_way() {
        let track = Track::parse("# a drive\nt_s, speed_m_s\n10,0\n12,1.5\n\n20,1.5\n").unwrap();
        let times: Vec<f64> = track.points.iter().map(|point| point.t_s).collect();
        assert_eq!(times, [0.0, 2.0, 10.0]);
        assert_eq!(track.points[1].known, TrackValue::Speed(1.5));
        assert_eq!(Track::parse("t_s,way_m\n0,0\n1,2\n").unwrap().points[1].known, TrackValue::Way(2.0));
    }

    #[test]
    fn time_that_runs_backwards_is_refused_with_its_line() {
        let error = Track::parse("t_s,speed_m_s\n0,1\n2,1\n1.5,1\n").unwrap_err();
        assert!(matches!(error, TrackError::Backwards { line: 4, .. }), "{error}");
        assert!(error.to_string().contains("line 4: time runs backwards: 1.5 s after 2 s"), "{error}");
    }

    #[test]
    fn a_gpx_track_is_measured_over_ground() {
        let gpx = "<gpx><trk><trkseg>\n<trkpt lat=\"41.5\" lon=\"0.6\"><time>2026-05-01T06:00:00Z</time></trkpt>\n\
                   <trkpt lat='41.5001' lon='0.6'><ele>1</ele><time>2026-05-01T06:00:10.5Z</time></trkpt></trkseg>";
        let track = Track::parse(gpx).unwrap();
        let TrackValue::Way(way_m) = track.points[1].known else { panic!("GPX states places") };
        assert_eq!(track.points[1].t_s, 10.5);
        assert!((way_m - 11.1195).abs() < 1e-3, "{way_m}");
        let error = Track::parse("<trkpt lat=\"41\" lon=\"0\">\n</trkpt>").unwrap_err();
        assert!(error.to_string().contains("<time>"), "{error}");
    }

    #[test]
    fn other_texts_are_refused() {
        assert!(matches!(Track::parse("hello\n1,2\n"), Err(TrackError::Form { .. })));
        assert!(matches!(Track::parse("t_s,way_m\n0,0\n"), Err(TrackError::TooFew { found: 1 })));
        let error = Track::parse("t_s,way_m\n0,0\n1,fast\n").unwrap_err().to_string();
        assert_eq!(error, "line 3: expected a number, found `fast`");
    }
}
