//! A virtual SICK LMS laser scanner, served to any client: devices on endpoints, driven past a virtual orchard in simulated time.
//!
//! A test of your own crate embeds a scanner in ten lines (`tests/your_controller.rs`):
//!
//! ```no_run
#![doc = include_str!("../tests/your_controller.rs")]
//! ```
//!
//! ```toml
//! [dev-dependencies]
//! rowscan-emulator = { version = "0.2", features = ["files"] }
//! tokio = { version = "1", features = ["io-util", "macros", "net", "rt"] }
//! ```
//!
//! A scene can stand in the test itself, and time can run as fast as the client reads:
//!
//! ```
//! use rowscan_emulator::clock::TimeScale;
//! use rowscan_emulator::rowscan_protocol::model;
//! use rowscan_emulator::rowscan_scenes::files::scene_from_text;
//! use rowscan_emulator::stage::Stage;
//! use rowscan_emulator::{Emulator, EmulatorConfig};
//!
//! # #[tokio::main(flavor = "current_thread")]
//! # async fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let scene = scene_from_text("version = 1\n[orchard]\ntrees = 1\n", |_| {})?;
//! let stage = Stage::grow(scene, &|_, _| {})?;
//! let (device, view) = stage.scanner(0, model::by_name("tim561").ok_or("no such model")?)?;
//! let config = EmulatorConfig { time_scale: TimeScale::Max, ..EmulatorConfig::default() };
//! let mut scanner = Emulator::start(device, view, config);
//! let address = scanner.listen("127.0.0.1:0").await?.address;
//! let client = tokio::net::TcpStream::connect(address).await?; // your program under test
//! # drop(client);
//! drop(scanner); // ends it and closes its connections
//! # Ok(())
//! # }
//! ```
//!
//! [`Rig`] joins several scanners, GNSS and CAN on one timeline. [`offline::Offline`] is the same device without sockets.
//! [`SerialEmulator`] is an LMS2xx on a serial line or a pseudo-terminal; [`replay`] serves a recording.
//!
//! The client's side is [`rowscan-driver`](https://docs.rs/rowscan-driver); the program `rowscan emulate` does the same from the command line, and
//! the Python package `rowscan` from pytest.

pub use {rowscan_protocol, rowscan_scenes};

mod bus_output;
pub mod clock;
mod compute;
mod connection;
mod counting;
mod datagram_outlet;
mod datagram_source;
mod datagrams;
mod device_handle;
mod end;
mod fault_clock;
mod fault_source;
mod faulted;
mod faulty_wire;
mod firing;
mod gap;
mod gnss_output;
mod hold;
mod imu;
mod lateness;
mod line_change;
mod line_changes;
mod line_watch;
mod listener;
mod lms2xx;
pub mod lockstep;
mod mirror;
pub mod offline;
pub mod offline_lms2xx;
mod outlet;
mod playback_queue;
mod player;
#[cfg(target_os = "linux")]
mod processes;
mod refused_settings;
pub mod replay;
mod rig;
mod rig_control;
mod roster;
mod running;
mod scan_moment;
mod scanner;
mod search;
mod seen_rig;
mod sent_lines;
mod serial_emulator;
mod shared;
mod sight;
mod sleeps;
mod source;
pub mod stage;
mod stage_row;
mod start;
mod state_file;
mod steps;
mod stride;
mod telegram;
mod timeline;
mod turns;
mod view;

pub use compute::Compute;
pub use counting::{ConnectionCounts, CountReader, ScannerCounts, VirtualScanner};
pub use datagrams::DatagramCounts;
pub use device_handle::DeviceHandle;
pub use end::EndWhen;
pub use gap::{Gap, Gaps};
pub use hold::Hold;
pub use line_change::LineChange;
pub use line_watch::{LineWatch, LineWatcher, SeenLine};
pub use listener::{Bound, ListenError};
pub use lms2xx::{SerialConfig, SerialCounts, pause_slack};
pub use outlet::Outlet;
pub use player::Player;
pub use refused_settings::RefusedSetting;
pub use rig::Rig;
pub use rig_control::{ClockMode, RigControl, RigTime};
pub use running::Running;
pub use scan_moment::ScanMoment;
pub use scanner::{Counter, Emulator};
pub use seen_rig::{LiveMap, SeenRig, SeenScanner};
pub use serial_emulator::SerialEmulator;
pub use shared::{EmulatorConfig, EmulatorCounts, IDLE_LIMIT, MAX_CLIENTS};
pub use sight::Sight;
pub use sleeps::{Sleep, Sleeps};
pub use stage_row::StageRow;
pub use start::{StartWhen, StartWhenError};
pub use state_file::{StateFile, StateFileError};
pub use view::{ScannerView, ViewError};
