//! `field000`, `field001`, …: the evaluation fields' shapes, one variable a slot. A used slot's body is not taken apart.

use alloc::format;
use alloc::vec::Vec;

use super::wire::{FlexString, Opaque, fields};
use crate::model::Model;

/// Its shape is a sequence of beams with their ranges.
const SEGMENTED: u8 = 2;

fields! {
    /// One slot.
    pub struct Field {
        /// The body; [`unused`](Self::unused) is one byte.
        pub body: Opaque,
    }

    /// A slot's body where it is more than a byte. Recorded on an LMS111, an LMS511 and a TiM781S; of the shapes, only the segmented one is taken
    /// apart.
    pub struct Shape {
        /// Scale of the ranges.
        pub scale: f32,
        /// Offset of the ranges.
        pub offset: f32,
        /// Angle between beams, 1/10000°.
        pub step: u32 ["1/10000°"],
        /// Device angle of the first beam, 1/10000°.
        pub start_angle: i32 ["1/10000°"],
        /// Kind of the shape: 1 rectangle, 2 segmented, 3 dynamic.
        pub kind: u8,
        /// The field, from 1; 0 where it has no number.
        pub number: u8,
        /// A segmented field's corners.
        pub segments: Option<Vec<Segment>>,
        /// A rectangle, whose block is not taken apart.
        pub rectangle: Option<()>,
        /// A block never recorded.
        pub radial: Option<()>,
        /// A dynamic field, whose block is not taken apart.
        pub dynamic: Option<()>,
        /// Its name.
        pub name: Option<FlexString>,
        /// A block never recorded.
        pub comment: Option<()>,
    }

    /// A corner of a segmented field.
    pub struct Segment {
        /// The beam, from 0.
        pub beam: u16,
        /// Where the field begins on it; FFFF at the scanner.
        pub from: u16,
        /// Where it ends.
        pub to: u16,
    }
}

impl Shape {
    /// Slot number `slot` of `model` where nobody has set it; none where that is one byte.
    pub fn of_slot(slot: u16, model: &Model) -> Option<Self> {
        let slots = model.slots;
        (slot < slots.shaped).then(|| {
            let number = slot + 1;
            Self {
                scale: slots.scale,
                step: slots.step,
                start_angle: model.start_angle,
                kind: SEGMENTED,
                number: if slots.named { number as u8 } else { 0 },
                segments: slots.named.then(Vec::new),
                name: Some(FlexString(if slots.named {
                    format!("Field{number:03}")
                } else {
                    Default::default()
                })),
                ..Self::default()
            }
        })
    }
}

impl Field {
    /// An empty slot: one byte, or one digit, of zero.
    pub fn unused(dialect: crate::frame::Dialect) -> Self {
        let zero = match dialect {
            crate::frame::Dialect::A => b'0',
            crate::frame::Dialect::B => 0,
        };
        Self { body: Opaque(alloc::vec![zero]) }
    }
}

/// The slot's number, if `name` is `field` and three digits.
pub fn slot(name: &str) -> Option<u16> {
    let digits = name.strip_prefix("field")?;
    (digits.len() == 3 && digits.bytes().all(|b| b.is_ascii_digit())).then(|| digits.parse().ok())?
}
