//! One row being scanned: weighted lines in, sums out.

mod echo;
mod ground;
mod told;
mod witnesses;

use std::sync::Arc;

use rowscan_protocol::rig::{EchoChoice, Mount, Rig, RowSide};

use self::witnesses::Witnesses;
use crate::across::Across;
use crate::advance::Weighted;
use crate::answers::Answers;
use crate::beam_line::BeamLine;
use crate::by_height::ByHeight;
use crate::clumping::Clumping;
use crate::contact::{Sampled, density};
use crate::cut::{CutMethod, Profile, TrunkZone};
use crate::error::PipelineError;
use crate::estimate::{ContactReport, ReturnCounts, SidesReport};
use crate::estimator::{Contact, EstimatorInfo, Estimators, Setting, SightedLine, Sighting, Slice, Stretch};
use crate::geometry::{BeamTable, Frame, Place, Reading, reading};
use crate::ground_line::GroundLine;
use crate::leaf::{SliceLeaf, Slices, Withheld, by_band};
use crate::level::Levels;
use crate::looks::Looks;
use crate::other_side::{Joining, Kept, OtherSide};
use crate::parameters::Parameters;
use crate::patches::Patches;
use crate::percentile::{Histogram, TOP_SHARE};
use crate::profile::Outline;
use crate::recent::{Recent, WindowSums};
use crate::remission::RemissionScale;
use crate::stray_returns::{Stray, Strays, into_cells};
use crate::trees::{Cell, Cells, Cut, Keys, gaps_m, standing};
use crate::voxels::Voxels;

/// The sums of one row. Lines come in the order of travel.
#[derive(Clone, Debug)]
pub(crate) struct Row {
    frame: Frame,
    parameters: Parameters,
    table: BeamTable,
    looks: Looks,
    cut: Cut,
    open: Option<Keys>,
    voxels: Voxels,
    patches: Patches,
    /// Of the slices that have ended.
    contact: Sampled,
    /// The last of them.
    slices: Slices,
    estimators: Estimators,
    /// The same as they were asked for.
    asked: Vec<&'static EstimatorInfo>,
    /// The line's beams, for the estimators.
    sightings: Vec<Sighting>,
    row_spacing_m: Option<f64>,
    /// How long the row is, if the rig knows.
    row_m: Option<f64>,
    /// The row in bins, if trees are to be found in the data.
    profile: Option<Profile>,
    trunk_zone: TrunkZone,
    tree_spacing_m: Option<f64>,
    find: Vec<CutMethod>,
    /// The metres the open slice lies in, each with its share of the slice.
    slice_metres: Vec<(i64, f64)>,
    heights: Histogram,
    levels: Levels,
    ground: GroundLine,
    outline: Outline,
    /// The open metre: scanned, and whether it holds canopy.
    metre: (f64, bool),
    totals: Totals,
    recent: Recent,
    /// Y of the latest line, metres.
    y_m: f64,
    /// What beams met by direction.
    answers: Answers,
    /// Where the scan plane leans.
    strays: Strays,
    /// The canopy by height, if it is asked for.
    by_height: Option<Box<ByHeight>>,
    /// Where it lies across the row.
    across: Across,
    witnesses: Witnesses,
    /// Slices that are kept for a pass from the row's other side.
    kept: Option<Kept>,
    /// What a pass from the other side saw.
    joining: Option<Joining>,
    pub(crate) trees: Cells,
    pub(crate) metres: Cells,
}

/// Sums over the whole row, kept apart from the cells, which are only so many.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Totals {
    pub(crate) impacted_m2: f64,
    pub(crate) contact_m2: f64,
    /// The same by the shares of spots, and by blocks of beams; 0 where they are not told.
    pub(crate) share_m2: f64,
    pub(crate) closed_m2: f64,
    /// Hits in voxels, and those of them that told their share.
    pub(crate) hits: u64,
    pub(crate) shares: u64,
    /// Metres scanned of those metres of row that hold canopy returns; as of [`Row::so_far`] without those where trees are missing.
    pub(crate) canopy_m: f64,
    pub(crate) returns: ReturnCounts,
    /// Σ weight over lines, metres, and Σ weight², m².
    weights: (f64, f64),
}

impl Totals {
    /// How far apart lines lie, by what a metre of row has: the mean of their weights, by weight. `None` before the first line.
    pub(crate) fn line_spacing_m(&self) -> Option<f64> {
        let (sum_m, squares_m2) = self.weights;
        (sum_m > 0.0).then(|| squares_m2 / sum_m)
    }
}

