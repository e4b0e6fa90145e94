//! `SetAccessMode`: log in.

use super::Method;
use super::wire::{Fields, Reader, WireError, Writer, fields};
use crate::visit::Visitor;

fields! {
    /// User level and password.
    pub struct SetAccessMode {
        /// 1 run, 2 maintenance, 3 authorised client, 4 service.
        pub level: u8,
        /// Password.
        pub password: PasswordHash,
    }
}

impl Method for SetAccessMode {
    const NAME: &'static str = "SetAccessMode";
    type Reply = bool;
}

/// Hash of a password: always 8 hex digits in text.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PasswordHash(pub u32);

impl Fields for PasswordHash {
    fn read(&mut self, reader: &mut Reader<'_>) -> Result<(), WireError> {
        self.0 = reader.u32()?;
        Ok(())
    }

    fn write(&self, writer: &mut Writer<'_>) {
        writer.u32_padded(self.0);
    }

    fn visit(&self, visitor: &mut dyn Visitor) {
        self.0.visit(visitor);
    }
}
