//! Where the tractor is: one function of the time it has driven, which scans, encoder, GNSS and CAN all read.
//!
//! Time makes way ([`SpeedProfile`]: legs of steady acceleration), way makes place ([`Course`]: along the row, round the headland, along the
//! next). Both are closed forms: asking for an instant costs the same early and late, in any order, and no step accumulates.

mod course;
mod drive;
mod motion;
mod profile;
mod track;

pub use course::{Alley, Course, Place};
pub use drive::{Drive, DriveError, Leg, StopAndGo};
pub use motion::{Motion, Trajectory};
pub use profile::{ProfileState, SpeedProfile};
pub use track::{Track, TrackError, TrackPoint, TrackValue};
