//! The caster: what the beams of one mirror turn meet.

mod fan;
mod returns;

pub use fan::BeamFan;
pub use returns::{Class, Return};

use rowscan_protocol::scan::Pose;

use crate::orchard::Orchard;

/// An orchard made ready for scanning. Immutable and shared between threads; each thread has its own [`Scratch`].
#[derive(Clone, Debug)]
pub struct Caster {}

/// Working memory of one thread, reused from line to line.
#[derive(Clone, Debug, Default)]
pub struct Scratch {}

impl Caster {
    /// Sorts the orchard's organs along the row.
    pub fn new(_orchard: &Orchard) -> Self {
        Self {}
    }

    /// The nearest surface along every beam of `fan` from `origin`, all within the plane y = origin.y. Writes one return a
    /// beam, as many as both `fan` and `out` hold.
    pub fn cast(&self, _origin: Pose, fan: &BeamFan, _scratch: &mut Scratch, out: &mut [Return]) {
        for (_, target) in (0..fan.len()).zip(out) {
            *target = Return::MISS;
        }
    }
}
