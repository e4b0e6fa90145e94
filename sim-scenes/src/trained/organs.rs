//! From axes to a draft: wood, leaves of the season, fruit.

use glam::DVec3;

use super::System;
use super::axis::{Axis, Plant, Role, Spur};
use super::frame::{jitter, leave, radial};
use super::thick::SPUR_RADIUS_M;
use crate::generator::draft::{Age, Blade, Draft, Fruit, Segment};
use crate::growth::foliage::Stem;
use crate::growth::fruit;
use crate::growth::leaf_angle::LeafAngles;
use crate::growth::rotation::rotate;
use crate::seed::Stream;

/// Bearing of one leaf of a rosette to the next: the golden angle, so that none stands over another.
const ROSETTE_DEG: f64 = 137.5;

/// Leaves of a rosette stand on axes that stray this far from the spur's.
const ROSETTE_STRAY_DEG: f64 = 20.0;

/// Angle of a spur to its bearer.
const SPUR_DEG: f64 = 60.0;

/// Of how many spurs one bears, where fruit is drawn.
const BEARING: usize = 3;

struct Dresser<'a> {
    system: &'a System,
    angles: LeafAngles,
    draft: Draft,
}

/// The tree as it is scanned.
pub(super) fn grow_organs(plant: &Plant, system: &System, stream: &mut Stream) -> Draft {
    let angles = LeafAngles::of(system.tree.leaf_angle_law());
    let mut dresser = Dresser { system, angles, draft: Draft::default() };
    let feet = plant.feet();
    // By axis: number of its first segment.
    let mut firsts: Vec<usize> = Vec::with_capacity(plant.axes.len());
    for (axis, foot) in plant.axes.iter().zip(feet) {
        let first = dresser.draft.segments.len();
        firsts.push(first);
        if axis.is_gone {
            continue;
        }
        let stands_on = axis.bearer.and_then(|(bearer, along_m)| {
            let (piece, up_m) = plant.axes.get(bearer)?.at(along_m)?;
            Some((firsts.get(bearer)? + piece, up_m))
        });
        dresser.wood(axis, foot, stands_on);
        dresser.shoot_leaves(axis, first, stream);
        for spur in &axis.spurs {
            dresser.spur(axis, foot, first, spur, stream);
        }
    }
    dresser.draft
}

impl Dresser<'_> {
    fn wood(&mut self, axis: &Axis, foot: DVec3, stands_on: Option<(usize, f64)>) {
        let (mut base, mut below) = (foot, stands_on);
        for piece in &axis.pieces {
            let (bearer, bearer_m) = below.unzip();
            below = Some((self.draft.segments.len(), piece.length_m));
            let is_current = piece.season == self.system.tree.iterations;
            self.draft.segments.push(Segment {
                bearer,
                bearer_m: bearer_m.unwrap_or(0.0),
                base,
                direction: piece.direction,
                length_m: piece.length_m,
                radius_m: piece.radius_m,
                is_trunk: axis.role == Role::Leader,
                age: if is_current { Age::Current } else { Age::Older },
            });
            base += piece.direction * piece.length_m;
        }
    }

    /// One leaf a node of this season's shoot; the node at its foot bears none.
    fn shoot_leaves(&mut self, axis: &Axis, first: usize, stream: &mut Stream) {
        let tree = &self.system.tree;
        let offset_deg = 360.0 * stream.unit();
        let (mut node, mut gone_m) = (1u32, 0.0);
        for (k, piece) in axis.pieces.iter().enumerate().filter(|(_, piece)| piece.season == tree.iterations)
        {
            let Some(segment) = self.draft.segments.get(first + k) else { continue };
            let base = segment.base;
            loop {
                let along_m = f64::from(node) * tree.internode_m - gone_m;
                if along_m > piece.length_m + 1e-9 {
                    break;
                }
                let radial =
                    radial(piece.direction, offset_deg + tree.phyllotaxis_deg * f64::from(node % 360));
                let stem = Stem {
                    stalk: base + piece.direction * along_m + radial * piece.radius_m,
                    axis: piece.direction,
                    radial,
                };
                if let Some((leaf, petiole)) = stem.leaf(1.0, (tree, &self.angles), stream) {
                    self.draft.blades.push(Blade { segment: first + k, along_m, leaf, petiole });
                }
                node += 1;
            }
            gone_m += piece.length_m;
        }
    }

    /// A spur with its rosette; its wood begins at the surface of its bearer.
    fn spur(&mut self, axis: &Axis, foot: DVec3, first: usize, spur: &Spur, stream: &mut Stream) {
        let (training, tree) = (&self.system.training, &self.system.tree);
        let Some((piece_number, up_m)) = axis.at(spur.along_m) else { return };
        let Some(piece) = axis.pieces.get(piece_number) else { return };
        let out = radial(piece.direction, spur.azimuth_deg);
        let at = axis.point(foot, spur.along_m);
        let lean = leave(piece.direction, out, SPUR_DEG);
        let direction = (lean + DVec3::Z * 0.5).try_normalize().unwrap_or(lean);
        let seasons = f64::from(tree.iterations + 1 - spur.season);
        let length_m = piece.radius_m + seasons * training.spur_growth_m;
        let number = self.draft.segments.len();
        self.draft.segments.push(Segment {
            bearer: Some(first + piece_number),
            bearer_m: up_m,
            base: at,
            direction,
            length_m,
            radius_m: SPUR_RADIUS_M.min(piece.radius_m),
            is_trunk: false,
            age: Age::Spur,
        });
        let tip = at + direction * length_m;
        let first_deg = 360.0 * stream.unit();
        for k in 0..training.spur_leaves {
            let stem_axis = jitter(direction, ROSETTE_STRAY_DEG, stream);
            let radial = rotate(radial(stem_axis, first_deg), stem_axis, ROSETTE_DEG * f64::from(k));
            let stem = Stem { stalk: tip, axis: stem_axis, radial };
            if let Some((leaf, petiole)) = stem.leaf(training.spur_leaf_scale, (tree, &self.angles), stream) {
                self.draft.blades.push(Blade { segment: number, along_m: length_m, leaf, petiole });
            }
        }
        if number.is_multiple_of(BEARING) {
            let cluster = fruit::cluster(tip, tree).map(|(middle, radius_m)| Fruit {
                segment: number,
                along_m: length_m,
                middle,
                radius_m,
            });
            self.draft.fruits.extend(cluster);
        }
    }
}