/// What a line's returns come to.
#[derive(Clone, Copy, Debug, Default)]
struct Placed {
    /// The canopy's area per weight, metres.
    area_m: f64,
    /// Canopy returns.
    returns: u64,
    /// Σ weight over returns from where trunks are.
    trunk: f64,
}

impl Row {
    pub(crate) fn new(rig: &Rig, mount: &Mount, parameters: Parameters) -> Result<Self, PipelineError> {
        let frame = Frame::new(rig, mount)?;
        let cut = Cut::new(rig.tree_spacing_m, parameters.slice_m);
        Ok(Self {
            frame,
            parameters,
            table: BeamTable::default(),
            looks: Looks::default(),
            cut,
            open: None,
            voxels: Voxels::new(&frame, rig.row_spacing_m, &parameters),
            patches: Patches::default(),
            contact: Sampled::default(),
            slices: Slices::default(),
            estimators: Estimators::default(),
            asked: Vec::new(),
            sightings: Vec::new(),
            row_spacing_m: rig.row_spacing_m,
            row_m: rig.trees.zip(rig.tree_spacing_m).map(|(trees, spacing_m)| f64::from(trees) * spacing_m),
            profile: None,
            trunk_zone: TrunkZone::above(frame.ground_clearance_m),
            tree_spacing_m: rig.tree_spacing_m,
            find: Vec::new(),
            slice_metres: Vec::new(),
            heights: Histogram::new(),
            levels: Levels::default(),
            ground: GroundLine::new(&frame, mount.side()),
            outline: Outline::default(),
            metre: (0.0, false),
            totals: Totals::default(),
            recent: Recent::default(),
            y_m: 0.0,
            answers: Answers::default(),
            strays: Strays::default(),
            by_height: None,
            across: Across::default(),
            witnesses: Witnesses::default(),
            kept: None,
            joining: None,
            trees: Cells::new(parameters.max_cells),
            metres: Cells::new(parameters.max_cells),
        })
    }

    /// Whether densities are those of rays although the beams have a width.
    pub(crate) fn takes_out_the_spot(&self) -> bool {
        self.parameters.footprint.is_some()
    }

    /// Relative standard deviation of the leaf area for what the beams' width was taken out by, at the row plane; 0 for ideal rays.
    pub(crate) fn spot_relative_sd(&self, clumping: Option<&Clumping>) -> f64 {
        let applied = clumping.filter(|clumping| clumping.applied);
        applied.map_or_else(
            || self.parameters.spot_relative_sd(self.frame.distance_m),
            |clumping| clumping.relative_sd,
        )
    }

    /// The same by how well the smallest share is known that is an echo.
    pub(crate) fn least_share_relative_sd(&self) -> f64 {
        self.parameters.least_share_relative_sd(self.frame.distance_m)
    }

    /// The edge of voxels that was asked for, metres.
    pub(crate) fn voxel_m(&self) -> f64 {
        self.parameters.voxel_m
    }

    /// Metres of row that lines stand for, so far.
    pub(crate) fn scanned_m(&self) -> f64 {
        self.totals.weights.0
    }

    /// Share of the beams that look at the row and are unknown along most of it.
    pub(crate) fn unknown_share(&self) -> f64 {
        self.answers.unknown_share()
    }

    /// The spacing of lines that the voxels' edge was chosen for.
    pub(crate) fn planned_spacing_m(&self) -> Option<f64> {
        self.parameters.line_spacing_m
    }

    /// How remission is read, where it is.
    pub(crate) fn remission(&self) -> Option<&RemissionScale> {
        self.parameters.remission.as_ref()
    }

