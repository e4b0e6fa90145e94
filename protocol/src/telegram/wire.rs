//! The wire form of fields: one definition serves both dialects and both directions.
//!
//! A type that implements [`Fields`] names its parts once, in wire order; [`Reader`] and [`Writer`] know how a number looks in
//! either dialect. Structs whose fields simply follow each other are declared with the `fields!` macro.
//!
//! Text (CoLa A): tokens separated by one blank. Devices print upper-case hex without leading zeros and negative
//! numbers as two's complement of the field's full width. Hosts may also send `+123` and `-123` (decimal), lower
//! case and leading zeros. Strings are `<length in hex> <characters>`. Floats are the 8 hex digits of their bits.
//! Binary (CoLa B): big-endian.

mod array;
mod error;
mod fields;
mod hex;
mod reader;
mod word;
mod writer;

pub use error::{Excerpt, Found, WireError};
pub use fields::{Fields, FixedText, FlexString, LowHigh, Opaque, ShortString};
pub(crate) use fields::{fields, unit};
pub use reader::Reader;
pub use word::Word;
pub use writer::Writer;
