//! Which way the beams of a line look. An interlaced scan is of several turns whose beams lie between one another; their grids come back in turn, and the
//! tables of each are made once.

use rowscan_protocol::angle::BeamGrid;

use crate::geometry::{BeamTable, Frame};
use crate::parameters::AreaForm;
use crate::voxels::{Paths, Voxels};

/// Grids whose tables are kept besides the one in use. No known scanner interlaces more than four turns.
pub(crate) const MOST_GRIDS: usize = 4;

/// Tables of the grids that are not in use, the one used last at the end.
#[derive(Clone, Debug, Default)]
pub(crate) struct Looks {
    others: Vec<(BeamTable, Paths)>,
}

impl Looks {
    /// Fits `table` and the ways through `voxels` to the beams of a line.
    pub(crate) fn turn_to(
        &mut self,
        grid: BeamGrid,
        (frame, form): (&Frame, AreaForm),
        table: &mut BeamTable,
        voxels: &mut Voxels,
    ) {
        if table.grid() == grid {
            return;
        }
        if !table.beams().is_empty() {
            let known = self.others.iter().position(|(other, _)| other.grid() == grid);
            let oldest = (self.others.len() >= MOST_GRIDS).then_some(0);
            let (mut other, mut paths) =
                known.or(oldest).map_or_else(Default::default, |place| self.others.remove(place));
            core::mem::swap(table, &mut other);
            voxels.swap_paths(&mut paths);
            self.others.push((other, paths));
        }
        if table.update(grid, frame, form) {
            voxels.rebuild(table.beams(), frame);
        }
    }
}
