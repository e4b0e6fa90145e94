//! A virtual SICK LMS laser scanner, served to any client: devices on endpoints, driven past a virtual orchard in simulated time.

mod bus_output;
pub mod clock;
mod connection;
mod gnss_output;
mod lateness;
mod line_changes;
mod listener;
mod lms2xx;
mod mirror;
pub mod offline;
mod outlet;
mod playback_queue;
mod player;
pub mod replay;
mod rig;
mod roster;
mod scanner;
pub mod stage;
mod start;
mod state_file;
mod telegram;
mod timeline;
mod turns;
mod world;

pub use line_changes::LineChange;
pub use listener::{Bound, ListenError};
pub use lms2xx::{SerialConfig, SerialCounts, SerialEmulator};
pub use outlet::Outlet;
pub use player::Player;
pub use rig::{Rig, Running};
pub use scanner::{Emulator, EmulatorConfig, EmulatorCounts, MAX_CLIENTS};
pub use start::{StartWhen, StartWhenError};
pub use state_file::{StateFile, StateFileError};
pub use world::{World, WorldError};
