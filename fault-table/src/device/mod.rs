//! Faults of a scanner.

pub mod broken;
pub mod dirt;
pub mod power;
pub mod refusal;
pub mod stored;

pub use broken::Broken;
pub use dirt::Dirt;
pub use power::Power;
pub use refusal::{Answer, Refusal};
pub use stored::Stored;

/// A fault of a scanner.
#[derive(Clone, Debug, PartialEq)]
pub enum DeviceFault {
    /// Its supply.
    Power(Power),
    /// Its front screen.
    Dirt(Dirt),
    /// A part of it.
    Broken(Broken),
    /// What it refuses.
    Refusal(Refusal),
    /// What it is found with.
    Stored(Stored),
}
