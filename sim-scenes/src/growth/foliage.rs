//! Leaves: one a metamer.

use glam::DVec3;

use super::leaf_angle::LeafAngles;
use super::options::{LeafLifetime, RankScale};
use super::parameters::TreeParameters;
use super::rotation;
use super::skeleton::GrowthUnit;
use crate::angle::cos_sin_deg;
use crate::generator::draft::Blade;
use crate::organ::{Cylinder, Leaf};
use crate::seed::Stream;

/// One-sided area of a full blade, m².
pub(crate) fn blade_area_m2(parameters: &TreeParameters) -> f64 {
    BLADE_FILL * parameters.leaf_length_m * parameters.leaf_width_m
}

/// Half of the ovate blade: (distance along the midrib / length, half width / width), from the base to the tip. With its
/// mirror image an octagon of 0.687 length · width: 24.7 cm² at 8 × 4.5 cm.
const HALF_BLADE: [(f64, f64); 3] = [(0.12, 0.36), (0.40, 0.50), (0.75, 0.38)];

/// Area of a blade over length · width.
const BLADE_FILL: f64 = 0.687;

/// Leaves that are preformed in the bud, by MAppleT.
const PREFORMED: u32 = 8;

/// All leaves of a tree, unit by unit, from the base up; `radii_m` are those of the units' wood, on whose surface the petioles begin.
pub(crate) fn grow_blades(
    units: &[GrowthUnit],
    radii_m: &[f64],
    parameters: &TreeParameters,
    stream: &mut Stream,
) -> Vec<Blade> {
    let angles = LeafAngles::of(parameters.leaf_angle_law());
    let clothed = |unit: &GrowthUnit| match parameters.leaf_lifetime {
        LeafLifetime::EveryYear => true,
        LeafLifetime::CurrentSeason => unit.season == parameters.iterations,
    };
    let mut blades = Vec::new();
    for (number, unit) in units.iter().enumerate().filter(|(_, unit)| clothed(unit)) {
        let radius_m = radii_m.get(number).copied().unwrap_or(0.0);
        for node in 1..=unit.internodes {
            blades.extend(blade((number, radius_m), unit, node, (parameters, &angles), stream));
        }
    }
    blades
}

/// The leaf of one metamer. None only for a blade without area.
fn blade(
    (number, radius_m): (usize, f64),
    unit: &GrowthUnit,
    node: u32,
    (parameters, angles): (&TreeParameters, &LeafAngles),
    stream: &mut Stream,
) -> Option<Blade> {
    let axis = unit.direction;
    let azimuth_deg = parameters.phyllotaxis_deg * f64::from((unit.first_node + node - 1) % 360);
    let along_m = f64::from(node) * parameters.internode_m;
    let radial = rotation::rotate(rotation::square_to(axis), axis, azimuth_deg);
    let stem = Stem { stalk: unit.base + axis * along_m + radial * radius_m, axis, radial };
    let (leaf, petiole) = stem.leaf(linear_scale(node, parameters), (parameters, angles), stream)?;
    Some(Blade { segment: number, along_m, leaf, petiole })
}

/// Where a leaf grows.
pub(crate) struct Stem {
    /// Where the petiole begins: on the surface of the wood.
    pub(crate) stalk: DVec3,
    /// Direction of the axis, of unit length.
    pub(crate) axis: DVec3,
    /// Direction from the axis in which the leaf stands, of unit length and square to the axis.
    pub(crate) radial: DVec3,
}

impl Stem {
    /// A blade (`scale` times its full length and width) and its petiole. None only for a blade without area.
    pub(crate) fn leaf(
        &self,
        scale: f64,
        (parameters, angles): (&TreeParameters, &LeafAngles),
        stream: &mut Stream,
    ) -> Option<(Leaf, Option<Cylinder>)> {
        let &Self { stalk, axis, radial } = self;
        let lean = |angle_deg: f64| {
            let (cos, sin) = cos_sin_deg(angle_deg);
            axis * cos + radial * sin
        };
        let foot = stalk + lean(parameters.leaf_insertion_deg) * parameters.petiole_m;
        let midrib = lean(parameters.leaf_insertion_deg + parameters.leaf_droop_deg);
        let mut across = axis.cross(radial);
        if parameters.leaf_twist_deg > 0.0 {
            across =
                rotation::rotate(across, midrib, parameters.leaf_twist_deg * (2.0 * stream.unit() - 1.0));
        }
        let (midrib, across) = angles.turn(midrib, across, stream);
        let outline = outline(
            foot,
            midrib * (parameters.leaf_length_m * scale),
            across * (parameters.leaf_width_m * scale),
        );
        let petiole = (parameters.petiole_radius_m > 0.0)
            .then(|| Cylinder::new(stalk.to_array(), foot.to_array(), parameters.petiole_radius_m).ok())
            .flatten();
        Some((Leaf::new(outline).ok()?, petiole))
    }
}

