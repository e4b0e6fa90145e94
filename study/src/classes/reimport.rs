//! Grown trees exported as text, their leaves changed, and imported again: another generator's trees in the same places.

use rowscan_emulator::stage::Stage;
use rowscan_scenes::exchange::text::{TreeColumn, write_branches, write_leaves};
use rowscan_scenes::import::Stands;
use rowscan_scenes::parameters::SceneFile;
use rowscan_scenes::{GeneratorKind, Leaf, Orchard, Scene, Tree};
use serde::{Deserialize, Serialize};

/// What becomes of the leaves.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Reimport {
    /// Factor on length and width about the foot.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 10.0), example = 0.75)]
    pub leaf_scale: f64,
    /// Degrees by which a leaf is turned about the level line in it, towards upright; it goes no farther than upright.
    #[schemars(range(min = 0.0, max = 90.0), example = 25.0)]
    pub tilt_deg: f64,
}

impl Reimport {
    /// Why it cannot be done.
    pub(super) fn refusal(&self) -> Option<String> {
        let Self { leaf_scale, tilt_deg } = *self;
        if !(leaf_scale > 0.0 && leaf_scale <= 10.0) {
            return Some(format!("reimport.leaf_scale: expected above 0, up to 10, found {leaf_scale}"));
        }
        (!(0.0..=90.0).contains(&tilt_deg))
            .then(|| format!("reimport.tilt_deg: expected from 0 to 90, found {tilt_deg}"))
    }

    /// A scene with this stage's trees as files.
    pub(crate) fn scene(&self, stage: &Stage) -> Scene {
        let orchard = &stage.orchard;
        let changed = |tree: &Tree| Tree {
            leaves: tree.leaves.iter().map(|leaf| self.leaf(leaf)).collect(),
            ..tree.clone()
        };
        let trees: Vec<Tree> = orchard.trees().map(|tree| changed(&tree)).collect();
        let changed =
            Orchard::from_trees(trees, orchard.length_m(), orchard.tree_spacing_m(), orchard.row_spacing_m());
        let file = |name: &str, text: String| SceneFile::with_content(name, text.into_bytes());
        let mut scene = stage.scene.clone();
        // Already dressed and thinned.
        scene.orchard.season = rowscan_scenes::season::Season::FullLeaf;
        scene.orchard.target_lai = None;
        scene.orchard.generator = Some(GeneratorKind::Import);
        scene.orchard.import.stands = Stands::InPlace;
        scene.orchard.import.leaves =
            Some(file("grown-leaves.txt", write_leaves(&changed, TreeColumn::Written)));
        scene.orchard.import.branches =
            Some(file("grown-branches.txt", write_branches(&changed, TreeColumn::Written)));
        scene
    }

    /// A leaf, changed; as it is where it would have no area.
    fn leaf(&self, leaf: &Leaf) -> Leaf {
        let scaled = leaf.scaled(self.leaf_scale).unwrap_or_else(|_| leaf.clone());
        let [nx, ny, nz] = scaled.normal();
        let level = nx.hypot(ny);
        let Some([fx, fy, fz]) = scaled.outline().first().copied() else { return scaled };
        let here_deg = level.atan2(nz.abs()).to_degrees();
        let by = (here_deg + self.tilt_deg).clamp(0.0, 90.0) - here_deg;
        if level == 0.0 || by == 0.0 {
            return scaled;
        }
        // About the level line through the foot; the normal's upper side sinks towards where it leans.
        let up = nz.signum();
        let [ax, ay] = [-up * ny / level, up * nx / level];
        let (sin, cos) = by.to_radians().sin_cos();
        let turned = scaled.outline().iter().map(|[x, y, z]| {
            let (x, y, z) = (x - fx, y - fy, z - fz);
            let along = ax * x + ay * y;
            // Rodrigues: v cos + (a × v) sin + a (a · v)(1 − cos).
            let cross = [ay * z, -ax * z, ax * y - ay * x];
            [
                fx + x * cos + cross[0] * sin + ax * along * (1.0 - cos),
                fy + y * cos + cross[1] * sin + ay * along * (1.0 - cos),
                fz + z * cos + cross[2] * sin,
            ]
        });
        Leaf::new(turned.collect::<Vec<_>>()).unwrap_or(scaled)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn leaf() -> Leaf {
        // Rises by 30° towards +X.
        let rise = 30f64.to_radians();
        let at = |u: f64, y: f64| [1.0 + u * rise.cos(), y, 2.0 + u * rise.sin()];
        Leaf::new([at(0.0, 0.0), at(0.1, 0.0), at(0.1, 0.05), at(0.0, 0.05)]).expect("a leaf")
    }

    fn inclination_deg(leaf: &Leaf) -> f64 {
        leaf.normal()[2].abs().acos().to_degrees()
    }

    #[test]
    fn a_leaf_is_tilted_and_scaled_about_its_foot() {
        for tilt_deg in [25.0, -10.0, 90.0] {
            let changed = Reimport { leaf_scale: 0.5, tilt_deg }.leaf(&leaf());
            assert!((changed.area_m2() - 0.25 * leaf().area_m2()).abs() < 1e-12);
            assert!((inclination_deg(&changed) - (30.0f64 + tilt_deg).min(90.0)).abs() < 1e-6);
            let (foot, was) = (changed.outline()[0], leaf().outline()[0]);
            assert!(foot.iter().zip(was).all(|(a, b)| (a - b).abs() < 1e-12));
        }
    }
}
