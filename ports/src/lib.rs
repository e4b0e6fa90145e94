//! Serial ports, the device's end: what a client opens as its serial port, and what is written there and not out yet.

pub mod clock;
mod delivery;
pub mod in_flight;
mod keepalive;
pub mod latency;
mod link;
mod net;
#[cfg(target_os = "linux")]
mod occupancy;
mod port;
#[cfg_attr(not(target_os = "linux"), path = "pty_elsewhere.rs")]
mod pty;
mod tally;
mod task;
pub mod uart;
mod wire;

use std::io;
use std::path::PathBuf;

pub use delivery::{Delivered, Delivery};
pub use keepalive::{acknowledge_at_once, keep_alive, keep_near};
pub use link::LinkError;
pub use net::NetLine;
pub use port::Port;
pub use pty::{Pty, Untaken};
pub use tally::Tally;
pub use task::{Task, task};
pub use wire::Wire;

/// Why a line could not be opened.
#[derive(Debug, thiserror::Error)]
pub enum PortError {
    /// The system gave no pseudo-terminal.
    #[error(
        "cannot make a pseudo-terminal: {0}; `--rfc2217 127.0.0.1:2217` offers a serial line over TCP instead"
    )]
    Pty(#[source] io::Error),
    /// The name it shall have.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// A TCP port.
    #[error(
        "cannot listen on {address}: {cause}; expected HOST:PORT such as 127.0.0.1:2217 (port 0 takes a free one)"
    )]
    Listen {
        /// What was asked for.
        address: String,
        /// What the system said.
        cause: io::Error,
    },
    /// A real port.
    #[error("cannot open the serial port {}: {cause}; does it exist, and may you use it (group `dialout`)?", path.display())]
    Port {
        /// The port's device file.
        path: PathBuf,
        /// What the system said.
        cause: io::Error,
    },
}
