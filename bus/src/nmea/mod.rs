//! GNSS in NMEA 0183: sentences of a fix, and the lines they go out on.

mod epochs;
mod line;
mod read;
pub mod sentence;
mod source;

pub use epochs::GnssEpochs;
pub use line::{NmeaAddress, NmeaAddressError, NmeaError, NmeaLine, NmeaPlace};
pub use read::SpeedReader;
pub use sentence::SENTENCES;
pub use source::{NmeaReceiver, NmeaSource, NmeaSourceError};
