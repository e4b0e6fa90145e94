//! Recorded bytes: what went over the wire, in both directions, with the host's time.
//!
//! Ways through the crate:
//! - out: [`Tap`] (in a connection's byte path) → bounded queue → [`Recorder`]'s thread → [`McapWriter`] → file
//! - in: file → [`Recording`], which recognises by content what the file is and hands out [`Packet`]s in the order they came
//!
//! The crate knows files and telegrams. It knows no socket, no async runtime and no clock: whoever starts a [`Recorder`] hands it one.

pub mod can;
mod copy;
mod error;
mod foxglove;
mod frames;
mod info;
mod listener;
pub mod nmea;
mod packet;
mod read;
mod recorder;
mod tap;
mod writer;

pub use copy::{CopyError, copy};
pub use error::RecordError;
pub use frames::{FrameReader, RecordedFrame};
pub use info::{StreamReport, account};
pub use listener::Listener;
pub use packet::{Joint, Packet, Side, StreamKind};
pub use read::{Format, ReadError, Recording, StreamInfo, Torn};
pub use recorder::{Recorded, Recorder, RecorderOptions, WallClock};
pub use tap::{Tap, Taps};
pub use writer::{About, Decoded, McapWriter, StreamId};
