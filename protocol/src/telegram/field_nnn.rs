//! `field000`, `field001`, …: the evaluation fields' shapes, one variable a slot. A used slot's body is not taken apart.

use super::wire::{Opaque, fields};

fields! {
    /// One slot.
    pub struct Field {
        /// The body; [`unused`](Self::unused) is one byte.
        pub body: Opaque,
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
