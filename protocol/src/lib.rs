//! What a SICK LMS scanner says, and what it means: frames, telegrams, scanner models and both sides' sessions.
//!
//! The crate does no I/O, reads no clock and keeps no global state. Three layers, three types:
//! a *frame* is bytes that passed the checksum, a *telegram* is a command with typed fields, a [`scan::Scan`] is
//! what one mirror turn means in SI units.
//!
//! Without the default feature `telegrams` only the meaning is left ([`scan`], [`angle`], [`rig`], [`time`]): all that
//! canopy estimators and scene simulators need to know of a scanner.
#![no_std]

extern crate alloc;
#[cfg(test)]
extern crate std;

pub mod angle;
pub mod rig;
pub mod scan;
pub mod time;

#[cfg(feature = "telegrams")]
pub mod can;
#[cfg(feature = "telegrams")]
pub mod client;
#[cfg(feature = "telegrams")]
pub mod device;
#[cfg(feature = "telegrams")]
pub mod frame;
#[cfg(feature = "telegrams")]
pub mod host;
#[cfg(feature = "telegrams")]
pub mod lms2xx;
#[cfg(feature = "telegrams")]
pub mod model;
#[cfg(feature = "telegrams")]
pub mod nmea;
#[cfg(feature = "telegrams")]
pub mod rfc2217;
#[cfg(feature = "telegrams")]
pub mod telegram;
