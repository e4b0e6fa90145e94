//! Which scans an estimate is made of, and whether they are enough of the row.
//!
//! A scan of misses is data: a gap in the row is a true zero. A scan whose device reports an error or a window too dirty to measure through is
//! none, nor is one whose beams point outside its model's field. What is left out is counted by cause, and so is the row driven meanwhile.

use rowscan_protocol::leftover::{LEFTOVERS, Leftover};
use rowscan_protocol::leftover_set::LeftoverSet;
use rowscan_protocol::scan::{Scan, is_level};
use rowscan_protocol::validity::{DeviceStatus, FaultCounts, ScanFault};
use serde::Serialize;

use crate::resolutions::Resolutions;

/// How far beams may point beyond the field that the model states, degrees: devices differ by a few.
const FIELD_TOLERANCE_DEG: f64 = 10.0;
/// So many scans after a device has started may be marked as errors and are used all the same: recorded devices mark up to seven (LMS111;
/// an LMS511 one) whose ranges are those of the scans that follow.
const START_UP_MARKS: u64 = 10;

/// So far behind its first line a tractor that stands may seem to be, metres.
const TREMBLE_M: f64 = 0.05;

/// Why a scan is left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Exclusion {
    /// The device reports an error.
    DeviceError,
    /// The device reports a contamination error: levels 2 and 3.
    Contamination,
    /// Beams outside the field of the rig's model.
    OutsideField,
    /// The scan has no beams, or no ranges.
    NoBeams,
    /// Another layer than the level one: more than [`LEVEL_DEG`](rowscan_protocol::scan::LEVEL_DEG) inclined.
    OtherLayer,
}

impl Exclusion {
    /// All of them, in the order they are told.
    pub(crate) const ALL: [Self; 5] =
        [Self::DeviceError, Self::Contamination, Self::OutsideField, Self::NoBeams, Self::OtherLayer];

    /// One word to branch on.
    pub fn code(self) -> &'static str {
        match self {
            Self::DeviceError => "device_error",
            Self::Contamination => "contamination",
            Self::OutsideField => "outside_field",
            Self::NoBeams => "no_beams",
            Self::OtherLayer => "other_layer",
        }
    }

    /// Why, and what to do.
    pub(crate) fn reason(self) -> &'static str {
        match self {
            Self::DeviceError => {
                "the device reports an error, as it does of its first scans after a start (`LMCstartmeas` starts it anew)"
            }
            Self::Contamination => "the window is too dirty to measure through: clean it",
            Self::OutsideField => {
                "the beams point outside the field of the rig's model: name the model that scanned with --model"
            }
            Self::NoBeams => "the scan holds no ranges",
            Self::OtherLayer => "of an inclined layer",
        }
    }

    /// Whether the row is unseen without such scans: layers come beside the one that is used.
    fn blinds(self) -> bool {
        self != Self::OtherLayer
    }
}

/// Device angles a model can measure at, degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Field {
    /// The least.
    pub start_deg: f64,
    /// The largest.
    pub stop_deg: f64,
}

/// Counts what is left out, and the row driven meanwhile.
#[derive(Clone, Debug)]
pub(crate) struct Gate {
    field: Option<Field>,
    /// Scans used.
    pub(crate) valid: u64,
    /// Scans used that were marked as a device does that has just started.
    marked: u64,
    /// The marks since it started; none once an unmarked scan has come.
    starting: Option<u64>,
    /// Scans used whose device warned of a dirty window.
    pub(crate) contaminated: u64,
    /// Scans used that a setting took something from, by its place in [`LEFTOVERS`].
    leftovers: [u64; LeftoverSet::MOST],
    pub(crate) resolutions: Resolutions,
    excluded: [u64; Exclusion::ALL.len()],
    faults: FaultCounts,
    blind: Blind,
}

