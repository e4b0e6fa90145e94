//! A segment of a turn as a driver needs it: one line of evenly spaced beams, checked.

use alloc::format;
use alloc::string::String;

use super::angle::{TO_COLA, theta_rad};
use super::beams::Beams;
use super::scan::{Module, ScanTelegram};
use super::shape::Content;
use crate::angle::exact_step_deg;
use crate::validity::{LARGEST_ANGLE_DEG, LARGEST_SCALE, LEAST_ANGLE_DEG, LEAST_SCALE, ScanFault};

/// Numbers of segments that are believed; a multiScan has 12 a turn.
pub(super) const MAX_SEGMENTS: u64 = 64;
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
    /// It has several lines, no distances, or beams of which no scan can be made.
    pub fn of(telegram: ScanTelegram) -> Result<Self, ScanFault> {
        let ScanTelegram { telegram_counter, transmit_time_us, modules, .. } = telegram;
        let count = modules.0.len();
        let Ok([module]) = <[Module; 1]>::try_from(modules.0) else {
            return Err(fields(format!("it has {count} modules, expected 1: scanners of one line are read")));
        };
        if module.shape.lines != 1 {
            let lines = module.shape.lines;
            return Err(fields(format!("it has {lines} lines, expected 1: scanners of one line are read")));
        }
        if module.segment_counter >= MAX_SEGMENTS {
            let number = module.segment_counter;
            return Err(fields(format!("its segment is number {number}, expected below {MAX_SEGMENTS}")));
        }
        let (start_rad, stop_rad) = (first(&module.theta_start_rad.0), first(&module.theta_stop_rad.0));
        let step = step(&module, start_rad, stop_rad)?;
        if !module.content.has_distance() {
            return Err(ScanFault::NoDistance { channels: usize::from(module.content.has_rssi()) });
        }
        let scale = module.distance_scale.0;
        if !(LEAST_SCALE..=LARGEST_SCALE).contains(&scale) {
            return Err(ScanFault::ScaleFactor { value: scale });
        }
        Ok(Self {
            telegram_counter,
            transmit_time_us,
            frame_number: module.frame_number,
            number: module.segment_counter,
            sender_id: module.sender_id,
            time_start_us: module.time_start_us.0.first().copied().unwrap_or_default(),
            time_stop_us: module.time_stop_us.0.first().copied().unwrap_or_default(),
            start_deg: start_rad.to_degrees() + TO_COLA_DEG,
            step,
            beams: module.shape.beams as usize,
            echoes: module.shape.echoes as usize,
            scale_mm: f64::from(scale),
            content: module.content,
            values: module.beams,
        })
    }

    /// How many steps this segment's first beam lies beyond that of `other`; none where they are of different grids.
    pub(super) fn steps_from(&self, other: &Self) -> Option<i64> {
        let alike = (self.step, self.echoes, self.content, self.sender_id)
            == (other.step, other.echoes, other.content, other.sender_id);
        let steps = (self.start_deg - other.start_deg) / exact_step_deg(self.step);
        let whole = libm::round(steps);
        (alike && libm::fabs(steps - whole) < 0.25).then_some(whole as i64)
    }

    /// How far its beams sweep, degrees.
    pub(super) fn span_deg(&self) -> f64 {
        exact_step_deg(self.step) * self.beams.saturating_sub(1) as f64
    }
}

/// Angles of Compact are that much less than those of CoLa, degrees.
const TO_COLA_DEG: f64 = TO_COLA as f64 / 10_000.0;

fn fields(reason: String) -> ScanFault {
    ScanFault::Fields { reason }
}

fn first(angles: &[f32]) -> f64 {
    angles.first().copied().map_or(f64::NAN, f64::from)
}

/// The angle between the beams of a module, 1/10000°, if they are evenly spaced and point where a scanner can.
fn step(module: &Module, start_rad: f64, stop_rad: f64) -> Result<u16, ScanFault> {
    let steps = match module.shape.beams {
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
    let off = module.beams.theta.iter().enumerate().find(|(beam, code)| {
        libm::fabs(theta_rad(**code) - (start_rad + *beam as f64 * between_rad)) > OFF_EVEN_RAD
    });
    if let Some((beam, code)) = off {
        let deg = theta_rad(*code).to_degrees();
        return Err(fields(format!("its beam {beam} is at {deg:.3}°, off its place between first and last")));
    }
    Ok(step as u16)
}
