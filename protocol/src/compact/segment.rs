//! A segment of a turn as a driver needs it: lines of evenly spaced beams, checked.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use super::angle::{TO_COLA, theta_rad};
use super::beams::Beams;
use super::scan::{Module, ScanTelegram};
use super::shape::Content;
use crate::angle::exact_step_deg;
use crate::scan::elevation_deg;
use crate::validity::{LARGEST_ANGLE_DEG, LARGEST_SCALE, LEAST_ANGLE_DEG, LEAST_SCALE, ScanFault};

/// Numbers of segments that are believed; a multiScan has 12 a turn.
pub(super) const MAX_SEGMENTS: u64 = 64;
/// Lines of a segment that are believed; a multiScan has 16.
const MAX_LINES_OF_ALL: usize = 64;
/// How far a beam may be off its even place: its angle is rounded down to 1/5215 rad.
const OFF_EVEN_RAD: f64 = 2.0 / 5215.0;

/// One segment of a turn, with the stamps of its module.
#[derive(Clone, Debug, PartialEq)]
pub struct Segment {
    /// Counts telegrams from power-up.
    pub telegram_counter: u64,
    /// When the telegram says that it was sent, µs on the scanner's clock; may lie before the last beam.
    pub transmit_time_us: u64,
    /// The turn it belongs to.
    pub frame_number: u64,
    /// Its number in the turn, from 0.
    pub number: u64,
    /// The scanner's serial number.
    pub sender_id: u32,
    /// Its lines, module by module; never empty.
    pub lines: Vec<SegmentLine>,
}

/// One line of a segment.
#[derive(Clone, Debug, PartialEq)]
pub struct SegmentLine {
    /// The layer as scans name it, [`Scan::layer_centideg`](crate::scan::Scan::layer_centideg): of the elevation that the telegram says, to 1/100°.
    pub layer_centideg: i16,
    /// When its first beam was measured, µs.
    pub time_start_us: u64,
    /// When its last beam was, µs.
    pub time_stop_us: u64,
    /// Device angle of the first beam, degrees, as CoLa counts them.
    pub start_deg: f64,
    /// Angle between beams, 1/10000°.
    pub step: u16,
    /// Beams.
    pub beams: usize,
    /// Echoes a beam.
    pub echoes: usize,
    /// Millimetres a count of distance.
    pub scale_mm: f64,
    /// Which quantities it has.
    pub content: Content,
    /// What the beams met.
    pub values: Beams,
}

impl Segment {
    /// The segment that a telegram is.
    ///
    /// # Errors
    /// It has no lines, no distances, or beams of which no scan can be made.
    pub fn of(telegram: ScanTelegram) -> Result<Self, ScanFault> {
        let ScanTelegram { telegram_counter, transmit_time_us, modules, .. } = telegram;
        let of_telegram = |module: &Module| (module.segment_counter, module.frame_number, module.sender_id);
        let Some(first) = modules.0.first().map(of_telegram) else {
            return Err(fields(String::from("it has no modules, expected 1 or more")));
        };
        if modules.0.iter().any(|module| of_telegram(module) != first) {
            return Err(fields(String::from(
                "its modules are of several segments, turns or scanners, expected one",
            )));
        }
        let (number, frame_number, sender_id) = first;
        if number >= MAX_SEGMENTS {
            return Err(fields(format!("its segment is number {number}, expected below {MAX_SEGMENTS}")));
        }
        let count: usize = modules.0.iter().map(|module| module.shape.lines as usize).sum();
        if count > MAX_LINES_OF_ALL {
            return Err(fields(format!("it has {count} lines, expected at most {MAX_LINES_OF_ALL}")));
        }
        let mut lines = Vec::with_capacity(count);
        for module in modules.0 {
            SegmentLine::of_module(module, &mut lines)?;
        }
        for (place, line) in lines.iter().enumerate() {
            if lines.iter().skip(place + 1).any(|other| other.layer_centideg == line.layer_centideg) {
                let deg = elevation_deg(line.layer_centideg);
                return Err(fields(format!(
                    "two of its lines have the elevation {deg}°, expected one a layer"
                )));
            }
        }
        Ok(Self { telegram_counter, transmit_time_us, frame_number, number, sender_id, lines })
    }

    /// A number that two segments share only where they say the same, but by an accident of one in 2⁶⁴.
    pub(super) fn digest(&self) -> u64 {
        let mut digest = Digest::default();
        for value in [self.telegram_counter, self.transmit_time_us, self.frame_number, self.number] {
            digest.add(value);
        }
        digest.add(u64::from(self.sender_id));
        for line in &self.lines {
            let angles = [line.layer_centideg as u64, line.start_deg.to_bits(), u64::from(line.step)];
            let sizes = [line.beams as u64, line.echoes as u64, line.scale_mm.to_bits()];
            let times = [line.time_start_us, line.time_stop_us];
            angles.into_iter().chain(sizes).chain(times).for_each(|value| digest.add(value));
            let Beams { distance, rssi, theta, properties } = &line.values;
            let words = [distance, rssi, theta].into_iter().flatten();
            words.for_each(|value| digest.add(u64::from(*value)));
            properties.iter().for_each(|value| digest.add(u64::from(*value)));
        }
        digest.0
    }

    /// True if both are of one scanner, with lines of the same layers.
    pub(super) fn is_like(&self, other: &Self) -> bool {
        let layer = |line: &SegmentLine| line.layer_centideg;
        self.sender_id == other.sender_id && self.lines.iter().map(layer).eq(other.lines.iter().map(layer))
    }

