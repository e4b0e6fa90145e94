//! What a SICK LMS scanner sends and what it means: frames, telegrams, scanner models and the sessions of both sides.
//!
//! The crate does no I/O, reads no clock and keeps no global state; it is `no_std` with `alloc`. Three layers are three types: a *frame* is
//! bytes that passed the checksum, a *telegram* is a command with typed fields, a [`scan::Scan`] is what one mirror turn means in SI units.
//!
//! # Example
//! A virtual LMS111 measures one mirror turn, and a client reads it:
//!
//! ```
//! use rowscan_protocol::device::{Device, Identity, MeasuredEcho, MeasuredLine, scan_event};
//! use rowscan_protocol::frame::{Accept, Dialect, FrameDecoder};
//! use rowscan_protocol::model;
//! use rowscan_protocol::scan::Scan;
//! use rowscan_protocol::telegram::{LmdScandata, Telegram};
//! use rowscan_protocol::time::SimTime;
//!
//! # fn main() -> Result<(), Box<dyn core::error::Error>> {
//! // The scanner's side: a line of ranges becomes a telegram, a telegram becomes bytes.
//! let mut device = Device::new(model::by_name("lms111").ok_or("no such model")?, Identity::default());
//! let grid = device.mirror().beams;
//! let echo = MeasuredEcho { range_mm: vec![2500; grid.len()], remission: vec![0; grid.len()] };
//! let line = MeasuredLine { grid, echoes: &[echo] };
//! let telegram = device.measure(SimTime::ZERO, &line).ok_or("it does not measure")?;
//! let mut bytes = Vec::new();
//! scan_event(Dialect::B, telegram, &mut bytes);
//!
//! // The client's side: bytes become a frame, a telegram, a scan in metres.
//! let mut decoder = FrameDecoder::new(Accept::Either, 64 * 1024);
//! decoder.push(&bytes);
//! let frame = decoder.next_frame().ok_or("no frame")?;
//! let telegram: LmdScandata = Telegram::parse(frame.dialect, frame.payload)?.args.decode()?;
//! let mut scan = Scan::default();
//! telegram.to_scan_into(&mut scan)?;
//! assert_eq!(scan.beams.len(), 541);
//! assert_eq!(scan.echoes[0].range_m[270], 2.5);
//! # Ok(())
//! # }
//! ```
//!
//! # Where to go on
//! - bytes to telegrams and back: `frame`, `telegram`, `visit`; the classic LMS2xx on a serial line: `lms2xx`; today's scanners over UDP: `compact`
//! - sessions without I/O: `client::ColaClient`, `device::Device`; over sockets and serial lines:
//!   [`rowscan-driver`](https://docs.rs/rowscan-driver), [`rowscan-emulator`](https://docs.rs/rowscan-emulator)
//! - the examples `parse_telegram`, `cola_a_and_b`, `lms2xx_frame` and `session_without_io`; `tests/it/examples.rs` runs them
//!
//! # Features
//! - `telegrams` (default): frames, telegrams, scanner models, sessions. Without it only the meaning is left ([`scan`], [`angle`], [`optics`], [`random`], [`rig`],
//!   [`time`], [`calendar`], [`counting`], [`validity`]): all that canopy estimators and scene simulators need to know of a scanner.
//! - `serde`: rigs and the types in them are read and written with serde.
//! - `schema`: JSON Schema of the rig's tables.
#![no_std]

extern crate alloc;
#[cfg(test)]
extern crate std;

pub mod angle;
pub mod calendar;
pub mod counting;
pub mod echo;
pub mod optics;
pub mod plural;
pub mod random;
pub mod rig;
pub mod scan;
pub mod time;
mod uptime;
pub mod validity;
mod window;

#[cfg(feature = "telegrams")]
pub mod can;
#[cfg(feature = "telegrams")]
pub mod challenge;
#[cfg(feature = "telegrams")]
pub mod client;
#[cfg(feature = "telegrams")]
pub mod compact;
#[cfg(feature = "telegrams")]
pub mod device;
#[cfg(feature = "telegrams")]
pub mod frame;
#[cfg(feature = "telegrams")]
pub mod heard_settings;
#[cfg(feature = "telegrams")]
pub mod host;
#[cfg(feature = "telegrams")]
pub mod leftover;
pub mod leftover_set;
#[cfg(feature = "telegrams")]
pub mod lms2xx;
#[cfg(feature = "telegrams")]
pub mod model;
#[cfg(feature = "telegrams")]
pub mod nmea;
#[cfg(feature = "telegrams")]
pub mod reading;
#[cfg(feature = "telegrams")]
pub mod rfc2217;
#[cfg(feature = "telegrams")]
pub mod search;
#[cfg(feature = "telegrams")]
pub mod telegram;
#[cfg(feature = "telegrams")]
pub mod visit;
