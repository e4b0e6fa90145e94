//! How axes bend under their own load.
//!
//! Each piece is an elastic rod that turns by M·L / (E·I), I = π·r⁴/4, with M the moment about its foot of all wood, leaves and fruit
//! beyond (the small-rotation form that Fournier et al. 1991 and Alméras et al. 2002 sum along growing axes). A share of a season's
//! bend stays, because the season's ring is laid down on bent wood; the season that is scanned hangs in full.

use std::f64::consts::{FRAC_PI_4, PI};

use glam::{DMat3, DVec3};

use super::System;
use super::axis::{Plant, Role};
use super::thick::SPUR_RADIUS_M;
use crate::growth::foliage;
use crate::growth::rotation::rotate;

const GRAVITY_M_S2: f64 = 9.81;

/// Density of a fruit, kg/m³: apples float.
const FRUIT_KG_M3: f64 = 840.0;

/// A piece turns by at most this in a season, degrees: what would turn further breaks, or is propped.
const MOST_DEG: f64 = 12.0;

/// Mass, and its moment about the origin.
#[derive(Clone, Copy, Debug, Default)]
struct Load {
    kg: f64,
    kg_m: DVec3,
}

impl Load {
    fn at(kg: f64, point: DVec3) -> Self {
        Self { kg, kg_m: point * kg }
    }

    fn add(&mut self, other: Self) {
        self.kg += other.kg;
        self.kg_m += other.kg_m;
    }

    /// Its moment about a point, N·m.
    fn moment(&self, about: DVec3) -> DVec3 {
        (self.kg_m - about * self.kg).cross(DVec3::NEG_Z * GRAVITY_M_S2)
    }
}

/// What a metre of a season's shoot and a spur weigh beyond their wood.
struct Weights {
    shoot_kg_m: f64,
    spur_kg: f64,
}

impl Weights {
    fn of(system: &System) -> Self {
        let (training, tree) = (&system.training, &system.tree);
        let blade_kg = foliage::blade_area_m2(tree) * training.leaf_kg_m2;
        let scale = training.spur_leaf_scale;
        let rosette_kg = f64::from(training.spur_leaves) * blade_kg * scale * scale;
        let d = tree.fruit_diameter_m;
        let crop_kg = training.crop_per_spur * FRUIT_KG_M3 * PI / 6.0 * d * d * d;
        Self { shoot_kg_m: blade_kg / tree.internode_m, spur_kg: rosette_kg + crop_kg }
    }
}

/// Bends the tree under this season's load.
pub(super) fn sag(plant: &mut Plant, season: u32, system: &System) {
    let is_scanned = season == system.tree.iterations;
    let share = if is_scanned { 1.0 } else { system.training.bend_kept };
    let turns = turns(plant, season, system, share);
    let mut frames: Vec<Vec<DMat3>> = Vec::with_capacity(plant.axes.len());
    for number in 0..plant.axes.len() {
        let bearer = plant.axes.get(number).and_then(|axis| axis.bearer);
        let mut frame = bearer.map_or(DMat3::IDENTITY, |(bearer, along_m)| {
            let piece =
                plant.axes.get(bearer).and_then(|axis| axis.at(along_m)).map_or(0, |(piece, _)| piece);
            let frames = frames.get(bearer);
            frames.and_then(|frames| frames.get(piece)).copied().unwrap_or(DMat3::IDENTITY)
        });
        let mut own = Vec::new();
        let turns = turns.get(number).map_or(&[] as &[DMat3], Vec::as_slice);
        if let Some(axis) = plant.axes.get_mut(number) {
            for (piece, turn) in axis.pieces.iter_mut().zip(turns) {
                frame *= *turn;
                piece.direction = (frame * piece.direction).normalize_or_zero();
                own.push(frame);
            }
        }
        frames.push(own);
    }
}

