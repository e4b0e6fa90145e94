//! Organs as a scanner would meet them if none hid another: how much of each patch of surface the beams meet.

use rowscan_protocol::rig::Mount;
use rowscan_scenes::patches::Patch;

/// Where the mirror passes the row.
#[derive(Clone, Copy, Debug)]
pub(super) struct Eye {
    distance_m: f64,
    height_m: f64,
}

/// What beams meet of a patch.
#[derive(Clone, Copy, Debug)]
pub(super) struct Met {
    /// Its middle, metres.
    pub(super) at: [f64; 3],
    /// The area that it turns to the beams, m².
    pub(super) facing_m2: f64,
    /// Its distance from the mirror, metres.
    range_m: f64,
}

impl Met {
    /// The returns that it gives, in any unit: beams of equal angle lie farther apart where they are longer.
    pub(super) fn returns(&self) -> f64 {
        self.facing_m2 / self.range_m
    }
}

impl Eye {
    pub(super) fn of(mount: &Mount) -> Self {
        Self { distance_m: mount.distance_m, height_m: mount.height_m }
    }

    /// A patch of a blade: either face stops beams.
    pub(super) fn blade(self, patch: &Patch) -> Option<Met> {
        self.meet(patch, f64::abs)
    }

    /// A patch of a branch: the far side is hidden by the near one.
    pub(super) fn branch(self, patch: &Patch) -> Option<Met> {
        self.meet(patch, |cosine| (-cosine).max(0.0))
    }

    /// Scan planes stand across the row, so beams have no part along it.
    fn meet(self, patch: &Patch, turned: fn(f64) -> f64) -> Option<Met> {
        let (ahead, up) = (patch.at[0] + self.distance_m, patch.at[2] - self.height_m);
        let range_m = ahead.hypot(up);
        let cosine = (ahead * patch.normal[0] + up * patch.normal[2]) / range_m;
        let facing_m2 = patch.area_m2 * turned(cosine);
        (range_m > 0.0 && facing_m2 != 0.0).then_some(Met { at: patch.at, facing_m2, range_m })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_scenes::patches::{of_blade, of_branch};
    use rowscan_scenes::{Cylinder, Leaf};

    #[test]
    fn a_wall_turns_its_cosine_to_the_beams() {
        // In the row plane, from 1.5 m up to 3.5 m: ∫ 2 / hypot(2, z) dz over 0 to 2, a metre long.
        let eye = Eye { distance_m: 2.0, height_m: 1.5 };
        let corners = [[0.0, 0.0, 1.5], [0.0, 1.0, 1.5], [0.0, 1.0, 3.5], [0.0, 0.0, 3.5]];
        let mut facing_m2 = 0.0;
        of_blade(&Leaf::new(corners).expect("a wall"), |patch| {
            facing_m2 += eye.blade(&patch).map_or(0.0, |met| met.facing_m2);
        });
        assert!((facing_m2 / (2.0 * 1.0f64.asinh()) - 1.0).abs() < 1e-3, "{facing_m2}");
    }

    #[test]
    fn a_branch_turns_its_width_to_the_beams() {
        let far = Eye { distance_m: 1e4, height_m: 1.5 };
        let facing_m2 = |tip: [f64; 3]| {
            let (mut sum_m2, mut nearest_m): (f64, f64) = (0.0, 0.0);
            of_branch(&Cylinder::new([0.0, 0.0, 1.0], tip, 0.05).expect("a branch"), |patch| {
                if let Some(met) = far.branch(&patch) {
                    sum_m2 += met.facing_m2;
                    nearest_m = nearest_m.max(-met.at[0]);
                }
            });
            assert!(nearest_m > 0.02, "the surface is met and not the axis: {nearest_m}");
            sum_m2
        };
        // 12 patches about it: within 2.5 % of a circle's width.
        let along = facing_m2([0.0, 2.0, 1.0]);
        assert!((along / 0.2 - 1.0).abs() < 0.025, "{along}");
        let aslant = facing_m2([1.0, 0.0, 2.0]);
        assert!((aslant / 0.1 - 1.0).abs() < 0.025, "at 45° a branch of √2 m looks 1 m long: {aslant}");
    }
}