/// Row without a valid scan.
#[derive(Clone, Copy, Debug, Default)]
struct Blind {
    /// The first line of all, and the last.
    first: Option<Place>,
    last: Option<Place>,
    /// Y of the farthest line ahead, and of the farthest behind, metres.
    greatest_y_m: f64,
    least_y_m: f64,
    /// Y of the farthest line ahead that was used.
    seen_y_m: Option<f64>,
    /// The last line before scans were left out, while they are.
    since: Option<Place>,
    metres: f64,
    seconds: f64,
}

#[derive(Clone, Copy, Debug)]
struct Place {
    y_m: f64,
    travel_s: f64,
}

impl Default for Gate {
    fn default() -> Self {
        Self {
            field: None,
            valid: 0,
            marked: 0,
            starting: Some(0),
            contaminated: 0,
            leftovers: [0; LeftoverSet::MOST],
            resolutions: Resolutions::default(),
            excluded: [0; Exclusion::ALL.len()],
            faults: FaultCounts::default(),
            blind: Blind::default(),
        }
    }
}

impl Gate {
    pub(crate) fn within(&mut self, field: Field) {
        self.field = Some(field);
    }

    /// Settings that took something from scans used, each with how many.
    pub(crate) fn leftovers(&self) -> impl Iterator<Item = (&'static Leftover, u64)> {
        LEFTOVERS.iter().zip(self.leftovers).filter(|(_, scans)| *scans > 0)
    }

    /// The device has restarted, as far as the scans tell.
    pub(crate) fn restart(&mut self) {
        self.starting = Some(0);
    }

    /// Why the scan is to be left out, if it is.
    pub(crate) fn judge(&self, scan: &Scan) -> Option<Exclusion> {
        let beams = &scan.beams;
        // Of a scan without a single number nothing is known.
        let is_empty = |range_m: &[f64]| range_m.iter().all(|range_m| range_m.is_nan());
        if beams.is_empty() || scan.echoes.first().is_none_or(|echo| is_empty(&echo.range_m)) {
            return Some(Exclusion::NoBeams);
        }
        match scan.status {
            DeviceStatus::Error if self.starting.is_some_and(|marks| marks < START_UP_MARKS) => {}
            DeviceStatus::Error => return Some(Exclusion::DeviceError),
            DeviceStatus::ContaminationError => return Some(Exclusion::Contamination),
            DeviceStatus::Ok | DeviceStatus::ContaminationWarning => {}
        }
        // A layer that is not used may look anywhere.
        if !is_level(scan.layer_centideg) {
            return Some(Exclusion::OtherLayer);
        }
        let outside = self.field.is_some_and(|field| {
            beams.angle_deg(0) < field.start_deg - FIELD_TOLERANCE_DEG
                || beams.angle_deg(beams.len() - 1) > field.stop_deg + FIELD_TOLERANCE_DEG
        });
        if outside {
            return Some(Exclusion::OutsideField);
        }
        None
    }

    /// Counts a scan that is used.
    pub(crate) fn take(&mut self, scan: &Scan) {
        if scan.status == DeviceStatus::Error {
            self.marked += 1;
            self.starting = self.starting.map(|marks| marks + 1);
            return;
        }
        self.starting = None;
        self.resolutions.add(scan);
        self.valid += 1;
        self.contaminated += u64::from(scan.status == DeviceStatus::ContaminationWarning);
        for (place, _) in scan.leftovers.iter() {
            self.leftovers[place] += 1;
        }
    }

    /// Counts a scan that is left out.
    pub(crate) fn leave_out(&mut self, why: Exclusion) {
        let places = Exclusion::ALL.iter().zip(&mut self.excluded);
        places.filter(|(each, _)| **each == why).for_each(|(_, count)| *count += 1);
    }

    /// Counts a telegram that gave no scan. Its place is between the lines before and after it.
    pub(crate) fn unreadable(&mut self, fault: &ScanFault) {
        self.faults.count(fault);
        self.blind.since = self.blind.since.or(self.blind.last);
    }

