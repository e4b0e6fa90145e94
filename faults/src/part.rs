//! Parts that faults act on beside the byte path: a device, a drive, a bus. Their owners act; this crate says when.

use std::fmt;
use std::time::Duration;

use rowscan_settings::fault_table::PartFault;

/// A fault that begins on a part.
#[derive(Clone, Copy, Debug)]
pub struct Order<'a> {
    /// What its end is told by.
    pub key: u64,
    /// When, on the faults' clock.
    pub at: Duration,
    /// What it is.
    pub fault: &'a PartFault,
    /// Seed of its random choices.
    pub seed: u64,
    /// The probability that is given, for faults that draw for each thing they act on.
    pub p: f64,
}

/// What a part makes of a fault.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Fit {
    /// Acts on it.
    Acts,
    /// Has nothing to do with it.
    Foreign,
    /// Would have to, and cannot.
    Refuses(String),
}

/// Something that faults act on. It is called with the plan locked: it returns at once, and calls no control.
pub trait Part: Send + Sync + fmt::Debug {
    /// Whether it takes such a fault.
    fn fits(&self, fault: &PartFault) -> Fit;

    /// A fault begins.
    fn begin(&self, order: &Order<'_>);

    /// A fault will begin at an instant that is known now, on the faults' clock; it may be another one when asked again.
    fn foresee(&self, _fault: &PartFault, _now: Duration, _at: Duration) {}

    /// The fault of this key is over.
    fn end(&self, key: u64, at: Duration);
}
