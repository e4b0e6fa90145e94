//! What a grower does in winter: ties young limbs, cuts the tree back to its room, renews old branches.

use glam::{DMat3, DVec3};

use super::System;
use super::axis::{Axis, Plant, Role};
use super::frame::{about, jitter};
use super::parameters::Form;
use crate::growth::rotation::rotate;
use crate::seed::Stream;

/// A stump shorter than this is cut off, metres.
const SHORTEST_STUMP_M: f64 = 0.05;

/// Steps in which a cut's place on a piece is looked for.
const HALVINGS: u32 = 12;

/// Brings this season's limbs to their angles.
pub(super) fn tie(plant: &mut Plant, season: u32, system: &System, stream: &mut Stream) {
    let training = &system.training;
    for number in 0..plant.axes.len() {
        let Some(axis) = plant.axes.get_mut(number).filter(|axis| !axis.is_gone) else { continue };
        match axis.role {
            Role::Arm => along_the_wire(axis, season, stream),
            Role::Lateral if axis.born == season && training.tie_deg > 0.0 => {
                let on_arm = training.form == Form::Palmette;
                let tie_deg = about(training.tie_deg, 0.1, stream);
                if !on_arm {
                    lower(plant, number, tie_deg);
                }
            }
            Role::Scaffold if season < axis.born + 2 => {
                let spread_deg = about(training.scaffold_deg, 0.05, stream);
                lower(plant, number, spread_deg);
            }
            _ => {}
        }
    }
}

/// This season's pieces of an arm, along its wire.
fn along_the_wire(axis: &mut Axis, season: u32, stream: &mut Stream) {
    let side = axis.heading().y.signum();
    for piece in axis.pieces.iter_mut().filter(|piece| piece.season == season) {
        piece.direction = jitter(DVec3::Y * side, 4.0, stream);
    }
}

/// Turns a limb with all it bears until its end lies at an angle from the vertical; one that already hangs lower stays.
fn lower(plant: &mut Plant, number: usize, angle_deg: f64) {
    let Some(axis) = plant.axes.get(number) else { return };
    let Some(chord) = axis.point(DVec3::ZERO, f64::INFINITY).try_normalize() else { return };
    let here_deg = libm::acos(chord.z.clamp(-1.0, 1.0)).to_degrees();
    let Some(about) = DVec3::Z.cross(chord).try_normalize().filter(|_| here_deg < angle_deg) else { return };
    let [x, y, z] = DVec3::AXES.map(|axis| rotate(axis, about, angle_deg - here_deg));
    let turn = DMat3::from_cols(x, y, z);
    let mut turned = vec![false; plant.axes.len()];
    for k in number..plant.axes.len() {
        let bearer = plant.axes.get(k).and_then(|axis| axis.bearer);
        let goes = k == number || bearer.is_some_and(|(bearer, _)| turned.get(bearer) == Some(&true));
        if let (true, Some(axis), Some(flag)) = (goes, plant.axes.get_mut(k), turned.get_mut(k)) {
            *flag = true;
            axis.pieces.iter_mut().for_each(|piece| piece.direction = turn * piece.direction);
        }
    }
}

/// Cuts the tree back.
pub(super) fn cut(plant: &mut Plant, season: u32, system: &System, stream: &mut Stream) {
    let feet = plant.feet();
    for (axis, foot) in plant.axes.iter_mut().zip(feet) {
        if axis.is_gone {
            continue;
        }
        axis.was_headed = false;
        let ease = system.training.winter_share * (1.0 - system.training.cut_unevenness * stream.unit());
        let keep_m = match axis.role {
            Role::Leader => below_the_top(axis, system.room.top_m - 0.2 - 0.2 * stream.unit()),
            _ => within(axis, foot, |point| system.room.holds(point, ease)),
        };
        if keep_m < axis.length_m() - 1e-9 {
            axis.is_gone = keep_m < SHORTEST_STUMP_M && axis.role != Role::Leader;
            axis.shorten(keep_m);
        }
        axis.spurs.retain(|spur| season - spur.season < system.training.spur_seasons);
    }
    renew(plant, season, system);
    plant.drop_orphans();
}

/// Length of a leader up to a height.
fn below_the_top(axis: &Axis, top_m: f64) -> f64 {
    within(axis, DVec3::ZERO, |point| point.z <= top_m)
}

/// Length of an axis until it first leaves what `holds`; the foot itself stands on its bearer and counts as within.
fn within(axis: &Axis, foot: DVec3, holds: impl Fn(DVec3) -> bool) -> f64 {
    let (mut base, mut along_m) = (foot, 0.0);
    for piece in &axis.pieces {
        let tip = base + piece.direction * piece.length_m;
        if !holds(tip) {
            let (mut low, mut high) = (0.0, piece.length_m);
            for _ in 0..HALVINGS {
                let middle = 0.5 * (low + high);
                if holds(base + piece.direction * middle) { low = middle } else { high = middle }
            }
            return along_m + low;
        }
        along_m += piece.length_m;
        base = tip;
    }
    along_m
}

/// Cuts laterals to stubs, those first that are thickest for what bears them, a share of all every winter, so that none grows older
/// than the renewal allows for long.
fn renew(plant: &mut Plant, season: u32, system: &System) {
    let every = system.training.renewal_seasons;
    if every == 0 || season < every {
        return;
    }
    let mut laterals: Vec<(f64, usize)> = plant
        .axes
        .iter()
        .enumerate()
        .filter(|(_, axis)| axis.role == Role::Lateral && !axis.is_gone)
        .filter_map(|(number, axis)| {
            let (bearer, along_m) = axis.bearer?;
            let bearer = plant.axes.get(bearer)?;
            let below = bearer.pieces.get(bearer.at(along_m)?.0)?;
            Some((axis.pieces.first()?.radius_m / below.radius_m, number))
        })
        .collect();
    laterals.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let number = laterals.len() / every as usize;
    for (_, lateral) in laterals.into_iter().take(number) {
        let Some(axis) = plant.axes.get_mut(lateral) else { continue };
        axis.is_gone = true;
        plant.stubs.extend(axis.bearer);
    }
}
