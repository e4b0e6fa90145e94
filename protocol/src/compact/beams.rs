//! What the beams of a module met.

use alloc::vec::Vec;

use super::error::CompactError;
use super::shape::{Content, Shape, Version};
use super::wire::{Context, Fields, Reader, Writer, list};
use crate::visit::{Group, Visitor};

/// Bit of `properties`: the beam met a reflector.
pub const REFLECTOR: u8 = 1;

/// The beams of a module, by quantity. Index of an echo: (beam × lines + line) × echoes + echo; of a beam of a line: beam × lines + line. A
/// quantity that the module's content leaves out is empty.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Beams {
    /// Counts of the module's scale; 0 is no echo. One an echo.
    pub distance: Vec<u16>,
    /// Strength of the echo. A picoScan sends 8 bits, times 257. One an echo.
    pub rssi: Vec<u16>,
    /// [`REFLECTOR`]; the other bits are reserved. One a beam of a line.
    pub properties: Vec<u8>,
    /// Angle in the plane of the line, see [`theta_rad`](super::theta_rad). One a beam of a line.
    pub theta: Vec<u16>,
}

/// So many items from place `from` on, and again after each `stride`.
fn every<T: Copy>(items: &[T], from: usize, count: usize, stride: usize) -> Vec<T> {
    let rows = items.chunks(stride.max(1));
    rows.flat_map(|row| row.iter().skip(from).take(count)).copied().collect()
}

/// One number of a beam.
#[derive(Clone, Copy)]
enum Slot {
    Distance(usize),
    Rssi(usize),
    Properties(usize),
    Theta(usize),
}

/// The numbers in their order on the wire. Version 3 has the angle before the properties.
fn slots(context: Context) -> impl Iterator<Item = Slot> {
    let Context { version, shape, content, .. } = context;
    // What takes no byte is not gone through: any counts would fit a telegram of nothing.
    let sent = |is_sent: bool, count: usize| if is_sent { count } else { 0 };
    let echoes = sent(content.has_distance() || content.has_rssi(), shape.echoes as usize);
    let beams = sent(bytes(shape, content) > 0, shape.beams_of_lines());
    (0..beams).flat_map(move |beam| {
        let of_echo = move |echo: usize| {
            let at = beam * echoes + echo;
            let distance = content.has_distance().then_some(Slot::Distance(at));
            [distance, content.has_rssi().then_some(Slot::Rssi(at))]
        };
        let properties = content.has_properties().then_some(Slot::Properties(beam));
        let theta = content.has_theta().then_some(Slot::Theta(beam));
        let last = if version == Version::V3 { [theta, properties] } else { [properties, theta] };
        (0..echoes).flat_map(of_echo).chain(last).flatten()
    })
}

/// Bytes that all beams of a module take.
pub(super) fn bytes(shape: Shape, content: Content) -> u64 {
    let of_echo = 2 * u64::from(content.has_distance()) + 2 * u64::from(content.has_rssi());
    let of_beam = u64::from(content.has_properties()) + 2 * u64::from(content.has_theta());
    // Within bounds: see MAX_LINES, MAX_BEAMS and MAX_ECHOES.
    shape.beams_of_lines() as u64 * (u64::from(shape.echoes) * of_echo + of_beam)
}

impl Beams {
    /// Those of one line of a module of this shape.
    pub(super) fn of_line(&self, line: usize, shape: Shape) -> Self {
        let (lines, echoes) = (shape.lines as usize, shape.echoes as usize);
        Self {
            distance: every(&self.distance, line * echoes, echoes, lines * echoes),
            rssi: every(&self.rssi, line * echoes, echoes, lines * echoes),
            properties: every(&self.properties, line, 1, lines),
            theta: every(&self.theta, line, 1, lines),
        }
    }

    /// How long each list of a module of this shape and content is, by name, and how long it is here.
    pub(super) fn lengths(&self, shape: Shape, content: Content) -> [(&'static str, usize, usize); 4] {
        let (beams, echoes) = (shape.beams_of_lines(), shape.beams_of_lines() * shape.echoes as usize);
        let wanted = |is_sent: bool, count: usize| if is_sent { count } else { 0 };
        [
            ("distance", wanted(content.has_distance(), echoes), self.distance.len()),
            ("rssi", wanted(content.has_rssi(), echoes), self.rssi.len()),
            ("properties", wanted(content.has_properties(), beams), self.properties.len()),
            ("theta", wanted(content.has_theta(), beams), self.theta.len()),
        ]
    }
}

impl Fields for Beams {
    fn read(&mut self, reader: &mut Reader<'_>) -> Result<(), CompactError> {
        let context = reader.context;
        reader.needs(bytes(context.shape, context.content))?;
        *self = Self::default();
        for slot in slots(context) {
            match slot {
                Slot::Distance(_) => push(&mut self.distance, reader)?,
                Slot::Rssi(_) => push(&mut self.rssi, reader)?,
                Slot::Properties(_) => push(&mut self.properties, reader)?,
                Slot::Theta(_) => push(&mut self.theta, reader)?,
            }
        }
        Ok(())
    }

    fn write(&self, writer: &mut Writer<'_>) {
        for slot in slots(writer.context) {
            // Lists of another length are refused before anything is written.
            match slot {
                Slot::Distance(at) => self.distance.get(at).copied().unwrap_or_default().write(writer),
                Slot::Rssi(at) => self.rssi.get(at).copied().unwrap_or_default().write(writer),
                Slot::Properties(at) => self.properties.get(at).copied().unwrap_or_default().write(writer),
                Slot::Theta(at) => self.theta.get(at).copied().unwrap_or_default().write(writer),
            }
        }
    }

    fn visit(&self, visitor: &mut dyn Visitor) {
        visitor.begin(Group::Struct);
        visitor.field("distance", None);
        list(&self.distance, visitor);
        visitor.field("rssi", None);
        list(&self.rssi, visitor);
        visitor.field("properties", None);
        list(&self.properties, visitor);
        visitor.field("theta", Some("1/5215 rad from 16384"));
        list(&self.theta, visitor);
        visitor.end();
    }
}

fn push<T: Fields + Default>(list: &mut Vec<T>, reader: &mut Reader<'_>) -> Result<(), CompactError> {
    let mut item = T::default();
    item.read(reader)?;
    list.push(item);
    Ok(())
}
