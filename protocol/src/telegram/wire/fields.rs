//! Types that know their wire form.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use core::fmt;

use super::error::{Found, WireError};
use super::reader::Reader;
use super::writer::Writer;
use crate::frame::Dialect;
use crate::visit::{Group, Value, Visitor};

/// A wire form that serves both dialects and both directions.
pub trait Fields {
    /// Whether [`visit`](Self::visit) gives a struct.
    const IS_STRUCT: bool = false;

    /// Reads into `self`, so that its buffers are reused. After an error `self` holds what was read so far.
    fn read(&mut self, reader: &mut Reader<'_>) -> Result<(), WireError>;
    /// Writes `self`.
    fn write(&self, writer: &mut Writer<'_>);
    /// Hands the value, or its parts, to `visitor`.
    fn visit(&self, visitor: &mut dyn Visitor);
}

/// Declares structs whose fields follow each other on the wire in the order written. A field's unit may stand behind its type, in brackets.
macro_rules! fields {
    ($($(#[$meta:meta])* pub struct $name:ident { $($(#[$field_meta:meta])* pub $field:ident: $type:ty $([$unit:literal])?,)* })*) => {$(
        $(#[$meta])*
        #[derive(Clone, Debug, Default, PartialEq)]
        pub struct $name { $($(#[$field_meta])* pub $field: $type,)* }

        impl $crate::telegram::wire::Fields for $name {
            const IS_STRUCT: bool = true;

            fn read(
                &mut self,
                reader: &mut $crate::telegram::wire::Reader<'_>,
            ) -> Result<(), $crate::telegram::wire::WireError> {
                $($crate::telegram::wire::Fields::read(&mut self.$field, reader)?;)*
                let _ = reader;
                Ok(())
            }

            fn write(&self, writer: &mut $crate::telegram::wire::Writer<'_>) {
                $($crate::telegram::wire::Fields::write(&self.$field, writer);)*
                let _ = writer;
            }

            fn visit(&self, visitor: &mut dyn $crate::visit::Visitor) {
                visitor.begin($crate::visit::Group::Struct);
                $(
                    visitor.field(stringify!($field), $crate::telegram::wire::unit!($($unit)?));
                    $crate::telegram::wire::Fields::visit(&self.$field, visitor);
                )*
                visitor.end();
            }
        }
    )*};
}
pub(crate) use fields;

/// A unit that may be left out.
macro_rules! unit {
    () => {
        None
    };
    ($unit:literal) => {
        Some($unit)
    };
}
pub(crate) use unit;

macro_rules! numbers {
    ($($type:ty: $unsigned:ty, $bytes:literal;)*) => {$(
        impl Fields for $type {
            fn read(&mut self, reader: &mut Reader<'_>) -> Result<(), WireError> {
                *self = reader.number::<$bytes>()? as $unsigned as Self;
                Ok(())
            }

            fn write(&self, writer: &mut Writer<'_>) {
                writer.number::<$bytes>(u32::from(*self as $unsigned));
            }

            fn visit(&self, visitor: &mut dyn Visitor) {
                visitor.value(Value::Integer((*self).into()));
            }
        }
    )*};
}

numbers! {
    u8: u8, 1;
    u16: u16, 2;
    u32: u32, 4;
    i8: u8, 1;
    i16: u16, 2;
    i32: u32, 4;
}

impl Fields for () {
    const IS_STRUCT: bool = true;

    fn read(&mut self, _: &mut Reader<'_>) -> Result<(), WireError> {
        Ok(())
    }

    fn write(&self, _: &mut Writer<'_>) {}

    fn visit(&self, visitor: &mut dyn Visitor) {
        visitor.begin(Group::Struct);
        visitor.end();
    }
}

/// One byte, or one digit.
impl Fields for bool {
    fn read(&mut self, reader: &mut Reader<'_>) -> Result<(), WireError> {
        let at = reader.at();
        *self = match reader.u8()? {
            0 => false,
            1 => true,
            other => return Err(WireError { expected: "0 or 1", found: Found::Value(other.into()), at }),
        };
        Ok(())
    }

    fn write(&self, writer: &mut Writer<'_>) {
        writer.u8(u8::from(*self));
    }

    fn visit(&self, visitor: &mut dyn Visitor) {
        visitor.value(Value::Flag(*self));
    }
}

impl Fields for f32 {
    fn read(&mut self, reader: &mut Reader<'_>) -> Result<(), WireError> {
        *self = reader.real()?;
        Ok(())
    }

    fn write(&self, writer: &mut Writer<'_>) {
        writer.u32_padded(self.to_bits());
    }

    fn visit(&self, visitor: &mut dyn Visitor) {
        visitor.value(Value::Real(*self));
    }
}

impl<T: Fields, const N: usize> Fields for [T; N] {
    fn read(&mut self, reader: &mut Reader<'_>) -> Result<(), WireError> {
        self.iter_mut().try_for_each(|item| item.read(reader))
    }

    fn write(&self, writer: &mut Writer<'_>) {
        self.iter().for_each(|item| item.write(writer));
    }

    fn visit(&self, visitor: &mut dyn Visitor) {
        visitor.begin(Group::List);
        self.iter().for_each(|item| item.visit(visitor));
        visitor.end();
    }
}

/// A u16 flag, then the block if the flag is 1.
impl<T: Fields + Default> Fields for Option<T> {
    fn read(&mut self, reader: &mut Reader<'_>) -> Result<(), WireError> {
        let at = reader.at();
        match reader.u16()? {
            0 => {
                *self = None;
                Ok(())
            }
            1 => self.get_or_insert_default().read(reader),
            other => Err(WireError { expected: "a flag, 0 or 1", found: Found::Value(other.into()), at }),
        }
    }

    fn write(&self, writer: &mut Writer<'_>) {
        writer.u16(u16::from(self.is_some()));
        if let Some(block) = self {
            block.write(writer);
        }
    }

    fn visit(&self, visitor: &mut dyn Visitor) {
        match self {
            Some(block) => block.visit(visitor),
            None => visitor.value(Value::Absent),
        }
    }
}

/// A u16 count, then the items.
impl<T: Fields + Default> Fields for Vec<T> {
    fn read(&mut self, reader: &mut Reader<'_>) -> Result<(), WireError> {
        let count = usize::from(reader.u16()?);
        self.truncate(count);
        for index in 0..count {
            // Every item takes at least a byte, so a false count ends in an error before it costs memory.
            if self.len() == index {
                self.push(T::default());
            }
            if let Some(item) = self.get_mut(index) {
                item.read(reader)?;
            }
        }
        Ok(())
    }

    fn write(&self, writer: &mut Writer<'_>) {
        let items = self.get(..usize::from(u16::MAX)).unwrap_or(self);
        writer.u16(items.len() as u16);
        items.iter().for_each(|item| item.write(writer));
    }

    fn visit(&self, visitor: &mut dyn Visitor) {
        visitor.begin(Group::List);
        self.iter().for_each(|item| item.visit(visitor));
        visitor.end();
    }
}

/// A text led by its length, u16 in binary.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FlexString(pub String);

/// A text led by its length, u8 in binary: name and comment in a scan telegram (LMS4000 manual; not verified on LMS1xx/5xx).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ShortString(pub String);

/// Device texts are Latin-1 at most; one byte is one character on both sides.
fn read_text(text: &mut String, len: usize, reader: &mut Reader<'_>) -> Result<(), WireError> {
    text.clear();
    text.extend(reader.text(len)?.iter().copied().map(char::from));
    Ok(())
}

/// Characters that one byte cannot hold, and STX and ETX, which would end a text frame, become `?`.
fn write_text(text: &str, max: usize, writer: &mut Writer<'_>, length: impl Fn(&mut Writer<'_>, usize)) {
    let byte = |c: char| u8::try_from(u32::from(c)).ok().filter(|b| !matches!(b, 2 | 3)).unwrap_or(b'?');
    let bytes: Vec<u8> = text.chars().take(max).map(byte).collect();
    length(writer, bytes.len());
    writer.text(&bytes);
}

impl Fields for FlexString {
    fn read(&mut self, reader: &mut Reader<'_>) -> Result<(), WireError> {
        let len = usize::from(reader.u16()?);
        read_text(&mut self.0, len, reader)
    }

    fn write(&self, writer: &mut Writer<'_>) {
        write_text(&self.0, usize::from(u16::MAX), writer, |writer, len| writer.u16(len as u16));
    }

    fn visit(&self, visitor: &mut dyn Visitor) {
        visitor.value(Value::Text(&self.0));
    }
}

impl Fields for ShortString {
    fn read(&mut self, reader: &mut Reader<'_>) -> Result<(), WireError> {
        let len = usize::from(reader.u8()?);
        read_text(&mut self.0, len, reader)
    }

    fn write(&self, writer: &mut Writer<'_>) {
        write_text(&self.0, usize::from(u8::MAX), writer, |writer, len| writer.u8(len as u8));
    }

    fn visit(&self, visitor: &mut dyn Visitor) {
        visitor.value(Value::Text(&self.0));
    }
}

macro_rules! text_conversions {
    ($($name:ident)*) => {$(
        impl From<&str> for $name {
            fn from(text: &str) -> Self {
                Self(text.into())
            }
        }

        impl core::ops::Deref for $name {
            type Target = str;

            fn deref(&self) -> &str {
                &self.0
            }
        }
    )*};
}
text_conversions! { FlexString ShortString }

/// A text of fixed length without a length field; shorter texts are padded with NUL.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct FixedText<const N: usize>(pub [u8; N]);

impl<const N: usize> FixedText<N> {
    /// The text without padding.
    pub fn as_bytes(&self) -> &[u8] {
        let end = self.0.iter().rposition(|&b| b != 0).map_or(0, |last| last + 1);
        self.0.get(..end).unwrap_or_default()
    }
}

impl<const N: usize> Default for FixedText<N> {
    fn default() -> Self {
        Self([0; N])
    }
}

impl<const N: usize> fmt::Display for FixedText<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.as_bytes().escape_ascii())
    }
}

impl<const N: usize> fmt::Debug for FixedText<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "\"{self}\"")
    }
}

impl<const N: usize> Fields for FixedText<N> {
    fn read(&mut self, reader: &mut Reader<'_>) -> Result<(), WireError> {
        let text = reader.fixed(N)?;
        self.0 = [0; N];
        self.0.iter_mut().zip(text).for_each(|(to, from)| *to = *from);
        Ok(())
    }