/// The octagon from its foot, its midrib and its greatest width, both as vectors.
fn outline(foot: DVec3, midrib: DVec3, across: DVec3) -> Vec<[f64; 3]> {
    let side = |sign: f64| move |(u, v): &(f64, f64)| (foot + midrib * *u + across * (sign * v)).to_array();
    let mut outline = vec![foot.to_array()];
    outline.extend(HALF_BLADE.iter().map(side(1.0)));
    outline.push((foot + midrib).to_array());
    outline.extend(HALF_BLADE.iter().rev().map(side(-1.0)));
    outline
}

/// Factor on length and width by the rank of a leaf in its growth unit, from 1.
fn linear_scale(rank: u32, parameters: &TreeParameters) -> f64 {
    let share = f64::from(rank.min(PREFORMED));
    let area = match parameters.leaf_rank_scale {
        RankScale::Off => 1.0,
        RankScale::Preformed => share / f64::from(PREFORMED),
        RankScale::Linear => {
            let square_metres = 10e-4 + 20e-4 * (share - 1.0) / f64::from(PREFORMED - 1);
            square_metres / blade_area_m2(parameters)
        }
    };
    area.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::growth::State;
    use crate::seed::Purpose;

    fn upright(internodes: u32) -> GrowthUnit {
        GrowthUnit {
            bearer: None,
            bearer_node: 0,
            state: State::Long,
            order: 0,
            season: 1,
            internodes,
            first_node: 0,
            base: DVec3::ZERO,
            direction: DVec3::Z,
        }
    }

    fn leaves(parameters: &TreeParameters) -> Vec<Blade> {
        grow_blades(&[upright(10)], &[0.0], parameters, &mut Purpose::Foliage.stream(1, 0, 0))
    }

    #[test]
    fn a_leaf_is_about_25_square_centimetres_and_stands_off_at_60_degrees() {
        let blades = leaves(&TreeParameters::default());
        assert_eq!(blades.len(), 10);
        for (i, blade) in blades.iter().enumerate() {
            assert!((blade.leaf.area_m2() - BLADE_FILL * 0.08 * 0.045).abs() < 1e-9);
            let [foot, tip] = [0, 4].map(|k| DVec3::from_array(blade.leaf.outline()[k]));
            let midrib = tip - foot;
            assert!((midrib.length() - 0.08).abs() < 1e-12);
            assert!((midrib.normalize().z - 0.5).abs() < 1e-12);
            // The petiole goes out in the blade's direction from the end of the internode.
            let node = DVec3::Z * (0.035 * (i + 1) as f64);
            assert!((foot - (node + midrib.normalize() * 0.03)).length() < 1e-12);
        }
        let flat = |k: usize| {
            let v = blades[k].leaf.outline()[0];
            DVec3::new(v[0], v[1], 0.0).normalize()
        };
        assert!((flat(3).dot(flat(4)) - 144f64.to_radians().cos()).abs() < 1e-12);
        assert!(flat(0).dot(flat(5)) > 1.0 - 1e-12, "five turns of 144° close");
    }

    #[test]
    fn early_leaves_are_smaller_by_rank() {
        let areas = |leaf_rank_scale| -> Vec<f64> {
            let parameters = TreeParameters { leaf_rank_scale, ..TreeParameters::default() };
            leaves(&parameters).iter().map(|blade| blade.leaf.area_m2() * 1e4).collect()
        };
        let full = BLADE_FILL * 8.0 * 4.5;
        for (rank, area) in (1..).zip(areas(RankScale::Preformed)) {
            assert!((area - full * f64::from(rank.min(8)) / 8.0).abs() < 1e-9);
        }
        let linear = areas(RankScale::Linear);
        assert!(
            (linear[0] - 10.0).abs() < 1e-9
                && (linear[7] - 30.0).abs() < 1e-9
                && (linear[9] - 30.0).abs() < 1e-9
        );
    }

    #[test]
    fn twist_turns_the_blade_about_its_midrib_only() {
        let parameters = TreeParameters { leaf_twist_deg: 40.0, ..TreeParameters::default() };
        for (twisted, flat) in leaves(&parameters).iter().zip(leaves(&TreeParameters::default())) {
            assert_eq!(twisted.leaf.outline()[4], flat.leaf.outline()[4]);
            let cos = DVec3::from_array(twisted.leaf.normal()).dot(DVec3::from_array(flat.leaf.normal()));
            assert!(cos >= 40f64.to_radians().cos() - 1e-12 && cos < 1.0);
        }
    }
}
