//! How thick axes are: the pipe model over living wood; wood never becomes thinner.

use super::System;
use super::axis::{Plant, Role};
use crate::growth::wood::terminal_radius_m;

/// Radius of a spur's wood, metres: a few annual rings of short shoots.
pub(super) const SPUR_RADIUS_M: f64 = 0.003;

/// Gives every piece its radius: r^e is the sum of r^e over what stands on it (Shinozaki; exponent of `[orchard.tree]`), not less than
/// last season's, than the wood floor, or, on the leader, than the floor of the trunk less its share of the height.
pub(super) fn thicken(plant: &mut Plant, season: u32, system: &System) {
    let tree = &system.tree;
    let exponent = tree.pipe_exponent;
    let pipe = |radius_m: f64| libm::pow(radius_m, exponent);
    let spur = pipe(SPUR_RADIUS_M.min(tree.terminal_radius_long_m));
    // By axis: pipes of what it bears, with the length at which they join.
    let mut borne: Vec<Vec<(f64, f64)>> = vec![Vec::new(); plant.axes.len()];
    for number in (0..plant.axes.len()).rev() {
        let Some(axis) = plant.axes.get_mut(number).filter(|axis| !axis.is_gone) else { continue };
        let mut joins = borne.get_mut(number).map(std::mem::take).unwrap_or_default();
        joins.extend(axis.spurs.iter().map(|spur_at| (spur_at.along_m, spur)));
        joins.sort_by(|a, b| a.0.total_cmp(&b.0));
        let shoot_m: f64 =
            axis.pieces.iter().filter(|piece| piece.season == season).map(|piece| piece.length_m).sum();
        let mut sum = pipe(terminal_radius_m(shoot_m / tree.internode_m, tree));
        let length_m = axis.length_m();
        let mut base_m = length_m;
        let mut thinnest_m: f64 = 0.0;
        for piece in axis.pieces.iter_mut().rev() {
            base_m -= piece.length_m;
            while joins.last().is_some_and(|(along_m, _)| *along_m >= base_m) {
                sum += joins.pop().map_or(0.0, |(_, pipe)| pipe);
            }
            let floor_m = match axis.role {
                Role::Leader => {
                    0.5 * tree.trunk_floor_diameter_m * (1.0 - (base_m / system.room.top_m).min(1.0))
                }
                _ => 0.0,
            };
            let grown_m = libm::pow(sum, 1.0 / exponent).max(tree.wood_floor_radius_m);
            let radius_m = grown_m.max(piece.radius_m).max(thinnest_m);
            // The trunk's floor does not feed into what the model gives.
            sum = sum.max(pipe(radius_m));
            thinnest_m = radius_m;
            piece.radius_m = radius_m.max(floor_m);
        }
        if let Some((bearer, along_m)) = axis.bearer {
            let whole = if axis.pieces.is_empty() { 0.0 } else { sum };
            if let Some(joins) = borne.get_mut(bearer) {
                joins.push((along_m, whole));
            }
        }
    }
}
