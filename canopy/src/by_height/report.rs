//! From sums to the profile: leaf areas by the row's law, intervals by its blocks.

use super::sums::{ByHeight, Stretch};
use super::told::{BandEstimate, HeightProfile, TreeBands};
use super::unsure::{Shared, Unsure, ends_m2};
use crate::estimate::{Estimate, TreeEstimate};
use crate::leaf::{Count, Law};
use crate::pieces::RowSds;
use crate::uncertainty::blocks::FEWEST;
use crate::warning::Warning;

/// Fills in the profile of an estimate whose row and trees are told already.
pub(crate) fn tell(estimate: &mut Estimate, by_height: &ByHeight, law: &Law<'_>, row: RowSds) {
    let count = law.counted().count;
    let of_row = Told { by_height, count, scale: law.factor().ok(), row, times: 1.0 };
    let trees = estimate.trees.iter().filter_map(|tree| {
        let sums = by_height.tree(i64::from(tree.tree))?;
        let scale = scale_of_tree(tree, sums, count);
        // A stretch of the row scatters more than the row, by the root of how much shorter it is.
        let times = estimate.scanned_m.map_or(1.0, |row_m| (row_m / tree.scanned_m).max(1.0).sqrt());
        Some(TreeBands { tree: tree.tree, bands: Told { scale, times, ..of_row }.bands(sums) })
    });
    let profile = HeightProfile {
        band_m: by_height.ladder.band_m,
        row: of_row.bands(&by_height.row),
        trees: trees.collect(),
    };
    let blocks = &by_height.blocks;
    let told = estimate.warnings.iter().any(|warning| matches!(warning, Warning::TooFewBlocks { .. }));
    if !blocks.are_enough() && !told {
        let (blocks, expected) = (blocks.count(), FEWEST);
        estimate.warnings.push(Warning::TooFewBlocks { blocks, expected });
    }
    let already = estimate.warnings.iter().any(|warning| matches!(warning, Warning::TooManyCells { .. }));
    if let Some(kept) = by_height.dropped().filter(|_| !already) {
        estimate.warnings.push(Warning::TooManyCells { kept });
    }
    estimate.profile = Some(profile);
}

/// What a tree's raw leaf areas are multiplied by, that its bands add up to what is told of it; `None` where nothing is.
fn scale_of_tree(tree: &TreeEstimate, sums: &Stretch, count: Count) -> Option<f64> {
    let told_m2 = tree.leaf.areas.best_m2().ok()?;
    let raw_m2: f64 = sums.bands.iter().map(|band| band.raw_m2(count)).sum();
    Some(if raw_m2 > 0.0 { told_m2 / raw_m2 } else { 0.0 })
}

/// How a stretch of the row is told.
#[derive(Clone, Copy)]
struct Told<'a> {
    by_height: &'a ByHeight,
    count: Count,
    /// What raw leaf areas are multiplied by; `None` where they are withheld.
    scale: Option<f64>,
    row: RowSds,
    /// By how much more it scatters than the row.
    times: f64,
}

impl Told<'_> {
    fn bands(&self, of: &Stretch) -> Vec<BandEstimate> {
        let bands = of.bands.get(..self.by_height.height()).unwrap_or_default();
        // Of a band that no beam came to nothing is known.
        let leaf_m2: Vec<Option<f64>> = bands
            .iter()
            .map(|band| Some(self.scale? * band.raw_m2(self.count)).filter(|_| band.reached > 0.0))
            .collect();
        let told = bands.iter().enumerate().map(|(number, band)| {
            let [from_m, to_m] = self.by_height.ladder.edges_m(number);
            let unsure = self.unsure(number, &leaf_m2);
            let leaf_area_m2 = leaf_m2.get(number).copied().flatten();
            let ends = |row_sd: Option<f64>| Some(ends_m2(leaf_area_m2?, row_sd?, unsure?));
            let middle_m = (from_m + to_m) / 2.0;
            let in_crown = of.crown_m.is_some_and(|[base_m, top_m]| (base_m..=top_m).contains(&middle_m));
            let share = |part: f64, whole: f64| (whole > 0.0).then(|| (part / whole).clamp(0.0, 1.0));
            BandEstimate {
                from_m,
                to_m,
                leaf_area_m2,
                leaf_area_interval_m2: leaf_area_m2
                    .zip(ends(self.row.all))
                    .map(|(leaf_m2, ends)| self.row.shifted(ends, leaf_m2)),
                leaf_area_sampling_error_m2: ends(self.row.sampling),
                density_m2_per_m3: leaf_area_m2
                    .filter(|_| band.volume_m3 > 0.0)
                    .map(|leaf_m2| leaf_m2 / band.volume_m3),
                volume_m3: band.volume_m3,
                gap_fraction: share(band.passages - band.ended, band.passages),
                porosity: share(band.through, band.aimed).filter(|_| in_crown),
                visited: share(band.visited_m3, band.volume_m3),
            }
        });
        told.collect()
    }

    /// How sure a band is beside its row; `None` where the row has too few blocks to tell.
    fn unsure(&self, band: usize, leaf_m2: &[Option<f64>]) -> Option<Unsure> {
        let blocks = &self.by_height.blocks;
        if !blocks.are_enough() {
            return None;
        }
        let at =
            |band: Option<usize>| band.and_then(|band| leaf_m2.get(band).copied().flatten()).unwrap_or(0.0);
        Some(Unsure {
            shared: Shared::of(self.by_height.have_width(), self.by_height.ladder.band_m),
            sampling: self.times * blocks.relative_sd(band, self.count).unwrap_or(0.0),
            neighbours_m2: [at(band.checked_sub(1)), at(Some(band + 1))],
            mean_m2: leaf_m2.iter().flatten().sum::<f64>() / leaf_m2.len().max(1) as f64,
        })
    }
}