    /// True if the beams of each line come behind those of `other`, an earlier segment of the turn: farther on, or right behind it where they have
    /// gone around.
    pub(super) fn comes_behind(&self, other: &Self) -> bool {
        let between = self.number.saturating_sub(other.number) as i64;
        let is_behind = |(line, before): (&SegmentLine, &SegmentLine)| {
            line.steps_from(before).is_some_and(|steps| {
                let beams = before.beams as i64;
                steps >= beams || steps.saturating_add(line.turn()) == between.saturating_mul(beams)
            })
        };
        self.is_like(other) && self.lines.iter().zip(&other.lines).all(is_behind)
    }
}

impl SegmentLine {
    /// Appends the lines of a module.
    fn of_module(mut module: Module, lines: &mut Vec<Self>) -> Result<(), ScanFault> {
        if !module.content.has_distance() {
            return Err(ScanFault::NoDistance { channels: usize::from(module.content.has_rssi()) });
        }
        let scale = module.distance_scale.0;
        if !(LEAST_SCALE..=LARGEST_SCALE).contains(&scale) {
            return Err(ScanFault::ScaleFactor { value: scale });
        }
        for line in 0..module.shape.lines as usize {
            let angle = |angles: &[f32]| angles.get(line).copied().map_or(f64::NAN, f64::from);
            let time_us = |times: &[u64]| times.get(line).copied().unwrap_or_default();
            let (start_rad, stop_rad) = (angle(&module.theta_start_rad.0), angle(&module.theta_stop_rad.0));
            let is_alone = module.shape.lines == 1;
            let values = if is_alone {
                core::mem::take(&mut module.beams)
            } else {
                module.beams.of_line(line, module.shape)
            };
            lines.push(Self {
                layer_centideg: layer(angle(&module.phi_rad.0))?,
                time_start_us: time_us(&module.time_start_us.0),
                time_stop_us: time_us(&module.time_stop_us.0),
                start_deg: start_rad.to_degrees() + TO_COLA_DEG,
                step: step(module.shape.beams, &values.theta, start_rad, stop_rad)?,
                beams: module.shape.beams as usize,
                echoes: module.shape.echoes as usize,
                scale_mm: f64::from(scale),
                content: module.content,
                values,
            });
        }
        Ok(())
    }

    /// How many steps this line's first beam lies beyond that of `other`; none where they are of different grids.
    fn steps_from(&self, other: &Self) -> Option<i64> {
        let alike = (self.step, self.echoes, self.content) == (other.step, other.echoes, other.content);
        let steps = (self.start_deg - other.start_deg) / exact_step_deg(self.step);
        let whole = libm::round(steps);
        (alike && libm::fabs(steps - whole) < 0.25).then_some(whole as i64)
    }

    /// Steps of a whole turn.
    fn turn(&self) -> i64 {
        libm::round(360.0 / exact_step_deg(self.step)) as i64
    }

    /// How far its beams sweep, degrees.
    pub(super) fn span_deg(&self) -> f64 {
        exact_step_deg(self.step) * self.beams.saturating_sub(1) as f64
    }
}

/// In the manner of FNV-1a, a word at a time.
struct Digest(u64);

impl Default for Digest {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl Digest {
    fn add(&mut self, value: u64) {
        // Words are longer than bytes: the high half of what was multiplied comes down to the low one.
        self.0 = (self.0.rotate_left(29) ^ value).wrapping_mul(0x0000_0100_0000_01b3);
    }
}

/// Angles of Compact are that much less than those of CoLa, degrees.
const TO_COLA_DEG: f64 = TO_COLA as f64 / 10_000.0;

fn fields(reason: String) -> ScanFault {
    ScanFault::Fields { reason }
}

/// The layer of this elevation: codes count downwards.
fn layer(phi_rad: f64) -> Result<i16, ScanFault> {
    let deg = phi_rad.to_degrees();
    if !(-90.0..=90.0).contains(&deg) {
        return Err(fields(format!("a line's elevation is {deg}°, expected −90° to 90°")));
    }
    Ok(libm::round(-100.0 * deg) as i16)
}

/// The angle between the beams of a line, 1/10000°, if they are evenly spaced and point where a scanner can.
fn step(beams: u32, theta: &[u16], start_rad: f64, stop_rad: f64) -> Result<u16, ScanFault> {
    let steps = match beams {
        0 => return Err(ScanFault::NoBeams),
        1 => return Err(fields(String::from("it has 1 beam, expected 2 or more: one has no step"))),
        beams => f64::from(beams - 1),
    };
    let (start_deg, stop_deg) = (start_rad.to_degrees() + TO_COLA_DEG, stop_rad.to_degrees() + TO_COLA_DEG);
    let is_field = start_deg >= LEAST_ANGLE_DEG && stop_deg <= LARGEST_ANGLE_DEG && start_deg <= stop_deg;
    if !is_field || stop_deg - start_deg > 360.0 {
        return Err(ScanFault::Field { start_deg, stop_deg });
    }
    let step = libm::round((stop_deg - start_deg) / steps * 10_000.0);
    if step < 1.0 {
        return Err(ScanFault::AngularStep);
    }
    let Some(step) = Some(step).filter(|step| *step <= f64::from(u16::MAX)) else {
        return Err(fields(format!("its beams are {}° apart, expected at most 6.5", step / 10_000.0)));
    };
    let between_rad = (stop_rad - start_rad) / steps;
    let off = theta.iter().enumerate().find(|(beam, code)| {
        libm::fabs(theta_rad(**code) - (start_rad + *beam as f64 * between_rad)) > OFF_EVEN_RAD
    });
    if let Some((beam, code)) = off {
        let deg = theta_rad(*code).to_degrees();
        return Err(fields(format!("its beam {beam} is at {deg:.3}°, off its place between first and last")));
    }
    Ok(step as u16)
}
