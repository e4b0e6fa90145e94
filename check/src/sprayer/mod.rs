//! The sprayer of a scenario: its boom, how its commands are heard on a bus, what a run of it did, and what is expected of that.

mod beside;
mod client;
mod edge_words;
mod hearing;
mod judge;
mod kept;
mod machine;
mod map;
mod part;
mod run;
mod sensors;
mod spec;
mod spray;

pub(crate) use client::idle_setpoints;
pub(crate) use hearing::BoomHearing;
pub(crate) use judge::judge;
pub use kept::KeptError;
pub(crate) use machine::Machine;
pub(crate) use map::live_map;
pub(crate) use part::{NAME, SprayerPart};
pub use run::{Intercepted, Relative, SprayerRun};
pub(crate) use sensors::{BoomSensors, untold};
pub use spec::SprayerSpec;
pub(crate) use spec::{SprayerTable, settled};
pub(crate) use spray::BoomSpray;
