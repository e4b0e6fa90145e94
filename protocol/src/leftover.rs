//! Settings with which an earlier client can take beams, echoes, layers or turns away from every later one: a range of angles, a mean of several
//! scans. A beam that is taken away looks like a miss, so who starts a scanner reads each of them and sets it to what takes nothing.
//!
//! [`LEFTOVERS`] is the one table: the CoLa client walks it, and so does who sets a scanner up over REST. Which echo is sent, how a scan is
//! made and what its telegram holds is asked for anyway, and LFPlayerFilter is the user's choice, which is told: its layers are lines, and an estimate
//! names the one that it is of.

use alloc::vec;
use alloc::vec::Vec;

use crate::frame::Dialect;
use crate::leftover_set::LeftoverSet;
use crate::model::Model;
use crate::telegram::lmp_output_range::{OutputRange, Sector};
use crate::telegram::ms_suppmode::{self, SuppressionMode};
use crate::telegram::scan_layer_filter::ScanLayerFilter;
use crate::telegram::set_active_applications::{ActiveApplications, Application};
use crate::telegram::wire::{Fields, FixedText, WireError, Writer};
use crate::telegram::{Args, Kind, encode};

/// Clients that compute in radians write a range that is a few 1/10000° off; it takes no beam away.
const TOLERANCE: i32 = 10;
/// The application that makes scans.
const RANGING: FixedText<4> = FixedText(*b"RANG");

/// A setting that can take beams, echoes, layers or turns away.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Leftover {
    /// The manual's name.
    pub name: &'static str,
    /// What it does to scans where it is not neutral, in words.
    pub found: &'static str,
    /// Which scanners may have it.
    of: Family,
    /// The value that takes nothing.
    neutral: Neutral,
}

/// Which scanners may have a setting. One that does not know it answers so, and has no such filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Family {
    /// Without Compact output.
    Cola,
    /// With Compact output.
    Compact,
    /// Those that say in each telegram of values what was taken from it: nothing to ask for, or to put right.
    Lms2xx,
}

/// The value that takes nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Neutral {
    /// It begins with a switch, which is off; what follows is kept.
    Off,
    /// One sector: the model's whole field.
    Field,
    /// All layers.
    Layers,
    /// Glitches are suppressed, and nothing else.
    Glitches,
    /// Scans are made.
    Ranging,
    /// It is asked for anew with each start.
    Asked,
}

const fn row(name: &'static str, of: Family, neutral: Neutral, found: &'static str) -> Leftover {
    Leftover { name, found, of, neutral }
}

/// An LMS2xx's mean of several scans.
pub(crate) const LMS2XX_MEAN: &str = "mean";
/// A part of an LMS2xx's scan.
pub(crate) const LMS2XX_PART: &str = "part";

/// One row a setting.
#[rustfmt::skip]
pub static LEFTOVERS: &[Leftover] = &[
    row("SetActiveApplications", Family::Cola, Neutral::Ranging, "its ranging (RANG of SetActiveApplications) was off, and no scan is made"),
    row("LMPoutputRange", Family::Cola, Neutral::Field, "it sent a part of its field only (LMPoutputRange), and nothing is known of the rest"),
    row("ScanLayerFilter", Family::Cola, Neutral::Layers, "some of its layers were off (ScanLayerFilter)"),
    row("LFPmeanfilter", Family::Cola, Neutral::Off, "its mean filter (LFPmeanfilter) was on, and a scan was the mean of several"),
    row("LFPmedianfilter", Family::Cola, Neutral::Off, "its median filter (LFPmedianfilter) was on, and thin leaves and gaps were taken away"),
    row("LFPparticle", Family::Cola, Neutral::Off, "its particle filter (LFPparticle) was on, and beams on single leaves looked like misses"),
    row("LFPnto1filter", Family::Cola, Neutral::Off, "its n-to-1 filter (LFPnto1filter) was on, and beams were put together"),
    row("MSsuppmode", Family::Cola, Neutral::Glitches, "its fog filter (MSsuppmode) was on, and weak echoes looked like misses"),
    row("LFPangleRangeFilter", Family::Compact, Neutral::Off, "its filter of angles (LFPangleRangeFilter) was on, and beams outside looked like misses"),
    row("LFPradialDistanceRangeFilter", Family::Compact, Neutral::Off, "its filter of ranges (LFPradialDistanceRangeFilter) was on, and echoes outside looked like misses"),
    row("LFPcubicareafilter", Family::Compact, Neutral::Off, "its filter of a box (LFPcubicareafilter) was on, and echoes outside looked like misses"),
    row("LFPintervalFilter", Family::Compact, Neutral::Off, "its filter of turns (LFPintervalFilter) was on, and most turns were not sent"),
    row(LMS2XX_MEAN, Family::Lms2xx, Neutral::Asked, "its scans were means of several, as they were asked for (20 26, 20 28)"),
    row(LMS2XX_PART, Family::Lms2xx, Neutral::Asked, "it sent a part of each scan, as it was asked for (20 27, 20 28, 20 36), and nothing is known of the rest"),
];

