//! A profile as it is written: lines of bands, with the truth beside them where it is asked for.

use rowscan_canopy::{BandEstimate, Estimate, HeightProfile};
use serde::Serialize;

use crate::height_truth::TruthByBand;

/// A profile, each band beside its truth if that was asked for. Its keys are those of [`HeightProfile`].
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ProfileBeside {
    /// Height of a band, metres.
    pub band_m: f64,
    /// Whether the truth was asked for.
    #[serde(skip)]
    pub asks_truth: bool,
    /// Of the row.
    pub row: Vec<BandBeside>,
    /// Of each tree, in the order of travel.
    pub trees: Vec<TreeBeside>,
}

/// The bands of one tree.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct TreeBeside {
    /// Index of the tree.
    pub tree: u32,
    /// From the ground up.
    pub bands: Vec<BandBeside>,
}

/// A band, and what is really there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct BandBeside {
    /// The band.
    #[serde(flatten)]
    pub band: BandEstimate,
    /// Its truth; left out where nobody asked for it.
    #[serde(flatten)]
    pub truth: Option<BandTruth>,
}

/// What is really there of a band.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct BandTruth {
    /// One-sided leaf area, m²; null where the scene is unknown, and of a tree that was not scanned from end to end.
    pub truth_leaf_area_m2: Option<f64>,
    /// (leaf area − truth) / truth; null too of a band with less than a thousandth of the mean truth.
    pub error: Option<f64>,
}

/// Where the truth of bands is from.
#[derive(Clone, Copy, Debug)]
pub enum Asked<'a> {
    /// Nobody asked for it.
    No,
    /// It was asked for, and the scene is not known.
    Unknown,
    /// This.
    Known(&'a TruthByBand),
}

impl ProfileBeside {
    /// True if the row's truth was asked for, and none is known.
    pub fn lacks_truth(&self) -> bool {
        let is_unknown =
            |band: &BandBeside| band.truth.is_some_and(|truth| truth.truth_leaf_area_m2.is_none());
        self.row.iter().any(is_unknown) && self.row.iter().all(is_unknown)
    }

    /// The profile of an estimate, if it has one.
    pub fn of(estimate: &Estimate, asked: Asked<'_>) -> Option<Self> {
        let HeightProfile { band_m, row, trees } = estimate.profile.as_ref()?;
        let truth_of_row = match asked {
            Asked::Known(truth) => truth.of_row(estimate, row.len()),
            Asked::No | Asked::Unknown => None,
        };
        let of_tree = |number: u32, bands: usize| {
            let complete = estimate.trees.iter().any(|tree| tree.tree == number && tree.complete);
            match asked {
                Asked::Known(truth) if complete => truth.of_tree(number, bands),
                Asked::Known(_) | Asked::No | Asked::Unknown => None,
            }
        };
        Some(Self {
            band_m: *band_m,
            asks_truth: !matches!(asked, Asked::No),
            row: beside(row, truth_of_row, asked),
            trees: trees
                .iter()
                .map(|told| TreeBeside {
                    tree: told.tree,
                    bands: beside(&told.bands, of_tree(told.tree, told.bands.len()), asked),
                })
                .collect(),
        })
    }
}

/// Of bands with less than this share of the mean truth an error says nothing: a twig that reaches into the next band.
const LEAST_TRUTH: f64 = 1e-3;

fn beside(bands: &[BandEstimate], truth_m2: Option<Vec<f64>>, asked: Asked<'_>) -> Vec<BandBeside> {
    let least_m2 =
        truth_m2.as_ref().map_or(0.0, |truth_m2| LEAST_TRUTH * rowscan_canopy::regression::mean(truth_m2));
    let one = |(number, band): (usize, &BandEstimate)| {
        let truth_leaf_area_m2 = truth_m2.as_ref().and_then(|truth_m2| truth_m2.get(number)).copied();
        let told_of = truth_leaf_area_m2.filter(|truth_m2| *truth_m2 > least_m2);
        let error = band.leaf_area_m2.zip(told_of).map(|(found, truth)| (found - truth) / truth);
        let error = error.filter(|error| error.is_finite());
        let truth = match asked {
            Asked::No => None,
            Asked::Unknown | Asked::Known(_) => Some(BandTruth { truth_leaf_area_m2, error }),
        };
        BandBeside { band: *band, truth }
    };
    bands.iter().enumerate().map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_band_with_next_to_no_leaves_has_a_truth_and_no_error() {
        let band = BandEstimate { leaf_area_m2: Some(0.5), ..BandEstimate::default() };
        let told = beside(&[band; 4], Some(vec![1.0, 0.5, 2e-6, 0.0]), Asked::Unknown);
        let truths: Vec<BandTruth> = told.into_iter().filter_map(|band| band.truth).collect();
        let errors: Vec<Option<f64>> = truths.iter().map(|truth| truth.error).collect();
        assert_eq!(errors, [Some(-0.5), Some(0.0), None, None]);
        assert_eq!(truths[2].truth_leaf_area_m2, Some(2e-6));
    }
}
