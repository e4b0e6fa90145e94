//! A test bench for controllers of orchard scanners: a scenario file names a virtual rig, children, an end and expectations; out come
//! verdicts.
//!
//! ```text
//! scenario ──► rig (emulator) ──► bytes to the child ──► witness: counts, times, estimate ──► judge ──► verdicts ──► text, JUnit, TAP, JSON lines
//!                                 children ──► output, exit codes ───────────────────────────┘
//! ```

mod bus_news;
mod check;
mod child;
mod child_clock;
mod clock;
mod course;
mod descendants;
mod ending;
mod fault;
mod fault_desk;
mod fault_schema;
mod frames;
mod jitter;
mod journal;
mod judge;
mod judged;
mod onlooker;
mod output;
mod pause;
mod process_value;
pub mod report;
mod rig;
mod run_end;
mod run_file;
mod runner;
pub mod scenario;
mod sentences;
mod signal;
mod sprayer;
mod standing;
mod takers;
mod task_controller;
mod truth;
mod unmet;
mod unread;
mod verdict;
pub mod what;
mod witness;

pub use check::{CheckError, Options, check};
pub use fault::{Pause, ScenarioFault, Sweep};
pub use frames::FramePattern;
pub use journal::Event;
pub use onlooker::{Look, Onlooker};
pub use scenario::{Scenario, ScenarioError};
pub use signal::{Must, SignalKeys, Source};
pub use sprayer::{Intercepted, KeptError, Relative, SprayerRun, SprayerSpec};
pub use task_controller::TaskSpec;
pub use verdict::{Case, Tried, Verdict, worst};
