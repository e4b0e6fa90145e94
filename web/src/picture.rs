//! One picture: the tractor and the newest line of every scanner, as bytes that a browser draws.
//!
//! | bytes | hold |
//! |---|---|
//! | 4 | `RWP1` |
//! | u32, u32 | number of the picture; lines in it |
//! | f64 | seconds |
//! | 6 × f32 | tractor: x, y, up, heading, roll, pitch; not a number where there is none |
//! | a line each | u32 scanner, u32 beams, u32 counter, u32 flags (1 remissions, 2 classes, 4 sight); f64 seconds; f32 start and step, degrees; |
//! | | 12 × f32 sight: origin, first, step, advance, axis to the row, axis up; f32 × beams range; u16 × beams remission; u8 × beams class; zeros up to a multiple of 4 |
//!
//! All little endian.

use rowscan_protocol::scan::Pose;

use crate::gauges::TractorGauge;
use crate::line::Line;
use crate::orchard::class_code;

const MAGIC: &[u8; 4] = b"RWP1";
const REMISSIONS: u32 = 1;
const CLASSES: u32 = 2;
const SIGHT: u32 = 4;

/// Writes a picture of these lines, each with its scanner's number.
pub(crate) fn write<'a>(
    number: u32,
    tractor: Option<&TractorGauge>,
    lines: impl ExactSizeIterator<Item = (usize, &'a Line)>,
) -> Vec<u8> {
    let mut out = Vec::with_capacity(4096);
    out.extend_from_slice(MAGIC);
    word(number, &mut out);
    word(u32::try_from(lines.len()).unwrap_or(u32::MAX), &mut out);
    let at_s = tractor.map_or(f64::NAN, |tractor| tractor.at_s);
    out.extend_from_slice(&at_s.to_le_bytes());
    let pose = tractor
        .map_or([f64::NAN; 6], |at| [at.x_m, at.y_m, at.up_m, at.heading_rad, at.roll_rad, at.pitch_rad]);
    floats(&pose, &mut out);
    for (scanner, line) in lines {
        write_line(scanner, line, &mut out);
    }
    out
}

fn write_line(scanner: usize, line: &Line, out: &mut Vec<u8>) {
    let beams = line.range_m.len();
    let has_remission = line.remission.len() == beams;
    let has_classes = line.classes.len() == beams;
    word(u32::try_from(scanner).unwrap_or(u32::MAX), out);
    word(u32::try_from(beams).unwrap_or(u32::MAX), out);
    word(u32::from(line.counter), out);
    let flags = [(has_remission, REMISSIONS), (has_classes, CLASSES), (line.sight.is_some(), SIGHT)];
    word(flags.iter().filter(|(has, _)| *has).map(|(_, flag)| flag).sum(), out);
    out.extend_from_slice(&line.at_s.to_le_bytes());
    floats(&[line.start_deg, line.step_deg], out);
    let sight = line.sight.map_or([0.0; 12], |sight| {
        let Pose { x_m, y_m, z_m } = sight.origin;
        let ([ux, uy, uz], [wx, wy, wz]) = (sight.axes.to_row, sight.axes.up);
        [x_m, y_m, z_m, sight.first_rad, sight.step_rad, sight.advance_m, ux, uy, uz, wx, wy, wz]
    });
    floats(&sight, out);
    line.range_m.iter().for_each(|range| out.extend_from_slice(&range.to_le_bytes()));
    if has_remission {
        line.remission.iter().for_each(|remission| out.extend_from_slice(&remission.to_le_bytes()));
    }
    if has_classes {
        out.extend(line.classes.iter().map(|class| class_code(*class)));
    }
    out.resize(out.len().next_multiple_of(4), 0);
}

fn word(value: u32, out: &mut Vec<u8>) {
    out.extend_from_slice(&value.to_le_bytes());
}

fn floats(values: &[f64], out: &mut Vec<u8>) {
    values.iter().for_each(|value| out.extend_from_slice(&(*value as f32).to_le_bytes()));
}
