//! Arrays of measured values: the bulk of every scan telegram, so both dialects have a fast path.

use alloc::vec::Vec;

use super::error::{Found, WireError};
use super::hex::plain_values;
use super::reader::Reader;
use super::word::Word;
use super::writer::Writer;
use crate::frame::Dialect;

/// The two hex digits of every byte.
static DIGITS: [[u8; 2]; 256] = {
    let mut table = [[0; 2]; 256];
    let mut byte = 0;
    while byte < 256 {
        table[byte] = [b"0123456789ABCDEF"[byte >> 4], b"0123456789ABCDEF"[byte & 0xF]];
        byte += 1;
    }
    table
};

impl Reader<'_> {
    /// A u16 count and that many values, into `values`, whose buffer is reused.
    pub fn counted<T: Word>(&mut self, values: &mut Vec<T>) -> Result<(), WireError> {
        let count = usize::from(self.u16()?);
        match self.dialect() {
            Dialect::B => {
                let bytes = self.take(count * T::BYTES, "as many values as the count says")?;
                values.clear();
                T::extend_from_be(values, bytes);
                Ok(())
            }
            Dialect::A => {
                // A value takes two characters at least: a false count cannot ask for more memory than the frame's own.
                if count * 2 > self.rest().len() {
                    return Err(self.error("as many values as the count says", Found::End));
                }
                values.resize(count, T::default());
                self.text_values(values)
            }
        }
    }

    /// Apart, so that the binary path stays small.
    #[inline(never)]
    fn text_values<T: Word>(&mut self, mut values: &mut [T]) -> Result<(), WireError> {
        loop {
            let (read, bytes) = plain_values(self.rest(), values);
            self.advance(bytes);
            values = values.get_mut(read..).unwrap_or_default();
            if read > 0 {
                continue;
            }
            // Signs, leading zeros, errors and the last tokens.
            let Some((value, others)) = values.split_first_mut() else { return Ok(()) };
            *value = T::from_low(if T::BYTES == 1 { self.number::<1>()? } else { self.number::<2>()? });
            values = others;
        }
    }
}

/// Appends a blank and the hex digits without leading zeros, for every value.
fn push_text_values<T: Word>(values: &[T], out: &mut Vec<u8>) {
    const MOST: usize = 5;
    let mut at = out.len();
    out.resize(at + values.len() * MOST, 0);
    for &value in values {
        let value: u16 = value.into();
        let [high, low] = value.to_be_bytes().map(|byte| DIGITS[usize::from(byte)]);
        let digits = (19 - (value | 1).leading_zeros()) / 4;
        let text = u32::from_be_bytes([high[0], high[1], low[0], low[1]]) << (32 - 8 * digits);
        let [a, b, c, d] = text.to_be_bytes();
        if let Some(slot) = out.get_mut(at..at + MOST) {
            slot.copy_from_slice(&[b' ', a, b, c, d]);
        }
        at += 1 + digits as usize;
    }
    out.truncate(at);
}

impl Writer<'_> {
    /// A u16 count and the values. No channel has more than 65535; what is beyond is left out.
    pub fn counted<T: Word>(&mut self, values: &[T]) {
        let values = values.get(..usize::from(u16::MAX)).unwrap_or(values);
        self.u16(values.len() as u16);
        let dialect = self.dialect();
        let out = self.raw();
        match dialect {
            Dialect::B => {
                out.reserve(values.len() * T::BYTES);
                T::extend_be(values, out);
            }
            Dialect::A => push_text_values(values, out),
        }
    }
}
