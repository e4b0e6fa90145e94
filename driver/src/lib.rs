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
//! | `tcp` (default) | `tcp://HOST:PORT`: CoLa; `picoscan://HOST:PORT?udp=2115`: REST and Compact over UDP; `rfc2217://HOST:PORT`: an LMS2xx behind a serial port server |
//! | `serial` | `serial:/dev/ttyUSB0?baud=38400`: an LMS2xx on a serial port of this machine |
//! | `recordings` | the path of a recording |
//!
//! A source whose feature is left out gives [`DriverError::Feature`].
//!
//! A recording may be ranges as text; so a test of your program needs no scanner:
//!
#![cfg_attr(feature = "recordings", doc = "```")]
#![cfg_attr(not(feature = "recordings"), doc = "```ignore")]
//! use rowscan_driver::{DriverConfig, Scanner, Source};
//!
//! # #[tokio::main(flavor = "current_thread")]
//! # async fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let path = std::env::temp_dir().join(format!("rowscan-driver-front-page-{}.csv", std::process::id()));
//! std::fs::write(
//!     &path,
//!     "# rowscan ranges 1; frequency_hz 50; start_deg -45; step_deg 0.5; unit mm
//! time_s,telegram_counter,scan_time_us,range_0,range_1,range_2
//! 0.00,1,1000000,1523,1530,0
//! 0.02,2,1020000,1498,1511,2042
//! ",
//! )?;
//! let source = Source::Recording { path, stream: None };
//! let mut scanner = Scanner::open(&source, DriverConfig::default()).await?;
//! let scan = scanner.next().await?.ok_or("a scan")?.scan;
//! assert_eq!(scan.echoes[0].range_m, [1.523, 1.530, f64::INFINITY]);
//! # let Source::Recording { path, .. } = source else { return Ok(()) };
//! # std::fs::remove_file(path)?;
//! # Ok(())
//! # }
//! ```
//!
//! The examples `print_scans`, `read_recording` and `estimate_row` are run by tests. To test against a scanner that is not there, take
//! [`rowscan-emulator`](https://docs.rs/rowscan-emulator); what scans are worth, [`rowscan-canopy`](https://docs.rs/rowscan-canopy) says.

#[cfg(not(any(feature = "tcp", feature = "serial", feature = "recordings")))]
compile_error!("rowscan-driver opens nothing without a feature: enable `tcp`, `serial` or `recordings`");

#[cfg(feature = "recordings")]
mod before_drive;
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
#[cfg(feature = "recordings")]
mod later;
mod left_out;
#[cfg(any(feature = "tcp", feature = "serial"))]
mod link;
mod link_event;
#[cfg(feature = "tcp")]
mod picoscan;
mod picoscan_address;
#[cfg(feature = "recordings")]
mod recorded_model;
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
pub use left_out::StreamsLeftOut;
pub use link_event::{LinkEvent, LinkEvents};
pub use picoscan_address::PicoscanAddress;
pub use scanner::{Arrival, LinkCounts, Record, Scanner};
pub use source::Source;
