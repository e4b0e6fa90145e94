//! What is built in an orchard and does not grow: posts and wires.

use crate::orchard::layout::Layout;
use crate::organ::Cylinder;
use crate::parameters::{ParameterError, parameters, require};

/// What kind of support.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SupportKind {
    /// Stands upright.
    Post,
    /// Runs along the row.
    Wire,
}

/// A post or a wire.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Support {
    /// Which of the two.
    pub kind: SupportKind,
    /// Where it is, and how thick.
    pub shape: Cylinder,
}

impl Support {
    /// The same elsewhere.
    #[must_use]
    pub fn translated(&self, by: [f64; 3]) -> Self {
        Self { kind: self.kind, shape: self.shape.translated(by) }
    }
}

parameters! {
    /// A trellis in every row: posts on the row axis, midway between trees, and wires between them.
    pub struct Trellis;
    /// A trellis of which every value may be left to the preset: the `[orchard.trellis]` table of a scene file.
    pub overrides TrellisOverrides;

    /// Trees from one post to the next; 0 for no posts.
    post_every: u32 = 0, "trees", "8 to 10 m between posts in walls of 1 m spacing";
    /// Height of a post above the ground.
    post_height_m: f64 = 3.2, "m", "a little above the top wire";
    /// Diameter of a post.
    post_diameter_m: f64 = 0.09, "m", "round timber of 80 to 100 mm";
    /// Height of a stake beside every tree; 0 for none.
    stake_height_m: f64 = 0.0, "m", "single stakes of 2 to 2.5 m; none where the source names none";
    /// Diameter of a stake.
    stake_diameter_m: f64 = 0.05, "m", "round timber of 40 to 60 mm";
    /// From the trunk to its stake along the row, middle to middle.
    stake_offset_m: f64 = 0.1, "m", "beside the trunk";
    /// Lowest wire above the ground.
    wire_from_m: f64 = 0.6, "m", "above the graft, below the first tier";
    /// From one wire to the next.
    wire_step_m: f64 = 0.6, "m", "four to five tiers";
    /// Wires, one above the other; 0 for none.
    wires: u32 = 0, "wires", "four to five in fruiting walls";
    /// Diameter of a wire.
    wire_diameter_m: f64 = 0.0025, "m", "galvanised wire of 2 to 3 mm";
    /// Posts and wires stand this far from the row axis, towards +X.
    offset_m: f64 = 0.0, "m", "on the axis; trees are tied to the wires";
}

impl Trellis {
    /// Checks all values.
    ///
    /// # Errors
    /// The first key with an invalid value, and the values allowed.
    pub fn validate(&self) -> Result<(), ParameterError> {
        let within = |name: &str, value: f64, low: f64, high: f64| {
            let expected = format!("a number from {low} to {high}");
            require((low..=high).contains(&value), &format!("orchard.trellis.{name}"), &expected, value)
        };
        require(self.wires <= 100, "orchard.trellis.wires", "0 to 100", self.wires)?;
        within("post_height_m", self.post_height_m, 0.01, 20.0)?;
        within("post_diameter_m", self.post_diameter_m, 1e-4, 2.0)?;
        within("stake_height_m", self.stake_height_m, 0.0, 20.0)?;
        within("stake_diameter_m", self.stake_diameter_m, 1e-4, 2.0)?;
        within("stake_offset_m", self.stake_offset_m, -10.0, 10.0)?;
        within("wire_from_m", self.wire_from_m, 0.0, 20.0)?;
        within("wire_step_m", self.wire_step_m, 1e-3, 20.0)?;
        within("wire_diameter_m", self.wire_diameter_m, 1e-5, 0.1)?;
        within("offset_m", self.offset_m, -10.0, 10.0)
    }

    /// Heights of the wires above the ground, metres, from the lowest up.
    pub(crate) fn wire_heights_m(&self) -> impl Iterator<Item = f64> + use<'_> {
        (0..self.wires).map(|wire| self.wire_from_m + f64::from(wire) * self.wire_step_m)
    }

    /// Posts and wires of all rows, row by row, in the scene frame. A wire is as long as the row's period.
    pub(crate) fn build(&self, layout: &Layout) -> Vec<Support> {
        let length_m = f64::from(layout.trees) * layout.tree_spacing_m;
        let mut supports = Vec::new();
        for row in 0..layout.rows {
            let x_m = f64::from(row) * layout.row_spacing_m + self.offset_m;
            let posts = (0..layout.trees).step_by(self.post_every.max(1) as usize);
            for place in posts.take(if self.post_every > 0 { usize::MAX } else { 0 }) {
                let y_m = f64::from(place) * layout.tree_spacing_m;
                let (foot, top) = ([x_m, y_m, 0.0], [x_m, y_m, self.post_height_m]);
                let shape = Cylinder::new(foot, top, self.post_diameter_m / 2.0);
                supports.extend(shape.ok().map(|shape| Support { kind: SupportKind::Post, shape }));
            }
            supports.extend(self.stakes(layout, x_m));
            for z_m in self.wire_heights_m() {
                let shape = Cylinder::new([x_m, 0.0, z_m], [x_m, length_m, z_m], self.wire_diameter_m / 2.0);
                supports.extend(shape.ok().map(|shape| Support { kind: SupportKind::Wire, shape }));
            }
        }
        supports
    }

    /// A stake beside every place of a row at `x_m`.
    fn stakes(&self, layout: &Layout, x_m: f64) -> impl Iterator<Item = Support> {
        let &Self { stake_height_m, stake_diameter_m, stake_offset_m, .. } = self;
        let (places, spacing_m) = (layout.trees, layout.tree_spacing_m);
        (0..if stake_height_m > 0.0 { places } else { 0 }).filter_map(move |place| {
            let y_m = (f64::from(place) + 0.5) * spacing_m + stake_offset_m;
            let shape = Cylinder::new([x_m, y_m, 0.0], [x_m, y_m, stake_height_m], 0.5 * stake_diameter_m);
            shape.ok().map(|shape| Support { kind: SupportKind::Post, shape })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn posts_stand_between_trees_and_wires_run_the_whole_row() {
        let layout =
            Layout { rows: 2, trees: 5, tree_spacing_m: 1.0, row_spacing_m: 3.5, ..Layout::default() };
        assert!(Trellis::default().build(&layout).is_empty());
        let trellis = Trellis { post_every: 2, wires: 3, ..Trellis::default() };
        trellis.validate().unwrap();
        let supports = trellis.build(&layout);
        let of = |kind| supports.iter().filter(|s| s.kind == kind).map(|s| s.shape).collect::<Vec<_>>();
        let feet: Vec<[f64; 3]> = of(SupportKind::Post).iter().map(Cylinder::base).collect();
        assert_eq!(feet[..3], [[0.0; 3], [0.0, 2.0, 0.0], [0.0, 4.0, 0.0]]);
        assert_eq!((feet.len(), feet[3]), (6, [3.5, 0.0, 0.0]));
        let wires = of(SupportKind::Wire);
        assert_eq!((wires.len(), wires[1].tip()), (6, [0.0, 5.0, 1.2]));
        assert!(Trellis { wires: 101, ..trellis }.validate().is_err());
    }
}
