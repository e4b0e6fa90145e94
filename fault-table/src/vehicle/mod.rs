//! Faults of the tractor and what is on it.

pub mod drive;
pub mod encoder;
pub mod gnss;

pub use drive::DriveFault;
pub use encoder::EncoderFault;
pub use gnss::GnssFault;
