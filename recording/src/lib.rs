//! Recorded bytes: what went over the wire, in both directions, with the host's time.
//!
//! Two ways through the crate:
//! - out: [`Tap`] (in a connection's byte path) → bounded queue → [`Recorder`]'s thread → [`McapWriter`] → file
//! - in: file → [`Recording`], which recognises by content what the file is and hands out [`Packet`]s in the order they came
//!
//! ```
//! use rowscan_recording::{Format, Recording};
//!
//! # fn main() -> Result<(), rowscan_recording::ReadError> {
//! // A file works the same: `Recording::open(path)`.
//! let mut recording = Recording::read(Box::new(&b"02 73 52 4E 20 44 65 76 69 63 65 49 64 65 6E 74 03 ; sRN DeviceIdent"[..]))?;
//! assert_eq!(recording.format(), Format::Hex);
//! while let Some(packet) = recording.next_packet()? {
//!     println!("{} bytes from {:?}", packet.bytes.len(), packet.from);
//! }
//! # Ok(())
//! # }
//! ```
//!
//! Scans instead of bytes: [`ScanReader`], or [`rowscan-driver`](https://docs.rs/rowscan-driver), for which a recording is a source like a live
//! scanner. [`McapWriter`] writes what [`rowscan-emulator`](https://docs.rs/rowscan-emulator) replays.
//!
//! The crate knows files and telegrams. It knows no socket, no async runtime and no clock: whoever starts a [`Recorder`] hands it one.
//!
//! Without the default feature `files` only [`Tap`], [`Taps`], [`Side`], [`StreamKind`] and [`Packet`] are left, and no dependency but
//! `rowscan-protocol`.

#[cfg(feature = "files")]
mod choice;
#[cfg(feature = "files")]
mod contents;
#[cfg(feature = "files")]
mod copy;
#[cfg(feature = "files")]
mod describer;
#[cfg(feature = "files")]
mod device_settings;
#[cfg(feature = "files")]
mod drive;
#[cfg(feature = "files")]
mod error;
#[cfg(feature = "files")]
mod finder;
#[cfg(feature = "files")]
mod fix;
#[cfg(feature = "files")]
pub mod foxglove;
#[cfg(feature = "files")]
mod frames;
#[cfg(feature = "files")]
mod info;
#[cfg(feature = "files")]
mod mcap_damage;
#[cfg(feature = "files")]
mod mcap_record;
#[cfg(feature = "files")]
mod mcap_records;
mod packet;
#[cfg(feature = "files")]
mod queue;
#[cfg(feature = "files")]
mod read;
#[cfg(feature = "files")]
mod read_some;
#[cfg(feature = "files")]
mod recorder;
#[cfg(feature = "files")]
mod repair;
#[cfg(feature = "files")]
mod ros2;
#[cfg(feature = "files")]
mod ros2_names;
#[cfg(feature = "files")]
mod scan_reader;
#[cfg(feature = "files")]
mod schema;
mod tap;
mod wall_clock;
#[cfg(feature = "files")]
mod writer;

#[cfg(feature = "files")]
pub use choice::streams_with_scans;
#[cfg(feature = "files")]
pub use contents::contents;
#[cfg(feature = "files")]
pub use copy::{Copied, CopyError, copy};
#[cfg(feature = "files")]
pub use describer::Describer;
#[cfg(feature = "files")]
pub use device_settings::{DATAGRAMS, DeviceSettings, device_of};
#[cfg(feature = "files")]
pub use drive::Drive;
#[cfg(feature = "files")]
pub use error::RecordError;
#[cfg(feature = "files")]
pub use fix::{FixReader, Gga};
#[cfg(feature = "files")]
pub use frames::{FrameReader, RecordedFrame};
#[cfg(feature = "files")]
pub use info::{MAX_DRIFT_ERROR_PPM, StreamReport, account};
pub use packet::{Joint, Packet, Side, StreamKind};
#[cfg(feature = "files")]
pub use read::{
    BrokenArchive, ClockBack, Format, MissingBytes, ReadError, Recording, Resumed, Soundness, StreamInfo,
    Torn,
};
#[cfg(feature = "files")]
pub use recorder::{Recorded, Recorder, RecorderOptions};
#[cfg(feature = "files")]
pub use repair::{Repaired, repair};
#[cfg(feature = "files")]
pub use scan_reader::{MAX_PAYLOAD, ScanReader};
pub use tap::{Tap, Taps};
pub use wall_clock::WallClock;
#[cfg(feature = "files")]
pub use writer::{About, Decoded, McapWriter, StreamId, WriteSeek};