    /// A line at this place was used, or left out. `longest_m` is the way that neighbours of a missing line fill.
    pub(crate) fn line(&mut self, why: Option<Exclusion>, y_m: f64, travel_s: f64, longest_m: f64) {
        // A layer that is not used neither shows the row nor hides it.
        if why.is_some_and(|why| !why.blinds()) {
            return;
        }
        let (here, blind) = (Place { y_m, travel_s }, &mut self.blind);
        if blind.first.is_none() {
            (blind.first, blind.greatest_y_m, blind.least_y_m) = (Some(here), y_m, y_m);
        }
        // What lies behind the first line is passed in reverse, and lines add nothing there.
        blind.least_y_m = blind.least_y_m.min(y_m);
        blind.greatest_y_m = blind.greatest_y_m.max(y_m);
        match why {
            Some(_) => {
                let before = blind.last.unwrap_or(here);
                blind.since.get_or_insert(before);
            }
            None => {
                // Telegrams may be lost without a word between two lines.
                let is_told = blind.since.is_some();
                if let Some(since) = blind.since.take().or(blind.last) {
                    let way_m = y_m - blind.seen_y_m.map_or(since.y_m, |seen_y_m| since.y_m.max(seen_y_m));
                    // Before a step is known nobody can tell whether a line is missing.
                    let is_missing = if longest_m > 0.0 { way_m > longest_m } else { is_told };
                    if is_missing {
                        blind.metres += way_m.max(0.0);
                        blind.seconds += travel_s - since.travel_s;
                    }
                }
                blind.seen_y_m = blind.seen_y_m.into_iter().chain([y_m]).reduce(f64::max);
            }
        }
        blind.last = Some(here);
    }

    /// Scans left out, but for other layers.
    pub(crate) fn excluded(&self) -> u64 {
        self.causes().filter(|(why, _)| why.blinds()).map(|(_, count)| count).sum()
    }

    /// What was left out, by cause. Where no scan was without a mark, the marks were no start-up.
    pub(crate) fn causes(&self) -> impl Iterator<Item = (Exclusion, u64)> {
        let marked = if self.valid == 0 { self.marked } else { 0 };
        let all = Exclusion::ALL.into_iter().zip(self.excluded);
        let all = all.map(move |(why, count)| match why {
            Exclusion::DeviceError => (why, count + marked),
            _ => (why, count),
        });
        all.filter(|(_, count)| *count > 0)
    }

    /// Telegrams that gave no scan, by cause.
    pub(crate) fn faults(&self) -> &FaultCounts {
        &self.faults
    }

    /// How far the row was passed in reverse behind the first line, metres; an encoder that stands may tremble by a few millimetres.
    pub(crate) fn behind_m(&self) -> f64 {
        let behind_m = self.blind.first.map_or(0.0, |first| first.y_m - self.blind.least_y_m);
        if behind_m > TREMBLE_M { behind_m } else { 0.0 }
    }

