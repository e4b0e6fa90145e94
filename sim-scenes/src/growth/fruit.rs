//! Fruit: on floral growth units, hanging below their tips.

use std::f64::consts::TAU;

use glam::DVec3;

use super::markov::State;
use super::parameters::TreeParameters;
use super::skeleton::GrowthUnit;
use crate::generator::draft::Fruit;
use crate::organ::{Facet, Leaf, Surface};

/// Length of a fruit's stalk, metres.
const STALK_M: f64 = 0.02;

/// Seasons that bear: the last ones.
const BEARING: u32 = 2;

/// The fruit of a tree. Those of one cluster hang around its tip, touching each other at most.
pub(super) fn hang(units: &[GrowthUnit], parameters: &TreeParameters) -> Vec<Fruit> {
    let bears =
        |unit: &GrowthUnit| unit.state == State::Floral && unit.season + BEARING > parameters.iterations;
    let clusters = units.iter().enumerate().filter(|(_, unit)| bears(unit));
    clusters
        .flat_map(|(segment, unit)| {
            let along_m = f64::from(unit.internodes) * parameters.internode_m;
            let tip = unit.base + unit.direction * along_m;
            cluster(tip, parameters).map(move |(middle, radius_m)| Fruit {
                segment,
                along_m,
                middle,
                radius_m,
            })
        })
        .collect()
}

/// Middles and radii of the fruit of one cluster, around and below the tip that bears it.
pub(crate) fn cluster(tip: DVec3, parameters: &TreeParameters) -> impl Iterator<Item = (DVec3, f64)> + use<> {
    let (count, radius_m) = (parameters.fruits_per_cluster, parameters.fruit_diameter_m / 2.0);
    let spread_m = if count > 1 { radius_m / libm::sin(TAU / 2.0 / f64::from(count)) } else { 0.0 };
    (0..count).map(move |k| {
        let angle = TAU * f64::from(k) / f64::from(count);
        let out = DVec3::new(libm::cos(angle), libm::sin(angle), 0.0) * spread_m;
        (tip + out - DVec3::Z * (STALK_M + radius_m), radius_m)
    })
}

/// The golden ratio.
const GOLDEN: f64 = 1.618_033_988_749_895;

/// The faces of an icosahedron by its vertices.
const FACES: [[usize; 3]; 20] = [
    [0, 11, 5],
    [0, 5, 1],
    [0, 1, 7],
    [0, 7, 10],
    [0, 10, 11],
    [1, 5, 9],
    [5, 11, 4],
    [11, 10, 2],
    [10, 7, 6],
    [7, 1, 8],
    [3, 9, 4],
    [3, 4, 2],
    [3, 2, 6],
    [3, 6, 8],
    [3, 8, 9],
    [4, 9, 5],
    [2, 4, 11],
    [6, 2, 10],
    [8, 6, 7],
    [9, 8, 1],
];

/// A fruit as an icosahedron with the surface of its sphere.
pub(crate) fn facets(fruit: &Fruit) -> Vec<Facet> {
    let (one, golden) = (1.0, GOLDEN);
    let corners = [
        [-one, golden, 0.0],
        [one, golden, 0.0],
        [-one, -golden, 0.0],
        [one, -golden, 0.0],
        [0.0, -one, golden],
        [0.0, one, golden],
        [0.0, -one, -golden],
        [0.0, one, -golden],
        [golden, 0.0, -one],
        [golden, 0.0, one],
        [-golden, 0.0, -one],
        [-golden, 0.0, one],
    ];
    // Edges are 2 long here: 20 faces of √3 each, over the sphere's 4π.
    let scale = fruit.radius_m * (2.0 * TAU / (20.0 * 3f64.sqrt())).sqrt();
    let at = |corner: usize| (fruit.middle + DVec3::from_array(corners[corner]) * scale).to_array();
    let face = |[a, b, c]: [usize; 3]| Leaf::new([at(a), at(b), at(c)]);
    let faces = FACES.iter().filter_map(|corners| face(*corners).ok());
    faces.map(|polygon| Facet { surface: Surface::Fruit, polygon }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generator::plant::grow_lone_tree;

    #[test]
    fn a_fruit_has_the_surface_of_its_sphere_and_is_closed() {
        let fruit = Fruit { segment: 0, along_m: 0.0, middle: DVec3::new(1.0, 2.0, 3.0), radius_m: 0.035 };
        let facets = facets(&fruit);
        let area: f64 = facets.iter().map(|facet| facet.polygon.area_m2()).sum();
        assert!((area - 2.0 * TAU * 0.035 * 0.035).abs() < 1e-12, "{area}");
        // All normals look out, or all in: their vector areas cancel.
        let closed: DVec3 = facets
            .iter()
            .map(|facet| DVec3::from_array(facet.polygon.normal()) * facet.polygon.area_m2())
            .sum();
        assert!(closed.length() < 1e-12);
        let outwards = facets.iter().filter(|facet| {
            let out = DVec3::from_array(facet.polygon.centroid()) - fruit.middle;
            DVec3::from_array(facet.polygon.normal()).dot(out) > 0.0
        });
        assert!([0, 20].contains(&outwards.count()));
    }

    #[test]
    fn clusters_bear_as_many_as_asked_for_and_none_by_default() {
        let with = |fruits_per_cluster| {
            let parameters = TreeParameters { fruits_per_cluster, ..TreeParameters::default() };
            grow_lone_tree(&parameters, 4).facets.len() / 20
        };
        assert_eq!(with(0), 0);
        assert!(with(1) > 10);
        assert_eq!(with(3), 3 * with(1));
    }
}
