//! GNSS in NMEA 0183: sentences of a fix, and the lines they go out on.

mod line;
mod read;
pub mod sentence;
mod source;
mod voice;

pub use line::{NmeaAddress, NmeaAddressError, NmeaError, NmeaLine, NmeaPlace};
pub use read::SpeedReader;
pub use sentence::SENTENCES;
pub use source::{NmeaEar, NmeaSource, NmeaSourceError};
pub use voice::NmeaVoice;
