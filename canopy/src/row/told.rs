//! What a row is asked to measure besides its leaf area, and what came of it.

use super::Row;
use crate::by_height::ByHeight;
use crate::cut::{CutMethod, FoundTree, Profile};
use crate::error::PipelineError;
use crate::estimate::TreesFound;
use crate::estimator::{Measure, Stretch};
use crate::geometry::Frame;
use crate::leaf::Withheld;
use crate::trees::Cut;

impl Row {
    /// Measures by bands of this height too, from the next line on.
    ///
    /// # Errors
    /// A band that is too low or too high.
    pub(crate) fn profile_by_height(&mut self, band_m: f64) -> Result<(), PipelineError> {
        let by_height = ByHeight::new(band_m, &self.voxels, &self.frame, &self.parameters)?;
        self.by_height = Some(Box::new(by_height));
        Ok(())
    }

    /// The canopy by height, if it is measured.
    pub(crate) fn by_height(&self) -> Option<&ByHeight> {
        self.by_height.as_deref()
    }

    /// What the estimators say of the row.
    pub(crate) fn measures(&self, scanned_m: f64) -> Vec<Measure> {
        self.estimators.of_row(&Stretch::new(scanned_m, self.row_spacing_m))
    }

    /// What the estimators say of a tree.
    pub(crate) fn tree_measures(&self, tree: i64) -> &[Measure] {
        self.estimators.of_tree(tree)
    }

    /// The trees the data show.
    pub(crate) fn trees_found(&self, leaves: Result<(), Withheld>) -> Vec<TreesFound> {
        let told = |tree: FoundTree| FoundTree {
            leaf_area_contact_raw_m2: tree.leaf_area_contact_raw_m2.filter(|_| leaves.is_ok()),
            ..tree
        };
        let found = |(method, profile): (&CutMethod, &Profile)| TreesFound {
            method: *method,
            trees: profile.cut(*method, self.tree_spacing_m).into_iter().map(told).collect(),
        };
        self.find.iter().filter_map(|method| Some((method, self.profile.as_ref()?))).map(found).collect()
    }

    pub(crate) fn frame(&self) -> &Frame {
        &self.frame
    }

    pub(crate) fn cut(&self) -> &Cut {
        &self.cut
    }

    pub(crate) fn has_far_gate(&self) -> bool {
        self.frame.far_gate_m.is_finite()
    }
}
