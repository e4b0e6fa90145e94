//! One row being scanned: weighted lines in, sums out.

use rowscan_protocol::angle::BeamGrid;
use rowscan_protocol::rig::{Mount, Rig};

use crate::advance::Weighted;
use crate::contact::ContactFrequency;
use crate::error::PipelineError;
use crate::estimate::{ContactReport, ReturnCounts};
use crate::geometry::{BeamTable, Frame, Place, Reading, reading};
use crate::parameters::Parameters;
use crate::profile::{HeightHistogram, Outline};
use crate::trees::{Cells, Cut, Keys};

/// The sums of one row. Lines come in the order of travel.
#[derive(Clone, Debug)]
pub(crate) struct Row {
    frame: Frame,
    parameters: Parameters,
    table: BeamTable,
    cut: Cut,
    open: Option<Keys>,
    contact: ContactFrequency,
    /// The metres the open slice lies in, each with its share of the slice.
    slice_metres: Vec<(i64, f64)>,
    heights: HeightHistogram,
    outline: Outline,
    /// The open metre: scanned, and whether it holds canopy.
    metre: (f64, bool),
    totals: Totals,
    pub(crate) trees: Cells,
    pub(crate) metres: Cells,
}

/// Sums over the whole row, kept apart from the cells, which are only so many.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Totals {
    pub(crate) impacted_m2: f64,
    pub(crate) contact_m2: f64,
    /// Metres scanned of those metres of row that hold canopy returns.
    pub(crate) canopy_m: f64,
    pub(crate) returns: ReturnCounts,
}

impl Row {
    pub(crate) fn new(rig: &Rig, mount: &Mount, parameters: Parameters) -> Result<Self, PipelineError> {
        let frame = Frame::new(rig, mount)?;
        let cut = Cut::new(rig.tree_spacing_m, parameters.slice_m);
        Ok(Self {
            frame,
            parameters,
            table: BeamTable::default(),
            cut,
            open: None,
            contact: ContactFrequency::new(&frame, rig.row_spacing_m, cut.slice_m(), &parameters),
            slice_metres: Vec::new(),
            heights: HeightHistogram::new(),
            outline: Outline::new(),
            metre: (0.0, false),
            totals: Totals::default(),
            trees: Cells::new(parameters.max_cells),
            metres: Cells::new(parameters.max_cells),
        })
    }

    /// Adds a line of first-echo ranges. One without weight adds nothing.
    pub(crate) fn add(&mut self, grid: BeamGrid, range_m: &[f64], line: Weighted) {
        let weight_m = line.weight_m;
        if !(weight_m > 0.0 && line.y_m.is_finite()) {
            return;
        }
        if self.table.update(grid, &self.frame, self.parameters.area_form) {
            self.contact.rebuild(self.table.beams(), &self.frame);
        }
        let keys = self.cut.keys(line.y_m);
        self.pass_borders(keys);
        self.open = Some(keys);

        self.outline.add_line(weight_m);
        self.contact.add_line(range_m, weight_m);
        let (area_m, returns) = self.place_returns(range_m, weight_m);

        // I_T of the line: its weight × Σ 2 l sin(Δθ/2) cos θ over canopy returns, leaf and wood alike (paper eq. 3).
        let impacted_m2 = weight_m * area_m;
        self.totals.impacted_m2 += impacted_m2;
        self.totals.returns.canopy += returns;
        self.metre = (self.metre.0 + weight_m, self.metre.1 || returns > 0);
        let tree = keys.tree.and_then(|tree| self.trees.at(tree));
        for cell in tree.into_iter().chain(self.metres.at(keys.metre)) {
            cell.add_line(weight_m, impacted_m2, returns);
        }
        match self.slice_metres.last_mut() {
            Some((metre, share_m)) if *metre == keys.metre => *share_m += weight_m,
            _ => self.slice_metres.push((keys.metre, weight_m)),
        }
    }

    /// Sorts a line's returns; gives the canopy's area per weight, metres, and the number of its returns.
    fn place_returns(&mut self, range_m: &[f64], weight_m: f64) -> (f64, u64) {
        let (mut area_m, mut returns) = (0.0, 0);
        for (beam, &range_m) in self.table.beams().iter().zip(range_m) {
            let Some(beam) = beam else { continue };
            if reading(range_m) != Reading::Return {
                continue;
            }
            match self.frame.place(beam, range_m) {
                Place::Ground => self.totals.returns.ground += 1,
                Place::Far => self.totals.returns.far += 1,
                Place::Canopy { x_m, z_m } => {
                    area_m += range_m * beam.area_factor;
                    returns += 1;
                    self.heights.add(z_m, weight_m);
                    self.outline.add(x_m, z_m);
                }
            }
        }
        (area_m, returns)
    }

    /// Closes what the line at `keys` leaves behind.
    fn pass_borders(&mut self, keys: Keys) {
        let Some(open) = self.open else { return };
        if open.outline != keys.outline {
            self.close_outline(open);
        }
        if open.slice != keys.slice {
            self.close_slice(open);
        }
        if open.tree != keys.tree {
            self.close_tree(open);
        }
        if open.metre != keys.metre {
            self.close_metre();
        }
    }

    /// Closes everything open. Lines may still follow; they go on in the same cells.
    pub(crate) fn close(&mut self) {
        let Some(open) = self.open.take() else { return };
        self.close_outline(open);
        self.close_slice(open);
        self.close_tree(open);
        self.close_metre();
    }

    fn close_outline(&mut self, open: Keys) {
        let volume_m3 = self.outline.close(self.frame.distance_m);
        if let Some(tree) = open.tree.and_then(|tree| self.trees.at(tree)) {
            tree.volume_m3 += volume_m3;
        }
    }

    fn close_slice(&mut self, open: Keys) {
        let leaf_m2 = self.contact.close();
        self.totals.contact_m2 += leaf_m2;
        if let Some(tree) = open.tree.and_then(|tree| self.trees.at(tree)) {
            tree.contact_m2 += leaf_m2;
        }
        let length_m: f64 = self.slice_metres.iter().map(|(_, share_m)| share_m).sum();
        for (metre, share_m) in self.slice_metres.drain(..) {
            if let Some(metre) = self.metres.at(metre) {
                metre.contact_m2 += leaf_m2 * share_m / length_m;
            }
        }
    }

    fn close_tree(&mut self, open: Keys) {
        let height_m = self.heights.close();
        if let Some(tree) = open.tree.and_then(|tree| self.trees.at(tree)) {
            tree.height_m = tree.height_m.into_iter().chain(height_m).reduce(f64::max);
        }
    }

    fn close_metre(&mut self) {
        let (scanned_m, canopy) = std::mem::take(&mut self.metre);
        if canopy {
            self.totals.canopy_m += scanned_m;
        }
    }

    /// What the buffers that every line uses could hold without growing.
    #[cfg(test)]
    pub(crate) fn capacities(&self) -> Vec<usize> {
        [self.table.capacity(), self.slice_metres.capacity()]
            .into_iter()
            .chain(self.contact.capacities())
            .collect()
    }

    pub(crate) fn totals(&self) -> &Totals {
        &self.totals
    }

    pub(crate) fn contact_report(&self) -> ContactReport {
        self.contact.report()
    }

    pub(crate) fn cut(&self) -> &Cut {
        &self.cut
    }

    pub(crate) fn has_far_gate(&self) -> bool {
        self.frame.far_gate_m.is_finite()
    }
}
