//! A whole virtual rig from one description: scanners, CAN, GNSS, faults and time on one clock, with handles to all of it.
//!
//! A [`BenchSpec`] says what the rig is made of; [`Bench::open`] sets it up; [`Bench::run`] lets time go. The commands of `rowscan`, its scenarios and its
//! Python package are callers of this crate, and so is a test of your own controller:
//!
//! ```no_run
#![doc = include_str!("../examples/your_rig.rs")]
//! ```
//!
//! [`replay`] does the same with a recording in the place of the orchard.
//!
//! A new kind of endpoint is a variant of [`Endpoint`] and its arm in `endpoint.rs`; a new family of scanners an arm in `scanner.rs`.

mod bench;
mod directed;
mod endpoint;
mod error;
pub mod replay;
mod scanner;
mod spec;

pub use bench::Bench;
pub use directed::{Directed, Undirected};
pub use endpoint::{At, Endpoint, Place};
pub use error::BenchError;
pub use scanner::BenchScanner;
pub use spec::{BenchSpec, BusSpec, DeviceSpec, Ident, NmeaSpec, ScannerSpec, StartState, TimeSpec};
pub use {rowscan_emulator, rowscan_emulator::rowscan_protocol, rowscan_emulator::rowscan_scenes};