    fn write(&self, writer: &mut Writer<'_>) {
        match writer.dialect() {
            Dialect::A => {
                // A blank would end the token, STX or ETX the frame.
                let safe = self.0.map(|b| if matches!(b, 2 | 3 | b' ') { b'?' } else { b });
                match Self(safe).as_bytes() {
                    // No text is no token, and what follows would move up.
                    [] => writer.fixed(b"?"),
                    text => writer.fixed(text),
                }
            }
            Dialect::B => writer.fixed(&self.0),
        }
    }

    fn visit(&self, visitor: &mut dyn Visitor) {
        visitor.value(Value::Text(&format!("{self}")));
    }
}

/// A body this crate does not take apart, as the wire has it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Opaque(pub Vec<u8>);

impl Fields for Opaque {
    fn read(&mut self, reader: &mut Reader<'_>) -> Result<(), WireError> {
        let rest = reader.rest();
        self.0.clear();
        self.0.extend_from_slice(reader.take(rest.len(), "a body")?);
        Ok(())
    }

    fn write(&self, writer: &mut Writer<'_>) {
        if !self.0.is_empty() {
            writer.fixed(&self.0);
        }
    }

    fn visit(&self, visitor: &mut dyn Visitor) {
        visitor.value(Value::Opaque(&self.0));
    }
}

/// A 16-bit mask of two bytes, low byte first, which are two tokens in text.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LowHigh(pub u16);

impl Fields for LowHigh {
    fn read(&mut self, reader: &mut Reader<'_>) -> Result<(), WireError> {
        self.0 = u16::from_le_bytes([reader.u8()?, reader.u8()?]);
        Ok(())
    }

    fn write(&self, writer: &mut Writer<'_>) {
        self.0.to_le_bytes().write(writer);
    }

    fn visit(&self, visitor: &mut dyn Visitor) {
        visitor.value(Value::Integer(self.0.into()));
    }
}
