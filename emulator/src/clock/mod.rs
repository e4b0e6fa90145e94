//! Simulated time: its scale, its clock, and what waits for its instants. `sim_clock.rs` is the one file that reads the host's clock.

mod pacer;
mod sim_clock;
#[cfg(target_os = "linux")]
mod system_timer;
mod time_scale;
mod yielding;

pub(crate) use pacer::Pacer;
pub use pacer::Timer;
pub use sim_clock::SimClock;
pub use time_scale::{TimeScale, TimeScaleError};
pub(crate) use yielding::yield_once;
