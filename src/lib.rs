//! A virtual SICK LMS laser scanner in a virtual orchard, driven past at tractor speed; and the command line over it, its driver and
//! its canopy estimator.
//!
//! Ways through the house:
//! - out: orchard → caster → optics → scan line → device → telegram → frame → transport ([`emulator`])
//! - in: transport → frame → telegram → client session → scan → canopy → output (`rowscan_driver`, `rowscan_canopy`)
//!
//! The two meet in tests and in the demo's last table only.

pub mod appraisal;
mod backlog;
pub mod bus;
pub mod cli;
pub mod clock;
pub mod comparison;
pub mod config;
pub mod decode;
pub mod emulator;
pub mod export;
pub mod line;
pub mod nmea;
pub mod offline;
pub mod replay;
pub mod stage;
pub mod study;
pub mod trial;
