//! A turn, put together from its segments.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use super::segment::{Segment, SegmentLine};
use crate::angle::{BeamGrid, exact_step_deg};
use crate::scan::{DAZZLED, NO_ECHO, Scan};
use crate::validity::DeviceStatus;

/// Frequencies that picoScans and multiScans have by their profiles, Hz.
const NOMINAL_HZ: [f64; 6] = [15.0, 20.0, 25.0, 30.0, 40.0, 50.0];
/// A measured frequency this near to one of them is taken for it: a recorded one was 0.14 % off.
const OFF_NOMINAL: f64 = 0.02;
const MM_PER_M: f64 = 1000.0;

/// A turn with the segments of it that came.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// The turn's number.
    pub number: u64,
    /// Counts the lines of turns that were sent, lost ones included; wraps. Of the turn's first line.
    pub counter: u16,
    /// It is the first since telegrams were counted anew: the scanner has restarted.
    pub begins_anew: bool,
    /// The segments that came, with their stamps, by number.
    pub segments: BTreeMap<u64, Segment>,
    /// The beams that each line has in the whole turn, in device angles as CoLa counts them. A segment that is missing leaves a hole.
    pub lines: Vec<BeamGrid>,
}

/// What the mirror does, by the stamps of a turn.
#[derive(Clone, Copy, Debug)]
struct Turning {
    /// Microseconds a degree; 0 where that is not known.
    us_a_degree: f64,
    /// Turns a second; 0 where that is not known.
    frequency_hz: f64,
}

impl Frame {
    /// Writes one of its lines into `scan`. Beams whose segment is missing have the range [`DAZZLED`]: what they met is not known, which is not
    /// [`NO_ECHO`].
    pub fn to_scan_into(&self, line: usize, scan: &mut Scan) {
        let Some((first, beams)) = self.segments.values().next().zip(self.lines.get(line).copied()) else {
            return;
        };
        let Some(of_first) = first.lines.get(line) else { return };
        let turning = self.turning();
        let before_deg = place(beams, of_first.start_deg) as f64 * beams.step_deg();
        let before_us = libm::round(before_deg * turning.us_a_degree).max(0.0) as u64;
        scan.serial_number = first.sender_id;
        scan.status = DeviceStatus::Ok;
        scan.layer_centideg = of_first.layer_centideg;
        scan.telegram_counter = self.counter.wrapping_add(line as u16);
        scan.scan_counter = self.number as u16;
        // The clock of a scan is 32 bits wide and wraps.
        scan.scan_time_us = of_first.time_start_us.saturating_sub(before_us) as u32;
        scan.transmit_time_us = self.segments.values().last().unwrap_or(first).transmit_time_us as u32;
        scan.scan_frequency_hz = turning.frequency_hz;
        scan.beams = beams;
        scan.begins_anew = self.begins_anew && line == 0;
        scan.encoders.clear();
        scan.device_name.clear();
        scan.echoes.resize_with(of_first.echoes, Default::default);
        for (number, echo) in scan.echoes.iter_mut().enumerate() {
            echo.range_m.clear();
            echo.range_m.resize(beams.len(), DAZZLED);
            echo.remission.clear();
            if of_first.content.has_rssi() {
                echo.remission.resize(beams.len(), 0);
            }
            for segment in self.segments.values().filter_map(|segment| segment.lines.get(line)) {
                fill(beams, segment, number, &mut echo.range_m, &mut echo.remission);
            }
        }
    }

    fn turning(&self) -> Turning {
        let (us, deg) = self.start_to_start().or_else(|| self.start_to_stop()).unwrap_or_default();
        if us <= 0.0 || deg <= 0.0 {
            return Turning { us_a_degree: 0.0, frequency_hz: 0.0 };
        }
        let measured_hz = 1e6 * deg / us / 360.0;
        let near = |hertz: &f64| libm::fabs(measured_hz / hertz - 1.0) < OFF_NOMINAL;
        let frequency_hz = NOMINAL_HZ.into_iter().find(near).unwrap_or(measured_hz);
        Turning { us_a_degree: 1e6 / (360.0 * frequency_hz), frequency_hz }
    }

    /// Microseconds and degrees from the first beams of segments to those of the next ones: lines of a telegram may be stamped alike though their last
    /// beams point otherwise.
    fn start_to_start(&self) -> Option<(f64, f64)> {
        let firsts = self.segments.values().filter_map(|segment| segment.lines.first());
        let pairs =
            firsts.clone().zip(firsts.skip(1)).filter(|(one, next)| next.time_start_us > one.time_start_us);
        let sums = pairs.fold((0.0, 0.0), |(us, deg), (one, next)| {
            let between_deg = next.start_deg - one.start_deg;
            let between_deg = if between_deg < 0.0 { between_deg + 360.0 } else { between_deg };
            (us + (next.time_start_us - one.time_start_us) as f64, deg + between_deg)
        });
        Some(sums).filter(|(us, _)| *us > 0.0)
    }

    /// The same from the first beams of segments to their last ones.
    fn start_to_stop(&self) -> Option<(f64, f64)> {
        let firsts = self.segments.values().filter_map(|segment| segment.lines.first());
        let timed = firsts.filter(|line| line.time_stop_us > line.time_start_us);
        let sums = timed.fold((0.0, 0.0), |(us, deg), line| {
            (us + (line.time_stop_us - line.time_start_us) as f64, deg + line.span_deg())
        });
        Some(sums).filter(|(us, _)| *us > 0.0)
    }
}

