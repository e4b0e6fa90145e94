//! A virtual orchard sprayer: from valve commands to what leaves the nozzles, beside what the leaves that pass would have wanted.
//!
//! ```text
//! commands ──► duty of each nozzle ──► valve ──► flow ──► litres ─┐
//! orchard  ──► leaves in each nozzle's strip ─┐                   ├─► recall, waste, edges, rules
//! tractor  ──► drive ─────────────────────────┴─► wanted ─────────┘
//! ```
//!
//! Everything is a pure function of the log of commands: valves have dead times and ramps, so flow is a list of closed forms and litres are exact. There is no time
//! step, no clock and no I/O. Time is simulated, in seconds since its beginning; lengths are metres in the frame of the scene: Y along the rows, Z up.
//!
//! What it tells is which leaves passed before an open nozzle, and what was sprayed where none stood. It is not a dose: air, drift, drops and their flight, run-off and
//! evaporation are not modelled.

pub mod boom;
pub mod commands;
pub mod controller;
pub mod drive;
pub mod drops;
pub mod edges;
pub mod flow;
pub mod hydraulics;
pub mod interception;
pub mod leaves;
pub mod line;
pub mod live;
pub mod map;
pub mod oracle;
pub mod overlap;
pub mod pass;
pub mod plumes;
pub mod rate;
pub mod safety;
pub mod score;
pub mod sensors;
pub mod span;
pub mod switches;
mod tank;
pub mod troubles;
pub mod valve;
pub mod wanted;
mod zones;

pub use boom::{Boom, BoomError, Side};
pub use commands::{Command, CommandLog, Target};
pub use controller::{Controller, ControllerError, nozzles_ahead_m};
pub use drive::Drive;
pub use edges::{Edge, Edges};
pub use flow::Flow;
pub use hydraulics::{Hydraulics, Node};
pub use interception::Interception;
pub use live::Live;
pub use pass::{Delivery, Pass};
pub use rate::Rate;
pub use score::Score;
pub use sensors::Sensors;
pub use span::{Span, Spans};
pub use troubles::{Trouble, Troubles};
