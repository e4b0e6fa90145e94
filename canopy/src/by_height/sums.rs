//! Sums by band of height: of the row, of each tree, and of blocks of the row.

use super::band_sums::BandSums;
use super::blocks::Blocks;
use super::ladder::Ladder;
use super::open::OpenSlice;
use super::told::HeightProfile;
use crate::contact::density;
use crate::error::PipelineError;
use crate::estimator::Sighting;
use crate::geometry::Frame;
use crate::parameters::Parameters;
use crate::percentile::{BASE_SHARE, Histogram, TOP_SHARE};
use crate::voxels::{LayerSum, Voxel, Voxels};

/// Trees whose bands are kept at most; later ones count in the row's only.
const MOST_TREES: usize = 20_000;

/// The bands of a stretch of row, and the heights between which its crown is, metres.
#[derive(Clone, Debug)]
pub(super) struct Stretch {
    pub(super) bands: Vec<BandSums>,
    pub(super) crown_m: Option<[f64; 2]>,
}

impl Stretch {
    fn new(count: usize) -> Self {
        Self { bands: vec![BandSums::default(); count], crown_m: None }
    }

    fn add(&mut self, bands: &[BandSums]) {
        self.bands.iter_mut().zip(bands).for_each(|(sum, band)| sum.add(band));
    }

    fn reach(&mut self, heights: &Histogram) {
        let Some(found_m) = crown_m(heights) else { return };
        let [base_m, top_m] = self.crown_m.unwrap_or(found_m);
        self.crown_m = Some([base_m.min(found_m[0]), top_m.max(found_m[1])]);
    }
}

/// Every band's part of every layer: of its height, and of the returns in it, or of its height where it has none.
fn each_part(
    ladder: &Ladder,
    open: &OpenSlice,
    layers: impl Iterator<Item = LayerSum>,
    mut each: impl FnMut(usize, &LayerSum, f64, f64),
) {
    for (layer, sum) in layers.enumerate() {
        for (band, part_m) in ladder.bands_of(sum.z_m) {
            let part = part_m / ladder.region.dz_m;
            each(band, &sum, part, open.share_of_layer(ladder, layer, band).unwrap_or(part));
        }
    }
}

fn crown_m(heights: &Histogram) -> Option<[f64; 2]> {
    Some([heights.percentile(BASE_SHARE)?, heights.percentile(TOP_SHARE)?])
}

/// The canopy by height, as far as the row was scanned.
#[derive(Clone, Debug)]
pub(crate) struct ByHeight {
    pub(super) ladder: Ladder,
    parameters: Parameters,
    open: OpenSlice,
    /// The open slice's bands, and how many columns from the row plane its layers have hits.
    slice: Vec<BandSums>,
    out: Vec<usize>,
    pub(super) row: Stretch,
    heights: Histogram,
    tree_heights: Histogram,
    trees: Vec<(i64, Stretch)>,
    pub(super) blocks: Blocks,
    pub(super) dropped: bool,
}

impl ByHeight {
    /// # Errors
    /// A band that is too low or too high.
    pub(crate) fn new(
        band_m: f64,
        voxels: &Voxels,
        frame: &Frame,
        parameters: &Parameters,
    ) -> Result<Self, PipelineError> {
        let ladder = Ladder::new(band_m, voxels.region(), frame)?;
        Ok(Self {
            open: OpenSlice::new(&ladder),
            slice: vec![BandSums::default(); ladder.count],
            out: vec![0; ladder.region.nz],
            row: Stretch::new(ladder.count),
            heights: Histogram::new(),
            tree_heights: Histogram::new(),
            trees: Vec::new(),
            blocks: Blocks::new(ladder.count),
            dropped: false,
            ladder,
            parameters: *parameters,
        })
    }

    /// Adds a line to the open slice.
    pub(crate) fn line(&mut self, sightings: &[Sighting], weight_m: f64) {
        for sighting in sightings {
            self.open.add(&self.ladder, sighting, weight_m);
            if let Some(contact) = sighting.canopy {
                self.heights.add(contact.z_m, weight_m);
                self.tree_heights.add(contact.z_m, weight_m);
            }
        }
    }

    /// Ends the slice between these faces, of this tree.
    pub(crate) fn close_slice(&mut self, voxels: &Voxels, [from_m, to_m]: [f64; 2], tree: Option<i64>) {
        self.slice.fill(BandSums::default());
        self.spread_layers(voxels);
        for band in 0..self.ladder.count {
            self.count_beams(band);
        }
        self.open.clear();
        self.row.add(&self.slice);
        self.blocks.add((from_m + to_m) / 2.0, &self.slice);
        let count = self.ladder.count;
        let place = tree.and_then(|tree| self.tree_at(tree, count));
        if let Some((_, stretch)) = place.and_then(|place| self.trees.get_mut(place)) {
            stretch.add(&self.slice);
        }
    }

    /// Ends a tree: what follows is of another one.
    pub(crate) fn close_tree(&mut self, tree: Option<i64>) {
        if let Some((_, stretch)) =
            tree.and_then(|tree| self.trees.iter_mut().rev().find(|(index, _)| *index == tree))
        {
            stretch.reach(&self.tree_heights);
        }
        self.tree_heights.clear();
    }