/// The beam of the grid that points this way, also by a turn farther on or back.
fn place(beams: BeamGrid, deg: f64) -> usize {
    let steps = libm::round((deg - beams.angle_deg(0)) / beams.step_deg());
    let turn = libm::round(360.0 / beams.step_deg());
    (steps - turn * libm::floor(steps / turn)) as usize
}

/// Writes the values of one echo of a segment's line to their beams.
fn fill(beams: BeamGrid, segment: &SegmentLine, echo: usize, range_m: &mut [f64], remission: &mut [u16]) {
    let place = place(beams, segment.start_deg);
    let of = |list: &[u16], beam: usize| list.get(beam * segment.echoes + echo).copied();
    for beam in 0..segment.beams {
        let value = of(&segment.values.distance, beam).map(|counts| match counts {
            0 => NO_ECHO,
            counts => f64::from(counts) * segment.scale_mm / MM_PER_M,
        });
        if let Some((range_m, value)) = range_m.get_mut(place + beam).zip(value) {
            *range_m = value;
        }
        if let Some((remission, value)) = remission.get_mut(place + beam).zip(of(&segment.values.rssi, beam))
        {
            *remission = value;
        }
    }
}

/// Where segments lie, as far as they are known.
#[derive(Clone, Debug, Default)]
pub(super) struct Layout {
    lines: Vec<LineLayout>,
    /// They were seen in a turn of which nothing was missing: there are no others.
    is_whole: bool,
}

/// Where the segments of a line lie.
#[derive(Clone, Debug)]
struct LineLayout {
    layer_centideg: i16,
    step: u16,
    /// First and last angle of each segment, degrees.
    spans_deg: BTreeMap<u64, [f64; 2]>,
}

impl LineLayout {
    fn of(number: usize, segments: &BTreeMap<u64, Segment>) -> Option<Self> {
        let first = segments.values().next()?.lines.get(number)?;
        let span = |(segment, lines): (&u64, &Segment)| {
            let line = lines.lines.get(number)?;
            Some((*segment, [line.start_deg, line.start_deg + line.span_deg()]))
        };
        let spans_deg = segments.iter().filter_map(span).collect();
        Some(Self { layer_centideg: first.layer_centideg, step: first.step, spans_deg })
    }

    fn is_of(&self, line: &SegmentLine) -> bool {
        (self.layer_centideg, self.step) == (line.layer_centideg, line.step)
    }

    /// The beams from the first to the last one. Where the angles of a segment lie before those of the one before it, the beams have gone around: that
    /// is so whatever is missing in between.
    fn beams(&self) -> BeamGrid {
        let mut spans_deg = self.spans_deg.values();
        let Some(&[start_deg, first_end_deg]) = spans_deg.next().filter(|_| self.step > 0) else {
            return BeamGrid::default();
        };
        let step_deg = exact_step_deg(self.step);
        let end_deg = spans_deg.fold(first_end_deg, |end_deg, &[from_deg, to_deg]| {
            let turns = libm::ceil((end_deg - from_deg) / 360.0).max(0.0);
            to_deg + turns * 360.0
        });
        let most = libm::round(360.0 / step_deg) - 1.0;
        let steps = libm::round((end_deg - start_deg) / step_deg).min(most);
        BeamGrid {
            start: libm::round(start_deg * 10_000.0) as i32,
            step: self.step,
            count: (steps as u32).min(u32::from(u16::MAX) - 1) as u16 + 1,
        }
    }
}

impl Layout {
    pub(super) fn of(segments: &BTreeMap<u64, Segment>) -> Self {
        let lines = segments.values().next().map_or(0, |segment| segment.lines.len());
        let lines = (0..lines).filter_map(|number| LineLayout::of(number, segments)).collect();
        Self { lines, is_whole: false }
    }

    /// The same where nothing was missing of the turn.
    pub(super) fn whole(self) -> Self {
        Self { is_whole: true, ..self }
    }

    /// With what `other` knows besides; that of `other` alone where their lines or steps differ.
    pub(super) fn and(&self, other: Self) -> Self {
        let key = |line: &LineLayout| (line.layer_centideg, line.step);
        if !self.lines.iter().map(key).eq(other.lines.iter().map(key)) {
            return other;
        }
        let mut lines = self.lines.clone();
        for (line, more) in lines.iter_mut().zip(other.lines) {
            line.spans_deg.extend(more.spans_deg);
        }
        Self { lines, is_whole: self.is_whole }
    }

    /// True if these segments are all there are; false where that is not known yet.
    pub(super) fn is_all(&self, segments: &BTreeMap<u64, Segment>) -> bool {
        let Some(first) = segments.values().next() else { return false };
        let alike = self.lines.len() == first.lines.len()
            && self.lines.iter().zip(&first.lines).all(|(line, found)| line.is_of(found));
        let is_complete = self.lines.first().is_some_and(|line| line.spans_deg.keys().eq(segments.keys()));
        self.is_whole && alike && is_complete
    }

    /// The number of the last segment, if any is known.
    pub(super) fn last(&self) -> Option<u64> {
        self.lines.first()?.spans_deg.keys().next_back().copied()
    }

    /// The beams of each line, from the first to the last one.
    pub(super) fn beams(&self) -> Vec<BeamGrid> {
        self.lines.iter().map(LineLayout::beams).collect()
    }
}