/// By axis and piece: how it turns on the piece below.
fn turns(plant: &Plant, season: u32, system: &System, share: f64) -> Vec<Vec<DMat3>> {
    let feet = plant.feet();
    let weights = Weights::of(system);
    let mut borne: Vec<Vec<(f64, Load)>> = vec![Vec::new(); plant.axes.len()];
    let mut turns: Vec<Vec<DMat3>> = vec![Vec::new(); plant.axes.len()];
    for (number, axis) in plant.axes.iter().enumerate().rev() {
        let Some(foot) = feet.get(number).filter(|_| !axis.is_gone) else { continue };
        let mut loads = vec![Load::default(); axis.pieces.len()];
        let mut base = *foot;
        let mut bases = Vec::with_capacity(axis.pieces.len());
        for (piece, load) in axis.pieces.iter().zip(&mut loads) {
            let wood_kg = PI * piece.radius_m * piece.radius_m * system.training.wood_kg_m3;
            let leaf_kg = if piece.season == season { weights.shoot_kg_m } else { 0.0 };
            let middle = base + piece.direction * (0.5 * piece.length_m);
            load.add(Load::at((wood_kg + leaf_kg) * piece.length_m, middle));
            bases.push(base);
            base += piece.direction * piece.length_m;
        }
        let spur_wood_kg = PI * SPUR_RADIUS_M * SPUR_RADIUS_M * 0.02 * system.training.wood_kg_m3;
        let spurs = axis.spurs.iter().map(|spur| {
            (spur.along_m, Load::at(weights.spur_kg + spur_wood_kg, axis.point(*foot, spur.along_m)))
        });
        let joins = borne.get_mut(number).map(std::mem::take).unwrap_or_default();
        for (along_m, load) in joins.into_iter().chain(spurs) {
            let piece = axis.at(along_m).and_then(|(piece, _)| loads.get_mut(piece));
            piece.into_iter().for_each(|sum| sum.add(load));
        }
        let mut beyond = Load::default();
        let mut own = vec![DMat3::IDENTITY; axis.pieces.len()];
        for (k, piece) in axis.pieces.iter().enumerate().rev() {
            loads.get(k).into_iter().for_each(|load| beyond.add(*load));
            let (Some(base), Some(turn)) = (bases.get(k), own.get_mut(k)) else { continue };
            // An arm is held by its wire.
            if axis.role != Role::Arm {
                *turn = rod(beyond.moment(*base), piece.length_m, piece.radius_m, system, share);
            }
        }
        turns.get_mut(number).into_iter().for_each(|turns| turns.clone_from(&own));
        if let Some((bearer, along_m)) = axis.bearer {
            borne.get_mut(bearer).into_iter().for_each(|joins| joins.push((along_m, beyond)));
        }
    }
    turns
}

/// The turn of one rod under a moment.
fn rod(moment: DVec3, length_m: f64, radius_m: f64, system: &System, share: f64) -> DMat3 {
    let square = radius_m * radius_m;
    let stiffness = system.training.young_gpa * 1e9 * FRAC_PI_4 * square * square;
    let Some(about) = moment.try_normalize() else { return DMat3::IDENTITY };
    let turn_deg = (moment.length() * length_m / stiffness).to_degrees().min(MOST_DEG) * share;
    let [x, y, z] = DVec3::AXES.map(|axis| rotate(axis, about, turn_deg));
    DMat3::from_cols(x, y, z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::growth::TreeParameters;
    use crate::trained::axis::{Axis, Piece};
    use crate::trained::room::Room;
    use crate::trained::{System, TrainingParameters};

    /// A level rod of `pieces` pieces, 1 m long and 10 mm thick, grown in the first of two seasons.
    fn rod_of(pieces: u32) -> Plant {
        let mut axis = Axis::new(Role::Lateral, None, 1, 1.0);
        let length_m = 1.0 / f64::from(pieces);
        let piece = Piece { direction: DVec3::X, length_m, radius_m: 0.005, season: 1 };
        axis.pieces = vec![piece; pieces as usize];
        Plant { axes: vec![axis], stubs: Vec::new() }
    }

    fn system(bend_kept: f64) -> System {
        let training = TrainingParameters { young_gpa: 20.0, bend_kept, ..TrainingParameters::default() };
        let tree = TreeParameters { iterations: 3, ..TreeParameters::default() };
        System { room: Room::of(&training, &tree), training, tree, wires_m: Vec::new() }
    }

    #[test]
    fn a_level_rod_sags_by_the_slope_of_a_uniformly_loaded_cantilever() {
        // Slope at the end: w·l³ / (6·E·I).
        let weight_n_m = PI * 0.005 * 0.005 * 1000.0 * GRAVITY_M_S2;
        let slope = weight_n_m / (6.0 * 20e9 * FRAC_PI_4 * 0.005f64.powi(4));
        let end = |bend_kept: f64, season: u32| {
            let mut plant = rod_of(200);
            sag(&mut plant, season, &system(bend_kept));
            plant.axes[0].heading()
        };
        let down = end(1.0, 2);
        assert!((-down.z / slope - 1.0).abs() < 0.01 && down.y.abs() < 1e-12, "{down} {slope}");
        // A share of it is kept in the seasons before the last, all of it is seen in the last.
        assert!((-end(0.25, 2).z / (0.25 * slope) - 1.0).abs() < 0.01);
        assert!((-end(0.25, 3).z / slope - 1.0).abs() < 0.01);
    }

    #[test]
    fn an_upright_rod_and_one_that_is_tied_stay() {
        let mut upright = rod_of(10);
        upright.axes[0].pieces.iter_mut().for_each(|piece| piece.direction = DVec3::Z);
        sag(&mut upright, 2, &system(1.0));
        assert!((upright.axes[0].heading() - DVec3::Z).length() < 1e-9);
        let mut arm = rod_of(10);
        arm.axes[0].role = Role::Arm;
        sag(&mut arm, 2, &system(1.0));
        assert_eq!(arm.axes[0].heading(), DVec3::X);
    }
}