    /// Share of the row that has no valid scan, because scans were left out, telegrams were lost or it was passed in reverse: of its length, or of
    /// its time where the tractor stood.
    pub(crate) fn blind_share(&self) -> f64 {
        let blind = &self.blind;
        let (Some(first), Some(last)) = (blind.first, blind.last) else { return 0.0 };
        let open = blind.since.unwrap_or(last);
        let share =
            |blind: f64, open: f64, all: f64| (all > 0.0).then(|| ((blind + open) / all).clamp(0.0, 1.0));
        let blind_m = blind.metres + (first.y_m - blind.least_y_m);
        share(blind_m, (last.y_m - open.y_m).max(0.0), blind.greatest_y_m - blind.least_y_m)
            .or_else(|| share(blind.seconds, last.travel_s - open.travel_s, last.travel_s - first.travel_s))
            .unwrap_or(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_protocol::angle::BeamGrid;
    use rowscan_protocol::scan::Echo;

    fn scan(status: DeviceStatus) -> Scan {
        Scan {
            status,
            beams: BeamGrid::spanning(-450_000, 2_250_000, 5000),
            echoes: vec![Echo { range_m: vec![f64::INFINITY; 541], remission: Vec::new() }],
            ..Scan::default()
        }
    }

    /// The share of a row of 0.1 m steps, of these scans, of which gaps up to half a metre are filled.
    fn share(scans: &[Option<Exclusion>]) -> f64 {
        let mut gate = Gate::default();
        for (turn, why) in (0..).zip(scans) {
            match why {
                Some(why) => gate.leave_out(*why),
                None => gate.take(&scan(DeviceStatus::Ok)),
            }
            gate.line(*why, 0.1 * f64::from(turn), 0.1 * f64::from(turn), 0.5);
        }
        gate.blind_share()
    }

    /// Without a frequency the first step is known with the second line only: nothing is missing between the two.
    #[test]
    fn before_a_step_is_known_nothing_is_missing() {
        let drive = |told: Option<Exclusion>| {
            let mut gate = Gate::default();
            gate.line(None, 0.0, 0.0, 0.0);
            if let Some(why) = told {
                gate.line(Some(why), 0.1, 0.1, 0.0);
            }
            for turn in 2..12 {
                gate.line(
                    None,
                    0.1 * f64::from(turn),
                    0.1 * f64::from(turn),
                    if turn == 2 { 0.0 } else { 0.5 },
                );
            }
            gate.blind_share()
        };
        assert_eq!(drive(None), 0.0);
        assert!(drive(Some(Exclusion::DeviceError)) > 0.1);
    }

    #[test]
    fn misses_and_a_dirty_window_are_data_errors_are_not() {
        let gate = Gate::default();
        assert_eq!(gate.judge(&scan(DeviceStatus::Ok)), None);
        assert_eq!(gate.judge(&scan(DeviceStatus::ContaminationWarning)), None);
        assert_eq!(gate.judge(&scan(DeviceStatus::ContaminationError)), Some(Exclusion::Contamination));
        assert_eq!(started().judge(&scan(DeviceStatus::Error)), Some(Exclusion::DeviceError));
        let layer = Scan { layer_centideg: -250, ..scan(DeviceStatus::Ok) };
        assert_eq!(gate.judge(&layer), Some(Exclusion::OtherLayer));
        assert_eq!(gate.judge(&Scan::default()), Some(Exclusion::NoBeams));
    }

    /// A gate that has seen a scan.
    fn started() -> Gate {
        let mut gate = Gate::default();
        gate.take(&scan(DeviceStatus::Ok));
        gate
    }

    #[test]
    fn the_marks_of_a_start_are_data_if_scans_without_follow() {
        let (marked, mut gate) = (scan(DeviceStatus::Error), Gate::default());
        let offer = |gate: &mut Gate, scan: &Scan| match gate.judge(scan) {
            Some(why) => gate.leave_out(why),
            None => gate.take(scan),
        };
        (0..7).for_each(|_| offer(&mut gate, &marked));
        assert_eq!((gate.valid, gate.excluded()), (0, 7), "nothing valid came: they count for nothing");
        offer(&mut gate, &scan(DeviceStatus::Ok));
        assert_eq!((gate.valid, gate.excluded()), (1, 0));
        offer(&mut gate, &marked);
        assert_eq!((gate.valid, gate.excluded()), (1, 1), "not after a start");
        gate.restart();
        (0..30).for_each(|_| offer(&mut gate, &marked));
        assert_eq!((gate.valid, gate.excluded()), (1, 21));
    }

    #[test]
    fn beams_beyond_the_models_field_are_none_of_its_scans() {
        let mut gate = Gate::default();
        gate.within(Field { start_deg: -5.0, stop_deg: 185.0 });
        assert_eq!(gate.judge(&scan(DeviceStatus::Ok)), Some(Exclusion::OutsideField));
        let mut inside = scan(DeviceStatus::Ok);
        inside.beams = BeamGrid::spanning(-100_000, 1_900_000, 5000);
        assert_eq!(gate.judge(&inside), None);
    }

    #[test]
    fn only_stretches_that_neighbours_do_not_fill_are_unseen() {
        let bad = Some(Exclusion::DeviceError);
        let mut scans = vec![None; 101];
        assert_eq!(share(&scans), 0.0);
        // One in ten: filled.
        scans.iter_mut().skip(5).step_by(10).for_each(|why| *why = bad);
        assert_eq!(share(&scans), 0.0);
        // A metre of ten.
        let mut scans = vec![None; 101];
        scans[41..50].fill(bad);
        assert!((share(&scans) - 0.09 - 0.01).abs() < 1e-9, "{}", share(&scans));
        // The end.
        let mut scans = vec![None; 101];
        scans[51..].fill(bad);
        assert!((share(&scans) - 0.5).abs() < 1e-9, "{}", share(&scans));
        // The begin.
        let mut scans = vec![None; 101];
        scans[..50].fill(bad);
        assert!((share(&scans) - 0.5).abs() < 1e-9, "{}", share(&scans));
        assert_eq!(share(&[Some(Exclusion::OtherLayer); 50]), 0.0);
    }

    #[test]
    fn unreadable_telegrams_blind_the_row_they_stand_for() {
        let mut gate = Gate::default();
        for turn in 0..100 {
            if (20..40).contains(&turn) {
                gate.unreadable(&ScanFault::AngularStep);
            } else {
                gate.take(&scan(DeviceStatus::Ok));
                gate.line(None, 0.1 * f64::from(turn), 0.1 * f64::from(turn), 0.5);
            }
        }
        assert!((gate.blind_share() - 2.1 / 9.9).abs() < 1e-9, "{}", gate.blind_share());
        assert_eq!(gate.faults().total(), 20);
    }

    #[test]
    fn telegrams_that_are_lost_without_a_word_blind_it_as_well() {
        let mut gate = Gate::default();
        for turn in (0..100).filter(|turn| !(20..40).contains(turn)) {
            gate.take(&scan(DeviceStatus::Ok));
            gate.line(None, 0.1 * f64::from(turn), 0.1 * f64::from(turn), 0.5);
        }
        assert!((gate.blind_share() - 2.1 / 9.9).abs() < 1e-9, "{}", gate.blind_share());
    }

    #[test]
    fn what_is_passed_in_reverse_counts_only_where_it_has_been_seen() {
        let share = |places: &mut dyn Iterator<Item = f64>| {
            let mut gate = Gate::default();
            for (turn, y_m) in (0..).zip(places) {
                gate.take(&scan(DeviceStatus::Ok));
                gate.line(None, y_m, 0.1 * f64::from(turn), 0.5);
            }
            (gate.blind_share(), gate.behind_m())
        };
        let ahead = |from: i32, to: i32| (from..=to).map(|step| 0.1 * f64::from(step));
        // There and back, and on: all of it was seen.
        assert_eq!(share(&mut ahead(0, 50).chain(ahead(10, 49).rev()).chain(ahead(11, 90))), (0.0, 0.0));
        // Back all the way: nothing was.
        assert_eq!(share(&mut ahead(0, 100).rev()), (1.0, 10.0));
        // Two metres back, and ten ahead of the start.
        let (blind, behind_m) = share(&mut ahead(-20, 0).rev().chain(ahead(-19, 80)));
        assert!((blind - 0.2).abs() < 1e-9 && (behind_m - 2.0).abs() < 1e-9, "{blind}, {behind_m}");
        // It stands, and its encoder trembles.
        assert_eq!(share(&mut [0.0, -0.01, 0.0, 0.5].into_iter()).1, 0.0);
    }

    #[test]
    fn at_standstill_time_stands_for_the_row() {
        let mut gate = Gate::default();
        for turn in 0..=10 {
            let why = (turn > 5).then_some(Exclusion::Contamination);
            match why {
                Some(why) => gate.leave_out(why),
                None => gate.take(&scan(DeviceStatus::Ok)),
            }
            gate.line(why, 3.0, f64::from(turn), 0.1);
        }
        assert_eq!((gate.blind_share(), gate.excluded()), (0.5, 5));
    }
}