impl LeftoverSet {
    /// Those in it, by their places in [`LEFTOVERS`].
    pub fn iter(self) -> impl Iterator<Item = (usize, &'static Leftover)> {
        LEFTOVERS.iter().enumerate().filter(move |(place, _)| self.holds(*place))
    }

    /// The setting of this name takes something away from now on, or does not; names that are none of [`LEFTOVERS`] change nothing.
    pub(crate) fn set(&mut self, name: &str, takes: bool) {
        if let Some(place) = LEFTOVERS.iter().position(|row| row.name == name) {
            self.put(place, takes);
        }
    }
}

impl Leftover {
    /// True if a value of the setting `name` takes something away, as far as that is known without the model; `None` of another setting, and of what is not of
    /// its form.
    pub(crate) fn takes(name: &str, value: Args<'_>) -> Option<bool> {
        let row = LEFTOVERS.iter().find(|row| row.name == name)?;
        row.put_right(None, value).ok().map(|put_right| put_right.is_some())
    }

    /// Those that a scanner of `model` may have; all where it is not known.
    pub fn of(model: Option<&Model>) -> impl Iterator<Item = &'static Self> {
        let compact = model.map(|model| model.compact.is_some());
        LEFTOVERS.iter().filter(move |row| row.may_be_of(compact))
    }

    /// Those of scanners with Compact output: each begins with a switch.
    pub fn of_compact() -> impl Iterator<Item = &'static Self> {
        LEFTOVERS.iter().filter(|row| row.may_be_of(Some(true)))
    }

    fn may_be_of(&self, compact: Option<bool>) -> bool {
        match self.of {
            Family::Cola => compact != Some(true),
            Family::Compact => compact != Some(false),
            Family::Lms2xx => false,
        }
    }

    /// The telegram that puts it right, given what a scanner of `model` answered to `sRN`; none where that takes nothing away, or where nobody knows
    /// what does: a part of an unknown field.
    ///
    /// # Errors
    /// An answer that is not of its form.
    pub(crate) fn put_right(
        &self,
        model: Option<&Model>,
        found: Args<'_>,
    ) -> Result<Option<Vec<u8>>, WireError> {
        let dialect = found.dialect;
        match self.neutral {
            Neutral::Asked => Ok(None),
            Neutral::Off => self.switched_off(found),
            Neutral::Field => {
                let Some(model) = model else { return Ok(None) };
                let range: OutputRange = found.decode()?;
                let is_whole = |sector: &Sector| {
                    sector.start <= model.start_angle + TOLERANCE
                        && sector.stop >= model.stop_angle - TOLERANCE
                };
                let Some(first) = range.sectors.first().filter(|_| !range.sectors.iter().any(is_whole))
                else {
                    return Ok(None);
                };
                let whole = Sector { step: first.step, start: model.start_angle, stop: model.stop_angle };
                Ok(Some(self.written(dialect, &OutputRange { sectors: vec![whole] })))
            }
            Neutral::Layers => {
                let filter: ScanLayerFilter = found.decode()?;
                let all = ScanLayerFilter { layers: vec![true; filter.layers.len()] };
                Ok((filter != all).then(|| self.written(dialect, &all)))
            }
            Neutral::Glitches => {
                let mode: SuppressionMode = found.decode()?;
                let glitches = SuppressionMode { code: ms_suppmode::GLITCH };
                Ok((mode != glitches).then(|| self.written(dialect, &glitches)))
            }
            Neutral::Ranging => {
                let ActiveApplications { applications } = found.decode()?;
                let is_off = applications.iter().any(|found| found.name == RANGING && !found.active);
                let applications = vec![Application { name: RANGING, active: true }];
                Ok(is_off.then(|| self.written(dialect, &ActiveApplications { applications })))
            }
        }
    }

    fn written<V: Fields>(&self, dialect: Dialect, value: &V) -> Vec<u8> {
        let mut payload = Vec::new();
        encode(dialect, Kind::Wn, self.name, value, &mut payload);
        payload
    }

    /// The same value with its switch off, if it is on. What follows the switch goes back as it came, whatever its form.
    fn switched_off(&self, found: Args<'_>) -> Result<Option<Vec<u8>>, WireError> {
        let mut reader = found.reader();
        let mut is_on = false;
        is_on.read(&mut reader)?;
        let mut payload = Vec::new();
        Writer::begin(found.dialect, Kind::Wn, self.name, &mut payload).u8(0);
        payload.extend_from_slice(match found.dialect {
            Dialect::A => reader.rest().trim_ascii_end(),
            Dialect::B => reader.rest(),
        });
        Ok(is_on.then_some(payload))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{self, MODELS};
    use std::string::String;

    fn put_right(name: &str, model: Option<&Model>, found: &str) -> Option<String> {
        let row = LEFTOVERS.iter().find(|row| row.name == name).unwrap();
        let found = Args { dialect: Dialect::A, bytes: found.as_bytes() };
        row.put_right(model, found).unwrap().map(|payload| String::from_utf8(payload).unwrap())
    }

    #[test]
    fn a_switch_goes_off_and_what_follows_is_kept() {
        let off = |name, found| put_right(name, None, found);
        assert_eq!(off("LFPmeanfilter", "1 A 0 ").as_deref(), Some("sWN LFPmeanfilter 0 A 0"));
        assert_eq!(off("LFPparticle", "0 1F4"), None);
        let angles = "1 FFF24460 DBBA0 FFF24460 DBBA0 3";
        let expected = "sWN LFPangleRangeFilter 0 FFF24460 DBBA0 FFF24460 DBBA0 3";
        assert_eq!(off("LFPangleRangeFilter", angles).as_deref(), Some(expected));
        // A form that nobody knows.
        assert_eq!(off("LFPnto1filter", "1").as_deref(), Some("sWN LFPnto1filter 0"));
        let row = LEFTOVERS.iter().find(|row| row.name == "LFPmeanfilter").unwrap();
        let found = |bytes| row.put_right(None, Args { dialect: Dialect::B, bytes }).unwrap();
        assert_eq!(found(&[1, 0, 10, 0]), Some(b"sWN LFPmeanfilter \0\0\x0A\0".to_vec()));
        assert_eq!(found(&[0, 0, 10, 0]), None);
        assert!(row.put_right(None, Args { dialect: Dialect::B, bytes: &[] }).is_err());
    }

    #[test]
    fn a_part_of_the_field_becomes_the_whole_one_of_the_model_and_stays_where_that_is_not_known() {
        let lms111 = model::by_name("lms111");
        let range = |model, found| put_right("LMPoutputRange", model, found);
        let part = "1 1388 493E0 F4240";
        assert_eq!(range(lms111, part).as_deref(), Some("sWN LMPoutputRange 1 1388 FFF92230 225510"));
        assert_eq!(range(None, part), None);
        // As a client that computes in radians left a recorded one.
        assert_eq!(range(lms111, "1 1388 FFF92233 22550D"), None);
        assert_eq!(
            put_right("ScanLayerFilter", None, "4 1 0 1 1").as_deref(),
            Some("sWN ScanLayerFilter 4 1 1 1 1")
        );
        assert_eq!(put_right("MSsuppmode", None, "1").as_deref(), Some("sWN MSsuppmode 0"));
        let applications = put_right("SetActiveApplications", None, "2 FEVL 1 RANG 0");
        assert_eq!(applications.as_deref(), Some("sWN SetActiveApplications 1 RANG 1"));
        assert_eq!(put_right("SetActiveApplications", None, "1 RANG 1"), None);
    }

    #[test]
    fn rows_have_their_names_in_their_words_and_rest_knows_switches_only() {
        for row in LEFTOVERS {
            assert!(row.found.contains(row.name), "{}", row.name);
            assert!(LEFTOVERS.iter().filter(|other| other.name == row.name).count() == 1);
        }
        assert!(Leftover::of_compact().all(|row| row.neutral == Neutral::Off));
        for model in MODELS {
            assert!(Leftover::of(Some(model)).count() < Leftover::of(None).count());
        }
    }
}
