//! A tractor in simulated time: where it drives, what its wheel encoder counts, and what its GNSS receiver reports.
//!
//! All of it is a function of the time driven, in any order of asking. The crate does no I/O, reads no clock and keeps no global
//! state; noise comes from keyed streams, so the same seed gives the same fixes.
//!
//! ```
//! use rowscan_protocol::time::SimTime;
//! use rowscan_vehicle::gnss::{Gnss, Receiver};
//! use rowscan_vehicle::trajectory::Trajectory;
//! use rowscan_vehicle::{Encoder, Tractor};
//!
//! let tractor = Tractor::new(Trajectory::straight(0.0, 1.5));
//! tractor.begin(SimTime::ZERO);
//! let at = SimTime(2_000_000_000);
//! let motion = tractor.motion(at);
//! assert_eq!(motion.place.y_m, 3.0);
//! assert_eq!(Encoder::default().ticks(motion.wheel_m), 3000.0);
//! let fix = Receiver::new(Gnss::default(), 1).fix(at, &motion);
//! assert_eq!(fix.speed_m_s, 1.5);
//! ```

pub mod earth;
pub mod encoder;
mod faults;
pub mod gnss;
mod nozzles;
pub mod parameter;
pub mod road;
pub mod scene_file;
pub mod tractor;
pub mod trajectory;
mod utc;

pub use encoder::Encoder;
pub use faults::{Report, VehicleFault};
pub use parameter::ParameterError;
pub use scene_file::{FileError, SceneFile};
pub use tractor::Tractor;
