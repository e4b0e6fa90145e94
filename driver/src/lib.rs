//! The host's side of a SICK LMS scanner: dial, log in, configure, stream, reconnect.
//!
//! ```no_run
//! # async fn run() -> Result<(), rowscan_driver::DriverError> {
//! use rowscan_driver::{DriverConfig, Scanner, Source};
//!
//! let source: Source = "tcp://192.168.0.1:2112".parse()?;
//! let mut scanner = Scanner::open(&source, DriverConfig::default()).await?;
//! while let Some(record) = scanner.next().await? {
//!     println!("{} beams at {} µs", record.scan.beams.count, record.scan.scan_time_us);
//! }
//! # Ok(())
//! # }
//! ```
//!
//! [`Scanner::next`] drives the link itself, on the caller's task: no hidden thread, no unbounded queue, one reused
//! [`Scan`](rowscan_protocol::scan::Scan). It is cancel safe at every await, so it may stand in a `select!`; also while it restores a lost
//! link. A recording is a source like any other and goes through the same frame decoder, telegram parser and session.
//!
//! | feature | opens |
//! |---|---|
//! | `tcp` (default) | `tcp://HOST:PORT`: CoLa; `rfc2217://HOST:PORT`: an LMS2xx behind a serial port server |
//! | `serial` | `serial:/dev/ttyUSB0?baud=38400`: an LMS2xx on a serial port of this machine |
//! | `recordings` | the path of a recording |
//!
//! A source whose feature is left out gives [`DriverError::Feature`].

#[cfg(not(any(feature = "tcp", feature = "serial", feature = "recordings")))]
compile_error!("rowscan-driver opens nothing without a feature: enable `tcp`, `serial` or `recordings`");

#[cfg(any(feature = "tcp", feature = "serial"))]
mod byte_stream;
mod clock;
mod config;
mod connection;
#[cfg(any(feature = "tcp", feature = "serial"))]
mod endpoint;
mod error;
#[cfg(all(test, any(feature = "tcp", feature = "serial")))]
#[path = "../tests/fake_device/mod.rs"]
mod fake_device;
mod feed;
#[cfg(any(feature = "tcp", feature = "serial"))]
mod link;
mod link_event;
#[cfg(feature = "recordings")]
mod recording;
mod scanner;
mod source;

pub use {rowscan_protocol, rowscan_recording};

#[cfg(any(feature = "tcp", feature = "serial"))]
pub use byte_stream::ByteStream;
pub use clock::HostTime;
pub use config::{Backoff, DriverConfig};
pub use connection::{Connection, ConnectionEvent};
pub use error::{DriverError, JunkBytes};
pub use link_event::{LinkEvent, LinkEvents};
pub use scanner::{Arrival, LinkCounts, Record, Scanner};
pub use source::Source;
