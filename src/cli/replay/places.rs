//! Places in a recording: by time, by scan, by metre of the row.

use std::str::FromStr;
use std::sync::OnceLock;

use rowscan_protocol::rig::Rig;
use rowscan_scenes::files;

use super::super::Failure;
use super::super::output::say;
use super::super::recorder;
use super::drive::drive_began_ns;
use super::recorded_way::RecordedWay;
use rowscan_emulator::replay::{Moment, Part, ReplayError, Survey};

/// A place in a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Seek {
    Seconds(f64),
    Scan(u64),
    Metre(f64),
}

impl FromStr for Seek {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("expected a place such as `12.5s`, `scan:100` or `metre:3.2`, found `{text}`");
        let number = |text: &str| text.parse::<f64>().ok().filter(|n| n.is_finite() && *n >= 0.0 && *n < 1e9);
        if let Some(scan) = text.strip_prefix("scan:") {
            return scan.parse().map(Self::Scan).map_err(|_| wrong());
        }
        if let Some(metre) = text.strip_prefix("metre:") {
            return number(metre).map(Self::Metre).ok_or_else(wrong);
        }
        text.strip_suffix('s').and_then(number).map(Self::Seconds).ok_or_else(wrong)
    }
}

/// Finds places in recorded time.
pub(super) struct Places<'a> {
    /// The rig to go by, instead of the recorded one.
    rig: Option<&'a str>,
    /// That rig, or the recorded one, once it was asked for.
    found: OnceLock<Option<Rig>>,
    survey: &'a Survey,
    /// The stream whose scans are counted.
    part: Option<&'a Part>,
    pub(super) begins_ns: u64,
    pub(super) ends_ns: u64,
}

impl<'a> Places<'a> {
    /// Places by what is played.
    pub(super) fn of(rig: Option<&'a str>, survey: &'a Survey, parts: &[&'a Part], verbatim: bool) -> Self {
        // What other instruments said before the first scanner began is passed over, as long as there is a scanner.
        let scanners = || parts.iter().filter(|part| part.is_scanner());
        let begins_ns = scanners().filter_map(|part| part.begins_ns).min();
        let begins_ns = begins_ns.or(parts.iter().filter_map(|part| part.begins_ns).min());
        // Nor is what a tractor saw that waited for its drive.
        let begins_ns = begins_ns.max(drive_began_ns(survey).filter(|_| !verbatim));
        Self {
            rig,
            found: OnceLock::new(),
            survey,
            part: scanners().next().or(parts.first()).copied(),
            begins_ns: begins_ns.unwrap_or_default(),
            ends_ns: parts.iter().map(|part| part.ends_ns).max().unwrap_or_default(),
        }
    }

    pub(super) fn find(&self, place: Seek) -> Result<Moment, Failure> {
        let found = match place {
            Seek::Seconds(seconds) => Some(self.begins_ns.saturating_add((seconds * 1e9) as u64).into()),
            Seek::Scan(number) => match self.part {
                Some(part) => self.survey.scan_at(part, number)?,
                None => None,
            },
            Seek::Metre(metre) => {
                let rig = self.rig()?.ok_or_else(|| {
                    self.refuse("a place in the row needs a rig, and none is recorded: say --rig".to_owned())
                })?;
                match self.part {
                    Some(part) => self.at_metre(part, &rig, metre)?,
                    None => None,
                }
            }
        };
        let found = found.filter(|found| found.at_ns <= self.ends_ns);
        Ok(found.ok_or_else(|| self.refuse(format!("there is no {}", told(place))))?)
    }

    /// The same of a replay that begins at `from` and ends before `until`.
    pub(super) fn find_within(&self, place: Seek, from: Moment, until: Moment) -> Result<Moment, Failure> {
        match self.find(place)? {
            found if found < from => Err(self.refuse(format!("{} lies before --from", told(place))).into()),
            found if found >= until => {
                Err(self.refuse(format!("{} lies at or behind --until", told(place))).into())
            }
            found => Ok(found),
        }
    }

    /// Where the first scan stands; the beginning of what has none.
    pub(super) fn first_scan(&self) -> Result<Moment, Failure> {
        let first = self.part.map(|part| self.survey.scan_at(part, 0)).transpose()?.flatten();
        Ok(first.unwrap_or_default())
    }

    fn refuse(&self, what: String) -> ReplayError {
        ReplayError::Seek {
            what,
            scans: self.part.map_or(0, |part| part.scans),
            seconds: self.ends_ns.saturating_sub(self.begins_ns) as f64 * 1e-9,
        }
    }

    /// Where a metre of the row is: by what the recording tells of the way, else by the rig's speed, and that is said.
    fn at_metre(&self, part: &Part, rig: &Rig, metre: f64) -> Result<Option<Moment>, Failure> {
        let way = RecordedWay::found(self.survey, part, rig)?;
        if matches!(way, RecordedWay::OfRig) {
            say(format_args!(
                "{}: metre {metre} is where the rig's speed of {} m/s has it: the recording holds neither an encoder's readings that the rig knows nor a ground speed",
                part.name, rig.speed_m_s
            ));
        }
        match way.scan_at(self.survey, (part, rig), metre)? {
            Some(scan) => Ok(self.survey.scan_at(part, scan)?),
            None => Ok(None),
        }
    }

    /// The rig that was asked for, else the recorded one.
    pub(super) fn rig(&self) -> Result<Option<Rig>, Failure> {
        if let Some(found) = self.found.get() {
            return Ok(found.clone());
        }
        let found = match self.rig {
            Some(name) => Some(files::load_rig(name, say)?.0),
            None => recorder::kept_rig(&self.survey.about, &self.survey.path.display()),
        };
        Ok(self.found.get_or_init(|| found).clone())
    }
}

fn told(place: Seek) -> String {
    match place {
        Seek::Seconds(seconds) => format!("second {seconds}"),
        Seek::Scan(number) => format!("scan {number} (they are counted from 0)"),
        Seek::Metre(metre) => format!("metre {metre}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_a_time_a_scan_or_a_metre() {
        assert_eq!("12.5s".parse(), Ok(Seek::Seconds(12.5)));
        assert_eq!("scan:100".parse(), Ok(Seek::Scan(100)));
        assert_eq!("metre:3.2".parse(), Ok(Seek::Metre(3.2)));
        for nonsense in ["", "12", "-1s", "nans", "scan:x", "metre:-1", "tree:4"] {
            assert!(nonsense.parse::<Seek>().expect_err(nonsense).contains("scan:100"));
        }
    }
}
