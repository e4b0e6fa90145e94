//! What grows in a season: axes extend, last year's wood breaks into shoots and spurs.

use glam::DVec3;

use super::System;
use super::axis::{Axis, Piece, Plant, Role, Spur};
use super::frame::{DIVERGENCE_DEG, about, count, jitter, leave, radial, towards};
use super::parameters::Form;
use crate::seed::Stream;

/// Length of a piece, metres: an annual shoot is bent in steps of this.
const PIECE_M: f64 = 0.12;

/// Shorter than this an axis does not extend but ends in a rosette, metres.
const SHORTEST_SHOOT_M: f64 = 0.05;

/// A new axis on its bearer.
struct Bud {
    bearer: usize,
    along_m: f64,
    role: Role,
    direction: DVec3,
    vigour: f64,
    length_m: f64,
}

/// One season's growth of all axes.
pub(super) fn season(plant: &mut Plant, season: u32, system: &System, stream: &mut Stream) {
    if season == 1 {
        plant.axes.push(whip(system, stream));
        return;
    }
    let feet = plant.feet();
    let mut buds = Vec::new();
    for (number, foot) in feet.iter().enumerate() {
        let order = order_of(plant, number);
        let Some(axis) = plant.axes.get_mut(number).filter(|axis| !axis.is_gone) else { continue };
        if let Some(span) = axis.wood_of(season - 1) {
            axis.spurs.extend(spurs(axis, *foot, span, season, system, stream));
            if axis.role.is_frame() {
                frame_buds(axis, number, *foot, span, system, stream, &mut buds);
            } else if order < system.training.side_orders {
                side_buds(axis, number, span, season, system, stream, &mut buds);
            }
        }
        extend(axis, season, system, stream);
    }
    for (bearer, along_m) in std::mem::take(&mut plant.stubs) {
        let Some(axis) = plant.axes.get(bearer).filter(|axis| !axis.is_gone) else { continue };
        let Some((piece, _)) = axis.at(along_m) else { continue };
        let heading = axis.pieces.get(piece).map_or(DVec3::Z, |piece| piece.direction);
        let azimuth_deg = 360.0 * stream.unit();
        buds.push(lateral(bearer, along_m, heading, azimuth_deg, system, stream));
    }
    for bud in buds {
        let mut axis = Axis::new(bud.role, Some((bud.bearer, bud.along_m)), season, bud.vigour);
        shoot(&mut axis, bud.direction, bud.length_m, season, system, stream);
        plant.axes.push(axis);
    }
}

/// Side orders below an axis: 0 for a lateral.
fn order_of(plant: &Plant, number: usize) -> u32 {
    let mut order = 0;
    let mut at = plant.axes.get(number);
    while let Some(axis) = at.filter(|axis| axis.role == Role::Side) {
        order += 1;
        at = axis.bearer.and_then(|(bearer, _)| plant.axes.get(bearer));
    }
    order
}

/// The tree as planted.
fn whip(system: &System, stream: &mut Stream) -> Axis {
    let mut axis = Axis::new(Role::Leader, None, 1, 1.0);
    let upright = jitter(DVec3::Z, 0.2 * system.training.stray_deg, stream);
    shoot(&mut axis, upright, about(system.training.whip_m, 0.05, stream), 1, system, stream);
    axis
}

/// Extends an axis by this season's shoot, if it is long enough to be one.
fn extend(axis: &mut Axis, season: u32, system: &System, stream: &mut Stream) {
    let training = &system.training;
    let age = f64::from(season - axis.born);
    let length_m = match axis.role {
        Role::Leader if training.form == Form::Vase => 0.0,
        // Once cut back at its top a leader is cut to a weak shoot every winter.
        Role::Leader | Role::Scaffold if axis.was_headed => about(0.5 * training.leader_shoot_m, 0.2, stream),
        Role::Leader | Role::Scaffold => about(training.leader_shoot_m, 0.15, stream),
        Role::Arm => about(0.8 * training.leader_shoot_m, 0.2, stream),
        Role::Lateral | Role::Side => {
            let calm = libm::pow(training.shoot_decline, age);
            // A shoot that was cut back wakes again.
            let calm = if axis.was_headed { calm.max(0.5) } else { calm };
            about(training.lateral_shoot_m * axis.vigour * calm, 0.3, stream)
        }
    };
    if length_m < SHORTEST_SHOOT_M {
        let along_m = axis.length_m();
        let azimuth_deg = 360.0 * stream.unit();
        let is_bare = !axis.spurs.iter().any(|spur| (spur.along_m - along_m).abs() < 1e-9);
        if is_bare && axis.role != Role::Leader {
            axis.spurs.push(Spur { along_m, azimuth_deg, season });
        }
        return;
    }
    let rise = match axis.role {
        Role::Leader => 0.6,
        Role::Arm => 0.0,
        _ => training.upturn,
    };
    let course = towards(axis.heading(), DVec3::Z, rise);
    let direction = jitter(course, training.stray_deg, stream);
    shoot(axis, direction, length_m, season, system, stream);
}

/// Appends an annual shoot: pieces that stray a little from each other.
fn shoot(axis: &mut Axis, first: DVec3, length_m: f64, season: u32, system: &System, stream: &mut Stream) {
    let pieces = (length_m / PIECE_M).ceil().clamp(1.0, 1e4);
    let mut direction = first;
    for _ in 0..pieces as u32 {
        axis.pieces.push(Piece { direction, length_m: length_m / pieces, radius_m: 0.0, season });
        direction = jitter(direction, 0.3 * system.training.stray_deg, stream);
    }
}

