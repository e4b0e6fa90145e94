//! Monitoring fields: what `40`, `45` and `46` configure, and where their borders lie.
//!
//! Two sets of three fields. Source: telegram listing, tables 7-70 to 7-74 and 7-87 to 7-94. Where a segmented field's border lies between
//! two of its radii is not stated: here each radius holds from its ray to the next.

use alloc::vec::Vec;

use crate::angle::BeamGrid;
use crate::lms2xx::Variant;
use crate::lms2xx::values::Unit;
use crate::lms2xx::words::{put_words, read_words, word};

/// A, B, C.
pub(super) const FIELDS: usize = 3;
/// Added to a field's number where its lengths are millimetres.
const MILLIMETRES: u8 = 0x40;
/// Out of the box: ten segments of 50 mm.
const DEFAULT_SEGMENTS: usize = 10;
const DEFAULT_RADIUS: u16 = 50;
/// The numbers of a field type in `C5`: A from 0, B from 6, C from 0C.
const TYPES_APART: u16 = 6;

/// What a field's border is made of, in the field's unit.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Shape {
    Rectangle {
        left: u16,
        right: u16,
        height: u16,
    },
    Radial(u16),
    /// One radius a ray; one more than there are segments.
    Segmented(Vec<u16>),
    /// One radius a beam.
    Taught(Vec<u16>),
}

/// One field.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Field {
    unit: Unit,
    variant: Variant,
    shape: Shape,
}

/// Which field: the set from 0, the field from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Place {
    pub(super) set: usize,
    pub(super) field: usize,
}

/// All fields.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Fields([[Field; FIELDS]; 2]);

impl Default for Fields {
    fn default() -> Self {
        let field = || Field {
            unit: Unit::Mm,
            variant: Variant { angle_deg: 180, step_centideg: 50 },
            shape: Shape::Segmented(alloc::vec![DEFAULT_RADIUS; DEFAULT_SEGMENTS + 1]),
        };
        let set = || [field(), field(), field()];
        Self([set(), set()])
    }
}

impl Fields {
    pub(super) fn get(&self, place: Place) -> Option<&Field> {
        self.0.get(place.set)?.get(place.field)
    }

    /// The fields of this set, counted from 1.
    pub(super) fn set(&self, set: u8) -> &[Field; FIELDS] {
        let [first, second] = &self.0;
        if set == 2 { second } else { first }
    }

    pub(super) fn put(&mut self, place: Place, field: Field) {
        if let Some(to) = self.0.get_mut(place.set).and_then(|set| set.get_mut(place.field)) {
            *to = field;
        }
    }
}

impl Place {
    /// Of a set from 1, and of a field type with or without millimetres.
    pub(super) fn of(set: u8, field: u8) -> Option<Self> {
        let place = Self { set: usize::from(set).checked_sub(1)?, field: usize::from(field & !MILLIMETRES) };
        (place.set < 2 && place.field < FIELDS).then_some(place)
    }
}

fn words(bytes: &[u8]) -> Vec<u16> {
    let mut words = Vec::new();
    read_words(bytes, &mut words);
    words
}

/// Segments that this number stands for at this angle.
fn segments(number: u8, angle_deg: u16) -> Option<usize> {
    match (number, angle_deg) {
        (0xFE, 180) => Some(360),
        (0xFF, 100) => Some(400),
        (9 | 10 | 15 | 18 | 30 | 45 | 90 | 180, 180) | (5 | 10 | 50 | 100, 100) => Some(number.into()),
        _ => None,
    }
}

impl Shape {
    fn parse(mode: u8, angle_deg: u16, data: &[u8]) -> Option<Self> {
        match (mode, data) {
            (0, [_, _, _, _, _, _]) => match *words(data) {
                [left, right, height] => Some(Self::Rectangle { left, right, height }),
                _ => None,
            },
            (1, &[low, high]) => Some(Self::Radial(word([low, high]))),
            (2, [number, radii @ ..]) => {
                let rays = segments(*number, angle_deg)? + 1;
                (radii.len() == 2 * rays).then(|| Self::Segmented(words(radii)))
            }
            _ => None,
        }
    }

    /// Its number among the types of one field.
    fn number(&self) -> u16 {
        match self {
            Self::Rectangle { .. } => 0,
            Self::Radial(_) => 1,
            Self::Segmented(_) => 2,
            Self::Taught(_) => 3,
        }
    }

    fn encode(&self, out: &mut Vec<u8>) {
        match self {
            Self::Rectangle { left, right, height } => put_words(&[*left, *right, *height], out),
            Self::Radial(radius) => put_words(&[*radius], out),
            Self::Taught(radii) => put_words(radii, out),
            Self::Segmented(radii) => {
                out.push(match radii.len().saturating_sub(1) {
                    360 => 0xFE,
                    400 => 0xFF,
                    segments => segments as u8,
                });
                put_words(radii, out);
            }
        }
    }
}

