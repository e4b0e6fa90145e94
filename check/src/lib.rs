//! A test bench for controllers of orchard scanners: a scenario file names a virtual rig, children, an end and expectations; out come
//! verdicts.

mod fault;
pub mod scenario;
pub mod what;

pub use fault::{Direction, FaultTable};
pub use scenario::{Scenario, ScenarioError};