/// Rosettes that break on last year's wood, above the clear trunk.
fn spurs(
    axis: &Axis,
    foot: DVec3,
    (from_m, to_m): (f64, f64),
    season: u32,
    system: &System,
    stream: &mut Stream,
) -> Vec<Spur> {
    let number = count((to_m - from_m) * system.training.spurs_per_m, stream);
    let step_m = (to_m - from_m) / f64::from(number.max(1));
    let first_deg = 360.0 * stream.unit();
    let spur = |k: u32| {
        let along_m = from_m + (f64::from(k) + stream.unit()) * step_m;
        Spur { along_m, azimuth_deg: first_deg + f64::from(k) * DIVERGENCE_DEG, season }
    };
    let clear_m = system.tree.clear_trunk_m;
    let stands = |spur: &Spur| axis.point(foot, spur.along_m).z > clear_m;
    (0..number).map(spur).filter(stands).collect()
}

/// What last year's wood of a leader, a scaffold or an arm breaks into.
fn frame_buds(
    axis: &Axis,
    number: usize,
    foot: DVec3,
    (from_m, to_m): (f64, f64),
    system: &System,
    stream: &mut Stream,
    buds: &mut Vec<Bud>,
) {
    let training = &system.training;
    let first_deg = 360.0 * stream.unit();
    if axis.role == Role::Leader && training.form == Form::Vase {
        buds.extend((0..training.scaffolds).map(|k| scaffold(axis, number, k, first_deg, system, stream)));
        return;
    }
    if axis.role == Role::Leader && training.form == Form::Palmette {
        for height_m in &system.wires_m {
            let along_m = height_m - foot.z;
            if along_m > from_m && along_m <= to_m && *height_m > system.tree.clear_trunk_m {
                buds.extend([1.0, -1.0].map(|sign| Bud {
                    bearer: number,
                    along_m: along_m - 0.05 * stream.unit(),
                    role: Role::Arm,
                    direction: leave(DVec3::Z, DVec3::Y * sign, 60.0),
                    vigour: 1.0,
                    length_m: about(0.8 * training.leader_shoot_m, 0.2, stream),
                }));
            }
        }
    }
    // The lowest quarter of a shoot stays bare: apple breaks towards the tip. Of a trunk all is bare below the clear height.
    let clear_m = if axis.role == Role::Leader { system.tree.clear_trunk_m + 0.1 - foot.z } else { 0.0 };
    let from_m = (from_m + 0.25 * (to_m - from_m)).max(clear_m).min(to_m);
    let laterals = count(training.laterals, stream);
    for k in 0..laterals {
        let along_m = from_m + (to_m - from_m) * (f64::from(k) + stream.unit()) / f64::from(laterals);
        let Some(piece) = axis.at(along_m).and_then(|(piece, _)| axis.pieces.get(piece)) else { continue };
        let azimuth_deg = first_deg + f64::from(k) * DIVERGENCE_DEG;
        buds.push(lateral(number, along_m, piece.direction, azimuth_deg, system, stream));
    }
}

/// A lateral; on an arm weaker and more upright than on a leader.
fn lateral(
    bearer: usize,
    along_m: f64,
    heading: DVec3,
    azimuth_deg: f64,
    system: &System,
    stream: &mut Stream,
) -> Bud {
    let training = &system.training;
    let angle_deg = about(training.lateral_deg, 0.15, stream);
    let direction = leave(heading, radial(heading, azimuth_deg), angle_deg);
    let vigour = about(1.0, 0.25, stream);
    let length_m = training.lateral_shoot_m * vigour;
    Bud { bearer, along_m, role: Role::Lateral, direction, vigour, length_m }
}

/// A limb of a vase, from the topmost hand's breadth of the trunk, evenly around it.
fn scaffold(axis: &Axis, bearer: usize, k: u32, first_deg: f64, system: &System, stream: &mut Stream) -> Bud {
    let training = &system.training;
    let step_deg = 360.0 / f64::from(training.scaffolds);
    let azimuth_deg = first_deg + (f64::from(k) + 0.3 * (stream.unit() - 0.5)) * step_deg;
    let along_m = axis.length_m() - 0.15 * stream.unit();
    let direction = leave(DVec3::Z, radial(DVec3::Z, azimuth_deg), about(training.scaffold_deg, 0.1, stream));
    let length_m = about(training.leader_shoot_m, 0.15, stream);
    Bud { bearer, along_m, role: Role::Scaffold, direction, vigour: 1.0, length_m }
}

/// Side shoots on last year's wood of a lateral, towards its tip.
fn side_buds(
    axis: &Axis,
    number: usize,
    (from_m, to_m): (f64, f64),
    season: u32,
    system: &System,
    stream: &mut Stream,
    buds: &mut Vec<Bud>,
) {
    let training = &system.training;
    let calm = libm::pow(training.shoot_decline, f64::from((season - 1).saturating_sub(axis.born)));
    let vigour = axis.vigour * training.side_share * calm;
    if training.lateral_shoot_m * vigour < SHORTEST_SHOOT_M {
        return;
    }
    let first_deg = 360.0 * stream.unit();
    for k in 0..count(training.side_shoots, stream) {
        let along_m = from_m + (to_m - from_m) * (0.3 + 0.7 * stream.unit());
        let Some(piece) = axis.at(along_m).and_then(|(piece, _)| axis.pieces.get(piece)) else { continue };
        let radial = radial(piece.direction, first_deg + f64::from(k) * DIVERGENCE_DEG);
        let direction = leave(piece.direction, radial, about(training.side_deg, 0.2, stream));
        let length_m = about(training.lateral_shoot_m * vigour, 0.3, stream);
        buds.push(Bud { bearer: number, along_m, role: Role::Side, direction, vigour, length_m });
    }
}