/// Bytes that the listing leaves reserved before a field's lengths: one in its reply table and its example, six in its request table.
const RESERVED: [usize; 2] = [1, 6];

impl Field {
    /// Reads the data of `40`: where the field belongs, and the field.
    pub(super) fn parse(data: &[u8]) -> Option<(Place, Self)> {
        let (&[set, kind, a, b, c, d, mode], rest) = data.split_first_chunk::<7>()?;
        let place = Place::of(set, kind)?;
        let unit = if kind & MILLIMETRES == 0 { Unit::Cm } else { Unit::Mm };
        let variant = Variant { angle_deg: word([a, b]), step_centideg: word([c, d]) };
        let shape = RESERVED
            .into_iter()
            .find_map(|reserved| Shape::parse(mode, variant.angle_deg, rest.get(reserved..)?))?;
        Some((place, Self { unit, variant, shape }))
    }

    /// One taught in: its border lies so far before what was seen.
    pub(super) fn taught(variant: Variant, range_mm: &[u16], before_mm: u16) -> Self {
        let radii = range_mm.iter().map(|range| range.saturating_sub(before_mm)).collect();
        Self { unit: Unit::Mm, variant, shape: Shape::Taught(radii) }
    }

    /// A circle about the scanner.
    pub(super) fn radial_mm(variant: Variant, radius_mm: u16) -> Self {
        Self { unit: Unit::Mm, variant, shape: Shape::Radial(radius_mm) }
    }

    /// Appends the data of `C5` behind the set's number.
    pub(super) fn encode(&self, place: Place, out: &mut Vec<u8>) {
        let millimetres = if self.unit == Unit::Mm { u16::from(MILLIMETRES) } else { 0 };
        let kind = place.field as u16 * TYPES_APART + self.shape.number() + millimetres;
        put_words(&[kind, self.variant.angle_deg, self.variant.step_centideg], out);
        out.push(0);
        self.shape.encode(out);
    }

    /// What was taught in, millimetres.
    pub(super) fn taught_mm(&self) -> Option<&[u16]> {
        match &self.shape {
            Shape::Taught(radii) => Some(radii),
            _ => None,
        }
    }

    /// Segments; one where the field has none.
    pub(super) fn segments(&self) -> usize {
        match &self.shape {
            Shape::Segmented(radii) => radii.len().saturating_sub(1).max(1),
            _ => 1,
        }
    }

    /// How far its border is in this direction, millimetres; 0 outside its angle.
    pub(super) fn border_mm(&self, angle_deg: f64) -> f64 {
        let (from, to) = self.span_deg();
        if !(from..=to).contains(&angle_deg) {
            return 0.0;
        }
        let share = (angle_deg - from) / (to - from).max(1.0);
        let at = |radii: &[u16], places: usize| {
            let place = (share * places as f64 + 1e-9) as usize;
            radii.get(place.min(radii.len().saturating_sub(1))).copied().map_or(0.0, f64::from)
        };
        let border = match &self.shape {
            Shape::Radial(radius) => f64::from(*radius),
            Shape::Segmented(radii) | Shape::Taught(radii) => at(radii, radii.len().saturating_sub(1)),
            Shape::Rectangle { left, right, height } => {
                let (sin, cos) = (libm::sin(angle_deg.to_radians()), libm::cos(angle_deg.to_radians()));
                let side = f64::from(if cos >= 0.0 { *right } else { *left });
                (f64::from(*height) / sin.max(1e-9)).min(side / cos.abs().max(1e-9))
            }
        };
        match self.unit {
            Unit::Mm => border,
            Unit::Cm => 10.0 * border,
        }
    }

    fn span_deg(&self) -> (f64, f64) {
        let half = f64::from(self.variant.angle_deg) / 2.0;
        (90.0 - half, 90.0 + half)
    }

    /// Which of these beams end in it; 0 is no echo.
    pub(super) fn holds(&self, angle_deg: f64, range_mm: u16) -> bool {
        range_mm > 0 && f64::from(range_mm) < self.border_mm(angle_deg)
    }

    /// Whether an object wider than the blanking is in it: beams side by side.
    pub(super) fn is_infringed(&self, beams: BeamGrid, range_mm: &[u16], blanking_cm: u16) -> bool {
        let step_rad = beams.step_deg().to_radians();
        let (blanking_mm, mut width_mm) = (10.0 * f64::from(blanking_cm), 0.0);
        range_mm.iter().enumerate().any(|(place, range)| {
            width_mm = match self.holds(beams.angle_deg(place), *range) {
                true => width_mm + f64::from(*range) * step_rad,
                false => 0.0,
            };
            width_mm > blanking_mm
        })
    }
}
