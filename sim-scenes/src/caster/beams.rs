//! Beams of one line: a mirror's fan, or parallel beams of an orthogonal scan.

use glam::DVec3;
use rowscan_protocol::scan::Pose;

use super::fan::BeamFan;
use super::parallel::ParallelBeams;
use super::sight::Sight;

/// The beams of one line, all square to Y: in one plane, or from a moving scanner each in its own.
#[derive(Clone, Debug, PartialEq)]
pub enum Beams {
    /// From one point, by angle: the mirror of a scanner.
    Fan(BeamFan),
    /// Side by side, in one direction: the orthogonal scans of the paper.
    Parallel(ParallelBeams),
}

impl Beams {
    /// Number of beams.
    pub fn len(&self) -> usize {
        match self {
            Self::Fan(fan) => fan.len(),
            Self::Parallel(beams) => beams.len(),
        }
    }

    /// True if there is no beam.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Where each beam starts and its unit direction (scene frame), for a line cast from `origin`, in order.
    pub fn rays(&self, origin: Pose) -> impl Iterator<Item = ([f64; 3], [f64; 3])> + '_ {
        let from = DVec3::new(origin.x_m, origin.y_m, origin.z_m);
        (0..self.len()).map(move |j| {
            let (start, direction) = match self {
                Self::Fan(fan) => fan.ray(j),
                Self::Parallel(beams) => beams.ray(j),
            };
            ((from + start).to_array(), direction.to_array())
        })
    }
}

impl From<BeamFan> for Beams {
    fn from(fan: BeamFan) -> Self {
        Self::Fan(fan)
    }
}

impl From<ParallelBeams> for Beams {
    fn from(beams: ParallelBeams) -> Self {
        Self::Parallel(beams)
    }
}
