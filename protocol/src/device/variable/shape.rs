//! What a variable's value is made of, and how its parts look on CoLa's wire.

use alloc::string::String;

use crate::compact::TO_COLA;
use crate::model::Model;
use crate::telegram::wire::{Fields, FlexString, Reader, WireError, Writer};

/// 180°, 1/10000°.
const HALF_TURN: i64 = 1_800_000;

/// A part of a variable's value.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// What REST calls it, where the value is a struct; a path with dots where structs and lists are nested, places in lists as numbers.
    pub key: &'static str,
    /// What it is.
    pub kind: Kind,
}

/// What a part is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Off or on: a byte in CoLa, a boolean in REST.
    Flag,
    /// A whole number of so many bytes, from the least to the most that is taken.
    Number {
        /// Bytes in CoLa B.
        bytes: u8,
        /// The least.
        from: i64,
        /// The most.
        to: i64,
    },
    /// An angle in the plane of a scanner's lines, 1/10000°, 0 straight ahead: within the scanner's own field.
    Azimuth,
    /// An IPv4 address: four bytes in CoLa, four numbers in REST.
    Address,
    /// A text of at most so many characters.
    Text(usize),
}

/// The value of a part.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Value {
    /// A flag or a number.
    Number(i64),
    /// An address.
    Address([u8; 4]),
    /// A text.
    Text(String),
}

impl Value {
    /// The number; 0 of anything else.
    pub fn number(&self) -> i64 {
        if let Self::Number(number) = self { *number } else { 0 }
    }
}

impl Kind {
    /// The value that a number stands for: an address by its four bytes.
    pub(in crate::device) fn value(self, number: i64) -> Value {
        match self {
            Self::Address => Value::Address((number as u32).to_be_bytes()),
            Self::Flag | Self::Number { .. } | Self::Azimuth | Self::Text(_) => Value::Number(number),
        }
    }

    /// The same of a scanner of `model`.
    pub(super) fn takes_of(self, model: &Model, value: &Value) -> bool {
        let field = [model.start_angle, model.stop_angle].map(|angle| i64::from(angle - TO_COLA));
        let is_round = field[1] - field[0] + i64::from(model.default_mode.step) >= 2 * HALF_TURN;
        let is_inside = |angle| is_round || (field[0]..=field[1]).contains(&angle);
        self.takes(value) && (self != Self::Azimuth || is_inside(value.number()))
    }

    /// True if this is a value of this kind, within the range that it has on any scanner.
    pub fn takes(self, value: &Value) -> bool {
        match (self, value) {
            (Self::Flag, Value::Number(number)) => (0..=1).contains(number),
            (Self::Number { from, to, .. }, Value::Number(number)) => (from..=to).contains(number),
            (Self::Azimuth, Value::Number(number)) => number.abs() <= HALF_TURN,
            (Self::Address, Value::Address(_)) => true,
            (Self::Text(most), Value::Text(text)) => text.chars().count() <= most,
            _ => false,
        }
    }

    pub(super) fn read(self, reader: &mut Reader<'_>) -> Result<Value, WireError> {
        Ok(match self {
            Self::Flag => {
                let mut flag = false;
                flag.read(reader)?;
                Value::Number(flag.into())
            }
            Self::Number { bytes: 1, from, .. } => {
                let byte = reader.u8()?;
                Value::Number(if from < 0 { i64::from(byte as i8) } else { byte.into() })
            }
            Self::Number { bytes: 2, from, .. } => {
                let word = reader.u16()?;
                Value::Number(if from < 0 { i64::from(word as i16) } else { word.into() })
            }
            Self::Number { from, .. } => {
                let word = reader.u32()?;
                Value::Number(if from < 0 { i64::from(word as i32) } else { word.into() })
            }
            Self::Azimuth => Value::Number((reader.u32()? as i32).into()),
            Self::Address => {
                let mut address = [0_u8; 4];
                address.read(reader)?;
                Value::Address(address)
            }
            Self::Text(_) => {
                let mut text = FlexString::default();
                text.read(reader)?;
                Value::Text(text.0)
            }
        })
    }

    pub(super) fn write(self, value: &Value, writer: &mut Writer<'_>) {
        match (self, value) {
            (Self::Flag, value) => writer.u8(u8::from(value.number() != 0)),
            (Self::Number { bytes: 1, .. }, value) => writer.u8(value.number() as u8),
            (Self::Number { bytes: 2, .. }, value) => writer.u16(value.number() as u16),
            (Self::Number { .. } | Self::Azimuth, value) => writer.u32(value.number() as u32),
            (Self::Address, Value::Address(address)) => address.write(writer),
            (Self::Text(_), Value::Text(text)) => FlexString(text.clone()).write(writer),
            (Self::Address | Self::Text(_), _) => {}
        }
    }
}
