//! Values of a channel: 8 or 16 bits wide.

use alloc::vec::Vec;

use byteorder::{BigEndian, ByteOrder};

/// A channel's raw value: 8 or 16 bits wide.
pub trait Word: Copy + Default + Into<u16> + sealed::Sealed {
    /// Bytes on the wire.
    const BYTES: usize;

    /// From the low bits of a number that is known to fit.
    fn from_low(value: u32) -> Self;
    /// Appends big-endian bytes as values.
    fn extend_from_be(out: &mut Vec<Self>, bytes: &[u8]);
    /// Appends values as big-endian bytes.
    fn extend_be(values: &[Self], out: &mut Vec<u8>);
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for u8 {}
    impl Sealed for u16 {}
}

impl Word for u8 {
    const BYTES: usize = 1;

    fn from_low(value: u32) -> Self {
        value as Self
    }

    fn extend_from_be(out: &mut Vec<Self>, bytes: &[u8]) {
        out.extend_from_slice(bytes);
    }

    fn extend_be(values: &[Self], out: &mut Vec<u8>) {
        out.extend_from_slice(values);
    }
}

impl Word for u16 {
    const BYTES: usize = 2;

    fn from_low(value: u32) -> Self {
        value as Self
    }

    fn extend_from_be(out: &mut Vec<Self>, bytes: &[u8]) {
        let (pairs, _) = bytes.as_chunks::<2>();
        let at = out.len();
        out.resize(at + pairs.len(), 0);
        BigEndian::read_u16_into(pairs.as_flattened(), &mut out[at..]);
    }

    fn extend_be(values: &[Self], out: &mut Vec<u8>) {
        let at = out.len();
        out.resize(at + 2 * values.len(), 0);
        BigEndian::write_u16_into(values, &mut out[at..]);
    }
}
