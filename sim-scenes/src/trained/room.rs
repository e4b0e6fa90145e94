//! The room a trained tree is cut back to in winter.

use glam::DVec3;

use super::parameters::TrainingParameters;
use crate::angle::cos_sin_deg;
use crate::growth::TreeParameters;

/// Half widths that fall from the clear trunk to the top, round or flat-sided, and a hollow cone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Room {
    clear_m: f64,
    pub(super) top_m: f64,
    half_width_m: f64,
    top_half_width_m: f64,
    half_length_m: f64,
    is_round: bool,
    hollow: Option<(f64, f64)>,
}

impl Room {
    pub(super) fn of(training: &TrainingParameters, tree: &TreeParameters) -> Self {
        let or_else = |value: f64, fallback: f64| if value > 0.0 { value } else { fallback };
        let half_width_m = tree.envelope_half_width_m;
        let hollow = (tree.hollow_deg > 0.0).then(|| {
            let (cos, sin) = cos_sin_deg(tree.hollow_deg);
            (tree.hollow_from_m, sin / cos)
        });
        Self {
            clear_m: tree.clear_trunk_m,
            top_m: tree.envelope_top_m,
            half_width_m,
            top_half_width_m: or_else(tree.envelope_top_half_width_m, half_width_m),
            half_length_m: or_else(tree.envelope_half_length_m, half_width_m),
            is_round: !training.form.is_flat(),
            hollow,
        }
    }

    /// How far out of the room a point is: 1 on its border, less within. `ease` widens it.
    fn out(&self, point: DVec3, ease: f64) -> f64 {
        let up = ((point.z - self.clear_m) / (self.top_m - self.clear_m)).clamp(0.0, 1.0);
        let half_m = self.half_width_m + (self.top_half_width_m - self.half_width_m) * up;
        // A cone is as slender along the row as across it; a flat side is as long at its top as at its foot.
        let long_m = self.half_length_m * if self.is_round { half_m / self.half_width_m } else { 1.0 };
        let (x, y) = (point.x.abs() / half_m, point.y.abs() / long_m);
        let level = if self.is_round { x.hypot(y) } else { x.max(y) };
        level / ease
    }

    /// True where wood and leaves may stay; `ease` widens the sides.
    pub(super) fn holds(&self, point: DVec3, ease: f64) -> bool {
        let in_hollow = self.hollow.is_some_and(|(apex_m, slope)| {
            let up_m = point.z - apex_m;
            up_m > 0.0 && point.x.hypot(point.y) < slope * up_m
        });
        point.z >= self.clear_m && point.z <= self.top_m && !in_hollow && self.out(point, ease) <= 1.0
    }
}