    /// Measures by these estimators too, from the next line on.
    pub(crate) fn measure(&mut self, asked: &[&'static EstimatorInfo]) {
        let Self { frame, parameters, row_spacing_m, .. } = *self;
        self.estimators = Estimators::new(asked, &Setting { frame, parameters, row_spacing_m });
        self.asked = asked.to_vec();
    }

    /// Looks for trees in the data too, from the next line on.
    pub(crate) fn find_trees(&mut self, methods: &[CutMethod]) {
        self.find = methods.to_vec();
        self.profile =
            (!methods.is_empty()).then(|| Profile::new(self.parameters.max_cells.saturating_mul(5)));
    }

    /// Adds a line. One without weight adds nothing.
    pub(crate) fn add(&mut self, beams: &BeamLine<'_>, line: Weighted) {
        let BeamLine { grid, range_m, .. } = *beams;
        let weight_m = line.weight_m;
        if !(weight_m > 0.0 && line.y_m.is_finite()) {
            return;
        }
        // Beams of turns that are interlaced lie less than a step apart: neighbours as good as those of a line.
        if self.table.grid().step != grid.step {
            self.patches.clear();
        }
        let how = (&self.frame, self.parameters.area_form);
        self.looks.turn_to(grid, how, &mut self.table, &mut self.voxels);
        let keys = self.cut.keys(line.y_m);
        self.pass_borders(keys);
        self.open = Some(keys);
        self.strays.pass(line.y_m);

        self.y_m = line.y_m;
        let (sum_m, squares_m2) = &mut self.totals.weights;
        *sum_m += weight_m;
        *squares_m2 += weight_m * weight_m;
        self.recent.line(line.y_m, weight_m);
        self.outline.add_line(weight_m);
        self.patches.add_line(range_m);
        self.voxels.add_line(beams, self.patches.fresh(), weight_m);
        self.witnesses.add(&self.frame, &self.table, line.y_m, range_m);
        let Placed { area_m, returns, trunk } = self.place_returns(range_m, line);
        self.estimators.enter_tree(keys.tree);
        self.estimators.line(&SightedLine { weight_m, sightings: &self.sightings });
        if let Some(by_height) = &mut self.by_height {
            by_height.line(&self.sightings, weight_m);
        }

        // I_T of the line: its weight × Σ 2 l sin(Δθ/2) cos θ over canopy returns, leaf and wood alike (paper eq. 4 over eq. 3).
        let impacted_m2 = weight_m * area_m;
        self.totals.impacted_m2 += impacted_m2;
        self.totals.returns.canopy += returns;
        self.metre = (self.metre.0 + weight_m, self.metre.1 || returns > 0);
        // Where the plane leans, returns go by their own places.
        let (impacted_m2, returns, trunk) =
            if self.frame.axes.is_some() { (0.0, 0, 0.0) } else { (impacted_m2, returns, trunk) };
        if let Some(profile) = &mut self.profile {
            profile.add_line(line.y_m, weight_m, impacted_m2, trunk);
        }
        let tree = keys.tree.and_then(|tree| self.trees.at(tree));
        for cell in tree.into_iter().chain(self.metres.at(keys.metre)) {
            cell.add_line(weight_m, impacted_m2, returns);
        }
        match self.slice_metres.last_mut() {
            Some((metre, share_m)) if *metre == keys.metre => *share_m += weight_m,
            _ => self.slice_metres.push((keys.metre, weight_m)),
        }
        self.settle(false);
    }

    /// Adds returns to where they lie.
    fn settle(&mut self, ended: bool) {
        let Self { strays, cut, trees, metres, profile, .. } = self;
        strays.settle(ended, |stray| {
            into_cells(stray, cut, trees, metres);
            if let Some(profile) = profile {
                profile.add_line(stray.y_m, 0.0, stray.impacted_m2, stray.trunk);
            }
        });
    }

    /// Sorts a line's returns.
    fn place_returns(&mut self, range_m: &[f64], Weighted { y_m, weight_m }: Weighted) -> Placed {
        let leans = self.frame.axes.is_some();
        let Placed { mut area_m, mut returns, mut trunk } = Placed::default();
        let wanted = !self.estimators.is_empty() || self.by_height.is_some();
        self.sightings.clear();
        // A tractor that turns behind the row's end sees the ground from elsewhere.
        let is_on_row = self.row_m.is_none_or(|row_m| (0.0..=row_m).contains(&y_m));
        for ((beam, &range_m), &fresh) in self.table.beams().iter().zip(range_m).zip(self.patches.fresh()) {
            let Some(beam) = beam else { continue };
            let found = reading(range_m);
            let (x_m, z_m) = (range_m * beam.cos, self.frame.height_m + range_m * beam.sin);
            let above_ground_m = self.frame.above_ground_m(x_m, z_m);
            self.answers.add(beam, found, above_ground_m, weight_m);
            let place = match found {
                Reading::Return => Some(self.frame.place(beam, range_m)),
                Reading::Miss => None,
                Reading::Invalid => continue,
            };
            if place.is_some() {
                if is_on_row {
                    self.ground.add(x_m, z_m);
                }
                if x_m < self.frame.distance_m {
                    self.levels.add_alley(above_ground_m);
                }
            }
            let mut canopy = None;
            match place {
                None => {}
                Some(Place::Ground) => {
                    self.totals.returns.ground += 1;
                    self.levels.add_ground(above_ground_m);
                }
                Some(Place::Far) => self.totals.returns.far += 1,
                Some(Place::Canopy { x_m, z_m }) => {
                    area_m += range_m * beam.area_factor;
                    returns += 1;
                    self.heights.add(z_m, weight_m);
                    let above_m = self.frame.above_ground_m(x_m, z_m);
                    self.levels.add(above_m);
                    self.across.add(x_m - self.frame.distance_m, above_m);
                    self.outline.add(x_m, z_m);
                    let of_trunk = self.trunk_zone.holds(x_m, z_m, self.frame.distance_m);
                    trunk += if of_trunk { weight_m } else { 0.0 };
                    if leans {
                        self.strays.add(Stray {
                            y_m: y_m + range_m * beam.ahead - beam.shift_m,
                            impacted_m2: weight_m * range_m * beam.area_factor,
                            trunk: if of_trunk { weight_m } else { 0.0 },
                        });
                    }
                    canopy = Some(Contact { range_m, x_m, z_m, fresh });
                    self.recent.hit(z_m, self.frame.distance_m - x_m, weight_m * range_m * beam.area_factor);
                }
            }
            if wanted {
                self.sightings.push(Sighting { beam: *beam, canopy });
            }
        }
        self.ground.line(weight_m);
        Placed { area_m, returns, trunk }
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
        self.settle(true);
        self.ground.close();
        self.close_outline(open);
        self.close_slice(open);
        self.close_tree(open);
        self.close_metre();
        if let Some(by_height) = &mut self.by_height {
            by_height.close();
        }
    }

    fn close_outline(&mut self, open: Keys) {
        let section = self.outline.section(self.frame.distance_m);
        let volume_m3 = section.volume_m3();
        self.estimators.section(&section);
        self.outline.clear();
        if let Some(tree) = open.tree.and_then(|tree| self.trees.at(tree)) {
            tree.volume_m3 += volume_m3;
        }
    }

    /// Slices of this pass, none so far.
    fn no_slices(&self, row: RowSide) -> Kept {
        Kept::new(self.voxels.region(), &self.cut, row, self.parameters.max_cells)
    }

    /// Keeps the voxels of each slice, from the next line on, for a pass from the row's other side.
    pub(crate) fn keep_voxels(&mut self, row: RowSide) {
        self.kept = Some(self.no_slices(row));
    }

    /// The slices that were kept.
    pub(crate) fn kept(&self) -> Option<&Kept> {
        self.kept.as_ref()
    }

    /// Joins what another pass saw with each slice, from the next line on.
    ///
    /// # Errors
    /// Voxels of another size.
    pub(crate) fn join(&mut self, other: Arc<OtherSide>, row: RowSide) -> Result<(), PipelineError> {
        self.joining = Some(Joining::new(other, self.no_slices(row), self.voxels.min_beams())?);
        Ok(())
    }

    /// What came of joining another pass, if one was joined.
    pub(crate) fn sides(&self) -> Option<SidesReport> {
        self.joining.as_ref().map(Joining::report)
    }

    /// Why another pass that was joined tells no leaf area by itself.
    pub(crate) fn other_side_withheld(&self) -> Option<Withheld> {
        self.joining.as_ref().and_then(Joining::withheld)
    }

    fn close_slice(&mut self, open: Keys) {
        if let Some(kept) = &mut self.kept {
            kept.push(open.slice, self.voxels.kept());
        }
        if let Some(joining) = &mut self.joining {
            joining.join(open.slice, &mut self.voxels);
        }
        let sampled = Sampled::of(&self.voxels, self.parameters.projection);
        let (leaf_m2, share_m2) = (sampled.leaf_m2, self.voxels.share_leaf_area_m2());
        self.slices.push(self.slice_leaf(open));
        self.contact.add(&sampled);
        self.totals.contact_m2 += leaf_m2;
        self.totals.share_m2 += share_m2;
        self.totals.closed_m2 += self.voxels.closed_leaf_area_m2();
        self.totals.hits += self.voxels.hits();
        self.totals.shares += self.voxels.shares();
        self.estimators.slice(&Slice { voxels: &self.voxels });
        if let Some(by_height) = &mut self.by_height {
            by_height.close_slice(&self.voxels, self.cut.slice_faces_m(open.slice), open.tree);
        }
        self.voxels.clear();
        if let Some(profile) = &mut self.profile {
            let [from_m, to_m] = self.cut.slice_faces_m(open.slice);
            profile.add_leaf_area(from_m, to_m, leaf_m2);
        }
        if let Some(tree) = open.tree.and_then(|tree| self.trees.at(tree)) {
            tree.contact_m2 += leaf_m2;
            tree.share_m2 += share_m2;
        }
        let length_m: f64 = self.slice_metres.iter().map(|(_, share_m)| share_m).sum();
        for (metre, share_m) in self.slice_metres.drain(..) {
            if let Some(metre) = self.metres.at(metre) {
                metre.contact_m2 += leaf_m2 * share_m / length_m;
                metre.share_m2 += share_m2 * share_m / length_m;
            }
        }
    }

    /// The open slice's raw leaf area by height.
    fn slice_leaf(&self, open: Keys) -> SliceLeaf {
        let Self { voxels, parameters, .. } = self;
        let mut slice = SliceLeaf {
            y_m: self.cut.slice_faces_m(open.slice),
            length_m: voxels.length_m(),
            ..SliceLeaf::default()
        };
        let per_density_m2 = voxels.volume_m3() / parameters.projection;
        for layer in voxels.layers(|voxel| density(voxel, voxels.min_beams())) {
            by_band(&mut slice.contact_m2, layer.z_m, (layer.density + layer.filled) * per_density_m2);
        }
        if parameters.remission.is_some() {
            for layer in voxels.layers(|voxel| voxel.share_frequency(voxels.min_beams())) {
                by_band(&mut slice.share_m2, layer.z_m, (layer.density + layer.filled) * per_density_m2);
            }
        }
        slice
    }

    fn close_tree(&mut self, open: Keys) {
        let height_m = self.heights.percentile(TOP_SHARE);
        self.heights.clear();
        if let Some(by_height) = &mut self.by_height {
            by_height.close_tree(open.tree);
        }
        if let Some(tree) = open.tree.and_then(|tree| self.trees.at(tree)) {
            tree.height_m = tree.height_m.into_iter().chain(height_m).reduce(f64::max);
            let stretch = Stretch::new(tree.scanned_m, self.row_spacing_m);
            self.estimators.close_tree(&stretch);
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
            .chain(self.voxels.capacities())
            .chain(self.patches.capacities())
            .chain([self.sightings.capacity()])
            .collect()
    }

    /// The canopy just driven past.
    pub(crate) fn window(&self) -> WindowSums {
        self.recent.window()
    }

    /// Y of the latest line, metres.
    pub(crate) fn y_m(&self) -> f64 {
        self.y_m
    }

    /// The sums of what has been closed.
    pub(crate) fn totals(&self) -> &Totals {
        &self.totals
    }

    /// The sums as if the row ended here.
    pub(crate) fn so_far(&self) -> Totals {
        let mut totals = self.totals;
        if self.open.is_some() {
            let sampled = Sampled::of(&self.voxels, self.parameters.projection);
            totals.contact_m2 += sampled.leaf_m2;
            totals.share_m2 += self.voxels.share_leaf_area_m2();
            totals.closed_m2 += self.voxels.closed_leaf_area_m2();
            totals.hits += self.voxels.hits();
            totals.shares += self.voxels.shares();
            let (scanned_m, canopy) = self.metre;
            totals.canopy_m += if canopy { scanned_m } else { 0.0 };
        }
        let spacing_m = self.tree_spacing_m.unwrap_or(f64::INFINITY);
        let open = self.open.and_then(|keys| keys.tree);
        totals.canopy_m -= gaps_m(&self.trees, &self.metres, spacing_m, open);
        totals
    }

    /// The trees that stand there, by the rig's spacing, as if the row ended here; none where it tells no spacing.
    pub(crate) fn standing_trees(&self) -> impl Iterator<Item = &Cell> + Clone {
        standing(&self.trees, self.tree_spacing_m.unwrap_or(f64::INFINITY), None)
    }

    /// How the contact frequency was sampled, as if the row ended here.
    pub(crate) fn sampled_so_far(&self) -> Sampled {
        let mut sampled = self.contact;
        if self.open.is_some() {
            sampled.add(&Sampled::of(&self.voxels, self.parameters.projection));
        }
        sampled
    }

    /// How the leaves of a row of such sums stand; `None` of rays, and where nothing was hit.
    pub(crate) fn clumping(&self, totals: &Totals) -> Option<Clumping> {
        let footprint = self.parameters.footprint?;
        let law = footprint.law.filter(|_| footprint.echo == Some(EchoChoice::First));
        let constant_sd = self.parameters.spot_relative_sd(self.frame.distance_m);
        Clumping::of(totals.closed_m2, totals.contact_m2, law, constant_sd)
    }

    /// The slices of the window just driven past, the latest first.
    pub(crate) fn window_slices(&self) -> impl Iterator<Item = SliceLeaf> + '_ {
        let open = self.open.filter(|_| self.slices.is_empty());
        self.slices.window(open.map(|open| self.slice_leaf(open)))
    }

    pub(crate) fn contact_report(&self) -> ContactReport {
        let line_spacing_m = self.totals.line_spacing_m();
        self.sampled_so_far().report(self.cut.slice_m(), line_spacing_m, &self.parameters)
    }
}
