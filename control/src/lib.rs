//! A running bench in others' hands: faults, time, log and state over HTTP, or by lines on standard input.
//!
//! | part | is |
//! |---|---|
//! | [`Bench`] | what is controlled: faults, time, log, state |
//! | [`Time`] | a clock that can be stopped; a rig's ([`RigControl`](rowscan_emulator::RigControl)) is one |
//! | [`router`] | the routes, to be merged with others (a page, a WebSocket) |
//! | [`Server`] | serves routes at an address: bounded, guarded |
//! | [`Lines`] | the same routes by lines of text |
//!
//! No call waits for a link: faults are a plan behind a lock that is held for no I/O, time is told what it shall do and answers when it can.

mod bench;
mod clock;
mod fault_table;
mod guard;
mod json;
mod lines;
mod log;
mod problem;
mod request;
mod rig_time;
mod routes;
mod server;
mod time;
mod toxic_kinds;
mod toxics;
mod toxiproxy;

pub use bench::{Bench, StateOf};
pub use guard::Guard;
pub use json::Json;
pub use lines::{LineAnswer, Lines};
pub use log::Log;
pub use problem::Problem;
pub use routes::router;
pub use server::{Served, Server, ServerError};
pub use time::{Refused, Seeking, Time, TimeState, Wait};
