//! Writes telegrams in either dialect.

use alloc::vec::Vec;

use crate::frame::Dialect;
use crate::telegram::Kind;

/// Upper-case hex digits.
const DIGITS: &[u8; 16] = b"0123456789ABCDEF";

/// Writes one telegram's payload.
#[derive(Debug)]
pub struct Writer<'a> {
    dialect: Dialect,
    out: &'a mut Vec<u8>,
    /// In binary, one blank stands between the name and the first argument.
    blank_due: bool,
}

impl<'a> Writer<'a> {
    /// Begins a telegram: `kind`, and `name` unless it is empty (as in `sFA`). Arguments follow.
    pub fn begin(dialect: Dialect, kind: Kind, name: &str, out: &'a mut Vec<u8>) -> Self {
        out.extend_from_slice(kind.letters().as_bytes());
        if !name.is_empty() {
            out.push(b' ');
            out.extend_from_slice(name.as_bytes());
        }
        // Binary `sFA` has no blank before its code.
        Self { dialect, out, blank_due: dialect == Dialect::B && !name.is_empty() }
    }

    /// How numbers look.
    pub fn dialect(&self) -> Dialect {
        self.dialect
    }

    /// The blank binary replies without a value end in.
    pub fn trailing_blank(&mut self) {
        self.argument();
    }

    /// An 8-bit number.
    pub fn u8(&mut self, value: u8) {
        self.number::<1>(u32::from(value));
    }

    /// A 16-bit number.
    pub fn u16(&mut self, value: u16) {
        self.number::<2>(u32::from(value));
    }

    /// A 32-bit number.
    pub fn u32(&mut self, value: u32) {
        self.number::<4>(value);
    }

    /// A 32-bit number that text writes with all its digits.
    pub fn u32_padded(&mut self, value: u32) {
        match self.dialect {
            Dialect::B => self.u32(value),
            Dialect::A => {
                self.separate();
                for nibble in (0..8).rev() {
                    self.out.push(digit(value >> (4 * nibble)));
                }
            }
        }
    }

    /// Raw characters: a token of its own in text.
    pub fn fixed(&mut self, text: &[u8]) {
        self.separate();
        self.out.extend_from_slice(text);
    }

    /// Characters whose length has been written.
    pub fn text(&mut self, text: &[u8]) {
        if !text.is_empty() {
            self.fixed(text);
        }
    }

    pub(super) fn number<const BYTES: usize>(&mut self, value: u32) {
        self.separate();
        match self.dialect {
            Dialect::B => {
                self.out.extend_from_slice(value.to_be_bytes().get(4 - BYTES..).unwrap_or_default());
            }
            Dialect::A => push_hex(self.out, value),
        }
    }

    /// Raw bytes of the dialect, for the array fast paths; separators included.
    pub(super) fn raw(&mut self) -> &mut Vec<u8> {
        self.argument();
        self.out
    }

    fn separate(&mut self) {
        match self.dialect {
            Dialect::A => self.out.push(b' '),
            Dialect::B => self.argument(),
        }
    }

    fn argument(&mut self) {
        if core::mem::take(&mut self.blank_due) {
            self.out.push(b' ');
        }
    }
}

fn digit(value: u32) -> u8 {
    DIGITS.get((value & 0xF) as usize).copied().unwrap_or(b'0')
}

/// Upper-case hex without leading zeros.
fn push_hex(out: &mut Vec<u8>, value: u32) {
    let digits = (35 - (value | 1).leading_zeros()) / 4;
    for nibble in (0..digits).rev() {
        out.push(digit(value >> (4 * nibble)));
    }
}
