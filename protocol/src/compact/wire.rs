//! The wire form of Compact's fields: one definition decodes, encodes and describes.

use alloc::vec::Vec;

use super::error::{CompactError, Expected};
use super::shape::{Content, Shape, Version};
use crate::visit::{Group, Value, Visitor};

/// What fields further on in a telegram are shaped by.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Context {
    pub(super) version: Version,
    pub(super) shape: Shape,
    pub(super) content: Content,
    /// Bytes of the next module; 0 where there is none.
    pub(super) next_module: u32,
}

/// Reads fields front to back.
#[derive(Debug)]
pub(super) struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    pub(super) context: Context,
}

impl<'a> Reader<'a> {
    pub(super) fn new(bytes: &'a [u8], at: usize) -> Self {
        Self { bytes, at, context: Context::default() }
    }

    /// Offset of the next byte.
    pub(super) fn at(&self) -> usize {
        self.at
    }

    /// Bytes not read yet.
    pub(super) fn left(&self) -> usize {
        self.bytes.len().saturating_sub(self.at)
    }

    /// Checks that so many bytes follow, before memory is asked for them.
    pub(super) fn needs(&self, bytes: u64) -> Result<(), CompactError> {
        let left = self.left() as u64;
        if left < bytes {
            return Err(CompactError { expected: Expected::Bytes(bytes), found: left, at: self.at });
        }
        Ok(())
    }

    pub(super) fn take<const N: usize>(&mut self) -> Result<[u8; N], CompactError> {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        let Some(taken) = rest.first_chunk::<N>() else {
            let (expected, found) = (Expected::Bytes(N as u64), rest.len() as u64);
            return Err(CompactError { expected, found, at: self.at });
        };
        self.at += N;
        Ok(*taken)
    }
}

/// Writes fields front to back.
#[derive(Debug)]
pub(super) struct Writer<'a> {
    pub(super) out: &'a mut Vec<u8>,
    pub(super) context: Context,
}

/// A wire form for both directions.
pub(super) trait Fields {
    fn read(&mut self, reader: &mut Reader<'_>) -> Result<(), CompactError>;
    fn write(&self, writer: &mut Writer<'_>);
    fn visit(&self, visitor: &mut dyn Visitor);
}

/// Declares structs whose fields follow each other on the wire in the order written, with their units.
macro_rules! layout {
    ($($(#[$meta:meta])* pub struct $name:ident { $($(#[$field_meta:meta])* pub $field:ident: $type:ty $([$unit:literal])?,)* })*) => {$(
        $(#[$meta])*
        #[derive(Clone, Debug, PartialEq)]
        pub struct $name { $($(#[$field_meta])* pub $field: $type,)* }

        impl $crate::compact::wire::Fields for $name {
            fn read(
                &mut self,
                reader: &mut $crate::compact::wire::Reader<'_>,
            ) -> Result<(), $crate::compact::CompactError> {
                $($crate::compact::wire::Fields::read(&mut self.$field, reader)?;)*
                Ok(())
            }

            fn write(&self, writer: &mut $crate::compact::wire::Writer<'_>) {
                $($crate::compact::wire::Fields::write(&self.$field, writer);)*
            }

            fn visit(&self, visitor: &mut dyn $crate::visit::Visitor) {
                visitor.begin($crate::visit::Group::Struct);
                $(
                    visitor.field(stringify!($field), $crate::telegram::wire::unit!($($unit)?));
                    $crate::compact::wire::Fields::visit(&self.$field, visitor);
                )*
                visitor.end();
            }
        }
    )*};
}
pub(super) use layout;

macro_rules! numbers {
    ($($type:ty: $value:expr;)*) => {$(
        impl Fields for $type {
            fn read(&mut self, reader: &mut Reader<'_>) -> Result<(), CompactError> {
                *self = Self::from_le_bytes(reader.take()?);
                Ok(())
            }

            fn write(&self, writer: &mut Writer<'_>) {
                writer.out.extend_from_slice(&self.to_le_bytes());
            }

            fn visit(&self, visitor: &mut dyn Visitor) {
                let value: fn($type) -> Value<'static> = $value;
                visitor.value(value(*self));
            }
        }
    )*};
}
numbers! {
    u8: |number| Value::Integer(number.into());
    u16: |number| Value::Integer(number.into());
    u32: |number| Value::Integer(number.into());
    u64: Value::Unsigned;
    f32: Value::Real;
}

impl<T: Fields, const N: usize> Fields for [T; N] {
    fn read(&mut self, reader: &mut Reader<'_>) -> Result<(), CompactError> {
        self.iter_mut().try_for_each(|item| item.read(reader))
    }

    fn write(&self, writer: &mut Writer<'_>) {
        self.iter().for_each(|item| item.write(writer));
    }

    fn visit(&self, visitor: &mut dyn Visitor) {
        list(self, visitor);
    }
}

/// Visits a list.
pub(super) fn list<T: Fields>(items: &[T], visitor: &mut dyn Visitor) {
    visitor.begin(Group::List);
    items.iter().for_each(|item| item.visit(visitor));
    visitor.end();
}

/// A number that has one value only.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Always<const N: u32>;

impl<const N: u32> Fields for Always<N> {
    fn read(&mut self, reader: &mut Reader<'_>) -> Result<(), CompactError> {
        let at = reader.at();
        let mut found = 0_u32;
        found.read(reader)?;
        if found != N {
            return Err(CompactError { expected: Expected::Number(N), found: found.into(), at });
        }
        Ok(())
    }

    fn write(&self, writer: &mut Writer<'_>) {
        N.write(writer);
    }

    fn visit(&self, visitor: &mut dyn Visitor) {
        N.visit(visitor);
    }
}

/// One value a line of the module.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PerLine<T>(pub Vec<T>);

impl<T: Fields + Default> Fields for PerLine<T> {
    fn read(&mut self, reader: &mut Reader<'_>) -> Result<(), CompactError> {
        self.0.clear();
        // The shape was held to its bounds when it was read.
        for _ in 0..reader.context.shape.lines {
            let mut item = T::default();
            item.read(reader)?;
            self.0.push(item);
        }
        Ok(())
    }

    fn write(&self, writer: &mut Writer<'_>) {
        self.0.iter().for_each(|item| item.write(writer));
    }

    fn visit(&self, visitor: &mut dyn Visitor) {
        list(&self.0, visitor);
    }
}
