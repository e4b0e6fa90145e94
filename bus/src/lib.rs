//! The machine's CAN bus: one frame type, ports that carry it, and the J1939 nodes that speak on it.
//!
//! A [`Bus`] joins ports as a cable does: what a node sends goes out at every port, what comes in at one goes to the node and out at the
//! others. Ports know frames and nothing of J1939 ([`link`]); the node knows J1939 and nothing of ports ([`node`]); what a message
//! holds stands once, in [`pgn`], from which encoding, decoding, the DBC file and the documents are made.

mod address;
pub mod canopy;
pub mod control_function;
#[cfg(feature = "read-dbc")]
pub mod database;
mod datagrams;
mod dbc;
pub mod error_frame;
mod fast_packet;
pub mod field;
pub mod frame;
pub mod isobus;
mod join;
pub mod link;
pub mod message;
pub mod name;
mod news;
pub mod nmea;
pub mod node;
pub mod pgn;
mod port_event;
pub mod sensors;
pub mod tractor;
pub mod transport;
pub mod troubles;

pub use address::{BusAddress, BusAddressError};
pub use datagrams::{Datagrams, Passage};
pub use dbc::{dbc, load, markdown};
pub use error_frame::ErrorFrame;
pub use frame::{CanFrame, CanId, J1939Id};
pub use join::{Bus, Inbox, Stamped};
pub use link::BusError;
pub use news::{BusNews, BusWatch};
pub use port_event::{BusLoss, Origin, PortEvent, Refused};
