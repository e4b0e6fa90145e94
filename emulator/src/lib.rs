//! A virtual SICK LMS laser scanner, served to any client: devices on endpoints, driven past a virtual orchard in simulated time.

pub mod clock;
mod connection;
mod lateness;
mod listener;
mod mirror;
pub mod offline;
mod outlet;
mod player;
pub mod replay;
mod roster;
mod scanner;
mod serial;
mod serial_tape;
pub mod stage;
mod state_file;
mod voices;
mod world;

pub use listener::{Bound, ListenError};
pub(crate) use mirror::Turns;
pub use outlet::Outlet;
pub use player::Player;
pub use rowscan_vehicle::Tractor;
pub use scanner::{Emulator, EmulatorConfig, EmulatorCounts, LineChange, MAX_CLIENTS};
pub(crate) use scanner::{Program, Shared};
pub use serial::{SerialConfig, SerialCounts, SerialEmulator};
pub use state_file::{StateFile, StateFileError};
pub use voices::Voices;
pub use world::{World, WorldError};
