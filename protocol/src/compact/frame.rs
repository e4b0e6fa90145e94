//! A turn, put together from its segments.

use alloc::collections::BTreeMap;

use super::segment::Segment;
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
    /// Counts turns that were sent, lost ones included; wraps.
    pub counter: u16,
    /// The segments that came, with their stamps, by number.
    pub segments: BTreeMap<u64, Segment>,
    /// The beams of the whole turn, in device angles as CoLa counts them. A segment that is missing leaves a hole.
    pub beams: BeamGrid,
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
    /// Writes it into `scan`. Beams whose segment is missing have the range [`DAZZLED`]: what they met is not known, which is not [`NO_ECHO`].
    pub fn to_scan_into(&self, scan: &mut Scan) {
        let Some(first) = self.segments.values().next() else { return };
        let turning = self.turning();
        let before_deg = first.start_deg - self.beams.angle_deg(0);
        let before_us = libm::round(before_deg * turning.us_a_degree).max(0.0) as u64;
        scan.serial_number = first.sender_id;
        scan.status = DeviceStatus::Ok;
        scan.layer_centideg = 0;
        scan.telegram_counter = self.counter;
        scan.scan_counter = self.number as u16;
        // The clock of a scan is 32 bits wide and wraps.
        scan.scan_time_us = first.time_start_us.saturating_sub(before_us) as u32;
        scan.transmit_time_us = self.segments.values().last().unwrap_or(first).transmit_time_us as u32;
        scan.scan_frequency_hz = turning.frequency_hz;
        scan.beams = self.beams;
        scan.encoders.clear();
        scan.device_name.clear();
        scan.echoes.resize_with(first.echoes, Default::default);
        for (number, echo) in scan.echoes.iter_mut().enumerate() {
            echo.range_m.clear();
            echo.range_m.resize(self.beams.len(), DAZZLED);
            echo.remission.clear();
            if first.content.has_rssi() {
                echo.remission.resize(self.beams.len(), 0);
            }
            for segment in self.segments.values() {
                self.fill(segment, number, &mut echo.range_m, &mut echo.remission);
            }
        }
    }

    /// Writes the values of one echo of a segment to their beams.
    fn fill(&self, segment: &Segment, echo: usize, range_m: &mut [f64], remission: &mut [u16]) {
        let place = self.place(segment);
        let of = |list: &[u16], beam: usize| list.get(beam * segment.echoes + echo).copied();
        for beam in 0..segment.beams {
            let value = of(&segment.values.distance, beam).map(|counts| match counts {
                0 => NO_ECHO,
                counts => f64::from(counts) * segment.scale_mm / MM_PER_M,
            });
            if let Some((range_m, value)) = range_m.get_mut(place + beam).zip(value) {
                *range_m = value;
            }
            if let Some((remission, value)) =
                remission.get_mut(place + beam).zip(of(&segment.values.rssi, beam))
            {
                *remission = value;
            }
        }
    }

    /// The beam of the turn that the segment begins with.
    fn place(&self, segment: &Segment) -> usize {
        let steps = (segment.start_deg - self.beams.angle_deg(0)) / self.beams.step_deg();
        libm::round(steps).max(0.0) as usize
    }

    fn turning(&self) -> Turning {
        let timed = self.segments.values().filter(|segment| segment.time_stop_us > segment.time_start_us);
        let (us, deg) = timed.fold((0.0, 0.0), |(us, deg), segment| {
            (us + (segment.time_stop_us - segment.time_start_us) as f64, deg + segment.span_deg())
        });
        if deg <= 0.0 {
            return Turning { us_a_degree: 0.0, frequency_hz: 0.0 };
        }
        let measured_hz = 1e6 * deg / us / 360.0;
        let near = |hertz: &f64| libm::fabs(measured_hz / hertz - 1.0) < OFF_NOMINAL;
        let frequency_hz = NOMINAL_HZ.into_iter().find(near).unwrap_or(measured_hz);
        Turning { us_a_degree: 1e6 / (360.0 * frequency_hz), frequency_hz }
    }
}

/// Where segments lie, as far as they are known.
#[derive(Clone, Debug, Default)]
pub(super) struct Layout {
    step: u16,
    /// First and last angle of each segment, degrees.
    spans_deg: BTreeMap<u64, [f64; 2]>,
    /// They were seen in a turn of which nothing was missing: there are no others.
    is_whole: bool,
}

impl Layout {
    pub(super) fn of(segments: &BTreeMap<u64, Segment>) -> Self {
        let span = |segment: &Segment| [segment.start_deg, segment.start_deg + segment.span_deg()];
        Self {
            step: segments.values().next().map_or(0, |segment| segment.step),
            spans_deg: segments.iter().map(|(number, segment)| (*number, span(segment))).collect(),
            is_whole: false,
        }
    }

    /// The same where nothing was missing of the turn.
    pub(super) fn whole(self) -> Self {
        Self { is_whole: true, ..self }
    }

    /// With what `other` knows besides; that of `other` alone where their steps differ.
    pub(super) fn and(&self, other: Self) -> Self {
        if self.step != other.step {
            return other;
        }
        let mut spans_deg = self.spans_deg.clone();
        spans_deg.extend(other.spans_deg);
        Self { step: self.step, spans_deg, is_whole: self.is_whole }
    }

    /// True if these segments are all there are; false where that is not known yet.
    pub(super) fn is_all(&self, segments: &BTreeMap<u64, Segment>) -> bool {
        let alike = segments.values().next().is_some_and(|segment| segment.step == self.step);
        self.is_whole && alike && self.spans_deg.keys().eq(segments.keys())
    }

    /// The number of the last segment, if any is known.
    pub(super) fn last(&self) -> Option<u64> {
        self.spans_deg.keys().next_back().copied()
    }

    /// The beams from the first to the last one.
    pub(super) fn beams(&self) -> BeamGrid {
        let (from_deg, to_deg) =
            self.spans_deg.values().fold((f64::INFINITY, f64::NEG_INFINITY), |(from, to), span| {
                (from.min(span[0]), to.max(span[1]))
            });
        if self.step == 0 || from_deg > to_deg {
            return BeamGrid::default();
        }
        let steps = libm::round((to_deg - from_deg) / exact_step_deg(self.step)) as u32;
        BeamGrid {
            start: libm::round(from_deg * 10_000.0) as i32,
            step: self.step,
            count: steps.min(u32::from(u16::MAX) - 1) as u16 + 1,
        }
    }
}