    /// Ends the row; lines may still follow.
    pub(crate) fn close(&mut self) {
        self.row.crown_m = crown_m(&self.heights);
    }

    /// The profile of a row of which nothing is told.
    pub(crate) fn nothing_told(&self) -> HeightProfile {
        HeightProfile { band_m: self.ladder.band_m, ..HeightProfile::default() }
    }

    /// What was measured of a tree.
    pub(super) fn tree(&self, tree: i64) -> Option<&Stretch> {
        let found = self.trees.binary_search_by_key(&tree, |(index, _)| *index);
        found.ok().and_then(|at| self.trees.get(at)).map(|(_, stretch)| stretch)
    }

    /// Whether the beams have a width.
    pub(super) fn have_width(&self) -> bool {
        self.parameters.footprint.is_some()
    }

    /// The most trees kept, if some were dropped.
    pub(crate) fn dropped(&self) -> Option<usize> {
        self.dropped.then_some(MOST_TREES)
    }

    /// The place of a tree's sums; new ones come in ascending order.
    fn tree_at(&mut self, tree: i64, count: usize) -> Option<usize> {
        if self.trees.last().is_none_or(|(last, _)| *last < tree) {
            if self.trees.len() >= MOST_TREES {
                self.dropped = true;
                return None;
            }
            self.trees.push((tree, Stretch::new(count)));
        }
        self.trees.binary_search_by_key(&tree, |(index, _)| *index).ok()
    }

    /// Shares the open slice's layers out to bands: leaf areas by where in the layer beams ended, space by how far the layer reaches into the band.
    fn spread_layers(&mut self, voxels: &Voxels) {
        let Self { ladder, parameters, open, slice, out, .. } = self;
        let min_beams = voxels.min_beams();
        let per_density_m2 = voxels.volume_m3() / parameters.projection;
        let of_hits = |voxel: &Voxel| density(voxel, min_beams);
        let leaf_m2 = |sum: &LayerSum| (sum.density + sum.filled) * per_density_m2;
        each_part(ladder, open, voxels.layers(of_hits), |band, sum, part, share| {
            if let Some(of_band) = slice.get_mut(band) {
                of_band.contact_m2 += leaf_m2(sum) * share;
                of_band.reached += f64::from(sum.visited) * part;
            }
        });
        if parameters.remission.is_some() {
            let of_shares = voxels.layers(|voxel| voxel.share_frequency(min_beams));
            each_part(ladder, open, of_shares, |band, sum, _, share| {
                if let Some(of_band) = slice.get_mut(band) {
                    of_band.share_m2 += leaf_m2(sum) * share;
                }
            });
        }
        for (layer, (voxels_of, above)) in voxels.bare_layers().enumerate() {
            let hit = voxels_of.iter().enumerate().filter(|(_, voxel)| voxel.hits_m > 0.0);
            let columns_out = hit.map(|(column, _)| ladder.columns_out(column)).max().unwrap_or(0);
            if let Some(out) = out.get_mut(layer) {
                *out = columns_out;
            }
            let space = ladder.columns_within(columns_out);
            let (mut whole, mut visited) = (0.0, 0.0);
            for (voxel, above) in
                voxels_of.get(space.clone()).into_iter().flatten().zip(above.get(space).into_iter().flatten())
            {
                whole += above;
                visited += if of_hits(voxel).is_some() { *above } else { 0.0 };
            }
            for (band, part_m) in ladder.bands_of(ladder.layer_m(layer)) {
                let part_m3 = voxels.volume_m3() * part_m / ladder.region.dz_m;
                if let Some(of_band) = slice.get_mut(band) {
                    of_band.volume_m3 += whole * part_m3;
                    of_band.visited_m3 += visited * part_m3;
                }
            }
        }
    }

    /// Counts the open slice's passages through a band's canopy space: as far out as any of its layers, or a beam that ended in the band.
    fn count_beams(&mut self, band: usize) {
        let Self { ladder, open, slice, out, .. } = self;
        let [low_m, high_m] = ladder.edges_m(band);
        let (low, high) = (ladder.layer(low_m + 1e-9), ladder.layer(high_m - 1e-9));
        let of_layers = out.get(low..=high).into_iter().flatten().copied().max().unwrap_or(0);
        let space = ladder.columns_within(of_layers.max(open.columns_out(ladder, band)));
        let (passages, ended) = if space.is_empty() { (0.0, 0.0) } else { open.passages(band, space) };
        let at = |sums: &[f64]| sums.get(band).copied().unwrap_or(0.0);
        if let Some(of_band) = slice.get_mut(band) {
            (of_band.passages, of_band.ended) = (passages, ended);
            (of_band.aimed, of_band.through) = (at(&open.aimed), at(&open.through));
            of_band.impacted_m2 = at(&open.impacted_m2);
        }
    }

    /// Bands up to the highest one in which the row has canopy.
    pub(super) fn height(&self) -> usize {
        let holds = |band: &BandSums| band.contact_m2 > 0.0 || band.impacted_m2 > 0.0;
        self.row.bands.iter().rposition(holds).map_or(0, |band| band + 1)
    }
}
