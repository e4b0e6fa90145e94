//! Where the tractor is: one function of the time it has driven, which scans, encoder, GNSS and CAN all read.
//!
//! A [`SpeedProfile`] gives the distance driven at a time (legs of steady acceleration), a [`Course`] the place at a distance (along
//! the row, round the headland, along the next). Both are closed forms: an instant costs the same early and late, in any order, and
//! no step accumulates.

mod course;
mod detour;
mod drive;
mod motion;
mod profile;
mod track;

pub use course::{Alley, Course, Place};
pub use drive::{Drive, DriveError, Leg, StopAndGo};
pub use motion::{Motion, Trajectory};
pub use profile::{ProfileState, SpeedProfile};
pub use track::{Track, TrackError, TrackPoint, TrackValue};
