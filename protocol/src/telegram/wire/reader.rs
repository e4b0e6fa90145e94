//! Reads fields in either dialect.

use super::error::{Excerpt, Found, WireError};
use crate::frame::Dialect;

/// Reads a telegram's arguments, front to back.
#[derive(Clone, Debug)]
pub struct Reader<'a> {
    dialect: Dialect,
    bytes: &'a [u8],
    at: usize,
}

/// An unsigned number of up to 32 bits, by its width on the wire.
const WIDTH_ERROR: [&str; 5] =
    ["nothing", "an 8-bit number", "a 16-bit number", "a 24-bit number", "a 32-bit number"];

impl<'a> Reader<'a> {
    /// A reader over a telegram's arguments (what follows the blank after the name).
    pub fn new(dialect: Dialect, arguments: &'a [u8]) -> Self {
        Self { dialect, bytes: arguments, at: 0 }
    }

    /// How numbers look.
    pub fn dialect(&self) -> Dialect {
        self.dialect
    }

    /// Bytes not read yet.
    pub fn rest(&self) -> &'a [u8] {
        self.bytes.get(self.at..).unwrap_or_default()
    }

    /// Checks that nothing follows. Text may end in a blank.
    pub fn end(&self) -> Result<(), WireError> {
        match (self.dialect, self.rest()) {
            (_, []) | (Dialect::A, [b' ']) => Ok(()),
            (_, rest) => Err(self.error("the end", Found::Extra(rest.len()))),
        }
    }

    /// An 8-bit number.
    #[inline]
    pub fn u8(&mut self) -> Result<u8, WireError> {
        self.number::<1>().map(|value| value as u8)
    }

    /// A 16-bit number.
    #[inline]
    pub fn u16(&mut self) -> Result<u16, WireError> {
        self.number::<2>().map(|value| value as u16)
    }

    /// A 32-bit number.
    #[inline]
    pub fn u32(&mut self) -> Result<u32, WireError> {
        self.number::<4>()
    }

    /// A 32-bit float. Devices write its bits as 8 hex digits; hosts may also write a decimal number: one with a sign, with a
    /// point, or shorter than that.
    pub fn real(&mut self) -> Result<f32, WireError> {
        if self.dialect == Dialect::B {
            return self.u32().map(f32::from_bits);
        }
        let mut ahead = self.clone();
        let token = ahead.token("a float")?;
        let is_decimal = token.len() < 8 || token.iter().any(|b| matches!(b, b'+' | b'-' | b'.'));
        if !is_decimal {
            return self.u32().map(f32::from_bits);
        }
        let at = ahead.at - token.len();
        // Digits only: no "inf", no "nan", no exponent.
        let plain = token.iter().all(|b| matches!(b, b'0'..=b'9' | b'+' | b'-' | b'.'));
        let value = core::str::from_utf8(token).ok().filter(|_| plain).and_then(|text| text.parse().ok());
        self.at = ahead.at;
        value.ok_or_else(|| WireError { expected: "a float", found: Found::Text(Excerpt::of(token)), at })
    }

    /// `len` raw characters: a token of its own in text, which may be shorter there.
    pub fn fixed(&mut self, len: usize) -> Result<&'a [u8], WireError> {
        match self.dialect {
            Dialect::B => self.take(len, "a text"),
            Dialect::A => {
                let at = self.at;
                let token = self.token("a text")?;
                if token.len() > len {
                    return Err(WireError {
                        expected: "a text",
                        found: Found::TooLarge(Excerpt::of(token)),
                        at,
                    });
                }
                Ok(token)
            }
        }
    }

    /// `len` characters whose length has been read.
    pub fn text(&mut self, len: usize) -> Result<&'a [u8], WireError> {
        if self.dialect == Dialect::A && len > 0 {
            self.separator();
        }
        self.take(len, "a text")
    }

    pub(super) fn at(&self) -> usize {
        self.at
    }

    pub(super) fn advance(&mut self, bytes: usize) {
        self.at += bytes;
    }

    pub(super) fn error(&self, expected: &'static str, found: Found) -> WireError {
        WireError { expected, found, at: self.at }
    }

    pub(super) fn take(&mut self, len: usize, expected: &'static str) -> Result<&'a [u8], WireError> {
        let taken = self.rest().get(..len).ok_or_else(|| self.error(expected, Found::End))?;
        self.at += len;
        Ok(taken)
    }

    /// A number that takes `BYTES` bytes in binary.
    #[inline]
    pub(super) fn number<const BYTES: usize>(&mut self) -> Result<u32, WireError> {
        let expected = WIDTH_ERROR.get(BYTES).copied().unwrap_or("a number");
        match self.dialect {
            Dialect::B => {
                let bytes =
                    self.rest().first_chunk::<BYTES>().ok_or_else(|| self.error(expected, Found::End))?;
                self.at += BYTES;
                Ok(bytes.iter().fold(0, |value, byte| value << 8 | u32::from(*byte)))
            }
            Dialect::A => self.text_number(BYTES, expected),
        }
    }

    #[inline(never)]
    fn text_number(&mut self, bytes: usize, expected: &'static str) -> Result<u32, WireError> {
        let token = self.token(expected)?;
        let at = self.at - token.len();
        parse(token, bytes).map_err(|found| WireError { expected, found, at })
    }

    fn separator(&mut self) {
        // The blank before the first token belongs to the telegram's name.
        if self.at > 0 && self.rest().first() == Some(&b' ') {
            self.at += 1;
        }
    }

    fn token(&mut self, expected: &'static str) -> Result<&'a [u8], WireError> {
        self.separator();
        let rest = self.rest();
        let len = rest.iter().position(|&b| b == b' ').unwrap_or(rest.len());
        match rest.get(..len) {
            Some(token) if len > 0 => {
                self.at += len;
                Ok(token)
            }
            _ => Err(self.error(expected, Found::End)),
        }
    }
}

/// A text number into two's complement of `bytes` bytes.
fn parse(token: &[u8], bytes: usize) -> Result<u32, Found> {
    let bits = bytes as u32 * 8;
    let value = match token {
        [b'+', digits @ ..] => magnitude::<10>(digits, bits),
        [b'-', digits @ ..] => magnitude::<10>(digits, bits).and_then(|value| match value {
            0 => Ok(0),
            _ if value > 1 << (bits - 1) => Err(Found::TooLarge as Fault),
            _ => Ok((1 << bits) - value),
        }),
        digits => magnitude::<16>(digits, bits),
    };
    value.map(|value| value as u32).map_err(|fault| fault(Excerpt::of(token)))
}

/// What is wrong with a token.
type Fault = fn(Excerpt) -> Found;

/// A number without a sign, of at most `bits` bits.
fn magnitude<const RADIX: u32>(digits: &[u8], bits: u32) -> Result<u64, Fault> {
    if digits.is_empty() {
        return Err(Found::Text);
    }
    let mut value = 0u64;
    for &digit in digits {
        let digit = char::from(digit).to_digit(RADIX).ok_or(Found::Text as Fault)?;
        value = value * u64::from(RADIX) + u64::from(digit);
        if value >> bits != 0 {
            return Err(Found::TooLarge);
        }
    }
    Ok(value)
}
