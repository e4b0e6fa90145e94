//! Orchard tables with what a preset leaves unsaid written out.

use super::OrchardParameters;

impl OrchardParameters {
    /// The same orchard, each value written out that the preset gives.
    #[must_use]
    pub fn spelled_out(&self) -> Self {
        let layout = self.layout();
        Self {
            rows: Some(layout.rows),
            trees: Some(layout.trees),
            tree_spacing_m: Some(layout.tree_spacing_m),
            row_spacing_m: Some(layout.row_spacing_m),
            row_ends: Some(layout.row_ends),
            distinct_trees: Some(layout.distinct_trees),
            directions: Some(layout.directions),
            generator: Some(self.generator()),
            tree: self.tree_parameters().as_overrides(),
            training: self.training_parameters().as_overrides(),
            lsystem: self.lsystem_parameters().as_overrides(),
            analytic: self.analytic_parameters().as_overrides(),
            trellis: self.trellis_parameters().as_overrides(),
            ground: self.ground_parameters().as_overrides(),
            ..self.clone()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::orchard::Preset;

    #[test]
    fn what_is_spelled_out_means_the_same() {
        for preset in Preset::ALL {
            let orchard = OrchardParameters::of(*preset);
            let spelled_out = orchard.spelled_out();
            assert_eq!(spelled_out.layout(), orchard.layout());
            assert_eq!(spelled_out.tree_parameters(), orchard.tree_parameters());
            assert_eq!(spelled_out.training_parameters(), orchard.training_parameters());
            assert_eq!(spelled_out.trellis_parameters(), orchard.trellis_parameters());
            assert_eq!(spelled_out.spelled_out(), spelled_out);
        }
    }
}
