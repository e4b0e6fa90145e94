//! Compact: the binary telegrams of SICK's scanners since picoScan and multiScan, over UDP or TCP.
//!
//! All numbers are little-endian. A telegram is `02 02 02 02`, its type (u32), its fields and the CRC-32 of all bytes before it. One UDP datagram is
//! one telegram; over TCP and in files they follow each other ([`StreamDecoder`]).
//!
//! | type | is | read | source of the layout |
//! |---|---|---|---|
//! | 1 | [`ScanTelegram`]: a segment of a turn, of 1 or more modules | versions 3 and 4 | real telegrams of version 4; version 3 by SICK's public clients |
//! | 2 | [`Imu`] | version 1 | real telegrams of a multiScan136 |
//! | 4 | [`Encoder`] | version 1 | real telegrams of a picoScan150 |
//!
//! Ambient light (3) and the telegrams of a multiScan200 (6, 7) are refused by their number. A structure's fields are written down once; that
//! definition decodes, encodes and describes them.
//!
//! A driver reads scans from them: an [`Assembler`] puts segments together to turns ([`Frame`]), and a [`CompactListener`] is the session of a stream of them.
//!
//! ```
//! use rowscan_protocol::compact::{Imu, Telegram};
//! # fn main() -> Result<(), Box<dyn core::error::Error>> {
//! let imu = Imu { acceleration_m_s2: [0.0, 0.0, 9.81], orientation_wxyz: [1.0, 0.0, 0.0, 0.0], time_us: 1_000_000, ..Imu::default() };
//! let mut bytes = Vec::new();
//! Telegram::Imu(imu.clone()).encode(&mut bytes)?;
//! assert_eq!((bytes.len(), &bytes[60..]), (64, &[0x86, 0x26, 0xde, 0xc6][..]));
//! assert_eq!(Telegram::decode(&bytes)?, Telegram::Imu(imu));
//! # Ok(())
//! # }
//! ```

mod angle;
mod assembler;
mod beams;
mod crc;
mod encoder;
mod error;
mod frame;
mod imu;
mod length;
mod listener;
mod scan;
mod segment;
mod segment_counts;
mod senders;
mod shape;
mod stream;
mod telegram;
mod wheel;
mod wire;

pub use angle::{TO_COLA, theta_code, theta_rad};
pub use assembler::{Assembler, MAX_OPEN, REORDER};
pub use beams::{Beams, REFLECTOR};
pub use crc::crc32;
pub use encoder::{Encoder, PayloadLength};
pub use error::{CompactError, EncodeError, Expected};
pub use frame::Frame;
pub use imu::Imu;
pub use length::{MAX_TELEGRAM, length};
pub use listener::CompactListener;
pub use scan::{DistanceScale, Module, ModuleSize, Modules, ScanTelegram};
pub use segment::{Segment, SegmentLine};
pub use segment_counts::SegmentCounts;
pub use shape::{Content, MAX_BEAMS, MAX_ECHOES, MAX_LINES, MAX_MODULES, Shape, Version};
pub use stream::{Found, StreamDecoder, begins};
pub use telegram::Telegram;
pub use wire::{Always, PerLine};

/// What every telegram begins with.
pub const START: [u8; 4] = [0x02; 4];
/// Start and type.
const HEAD: usize = 8;
/// The CRC at the end.
const TAIL: usize = 4;
