//! Leaf area by contact frequency on slabs of known leaf area.

#![allow(clippy::unwrap_used)] // helpers are not known as tests

mod common;

use common::*;
use rowscan_canopy::{Estimate, Fill, Parameters};
use rowscan_protocol::rig::{Mount, Rig};
use rowscan_protocol::scan::{NO_ECHO, Scan};

/// The slabs stand around the row, 0.5..3 m high; their faces lie on voxel faces.
const HIGH_M: f64 = 2.5;
const DISTANCE_M: f64 = 2.0;
const HEIGHT_M: f64 = 1.6;

fn rig() -> Rig {
    let mount = Mount { distance_m: DISTANCE_M, height_m: HEIGHT_M, ..Mount::default() };
    Rig { ground_clearance_m: 0.0, scanners: vec![mount], ..orchard_rig() }
}

fn parameters() -> Parameters {
    Parameters { half_width_m: Some(1.5), ..Parameters::default() }
}

/// Where a beam enters and leaves the slab, if it meets it.
fn chord(thick_m: f64, theta: f64) -> Option<(f64, f64)> {
    let (sin, cos) = theta.sin_cos();
    let (near, far) = ((DISTANCE_M - thick_m / 2.0) / cos, (DISTANCE_M + thick_m / 2.0) / cos);
    let (a, b) = ((0.5 - HEIGHT_M) / sin, (0.5 + HIGH_M - HEIGHT_M) / sin);
    let (near, far) = if sin.abs() < 1e-9 { (near, far) } else { (near.max(a.min(b)), far.min(a.max(b))) };
    (near < far).then_some((near, far))
}

/// A slab of infinitely small leaves: free paths are exponential with rate G · LAD (G = 0.5).
fn turbid(thick_m: f64, density: f64, lines: u32, seed: u64) -> Vec<Scan> {
    let mut random = Random(seed);
    drive(&rig(), lms111(), 50, lines, |_, theta| {
        let path_m = -(1.0 - random.unit()).ln() / (0.5 * density);
        chord(thick_m, theta)
            .filter(|(near, far)| near + path_m < *far)
            .map_or(NO_ECHO, |(near, _)| near + path_m)
    })
}

/// The estimate over the truth, raw.
fn ratio(found: &Estimate, thick_m: f64, density: f64) -> f64 {
    found.leaf_area_contact_raw_m2.unwrap() / (density * thick_m * HIGH_M * found.scanned_m.unwrap())
}

#[test]
fn a_turbid_slab_has_its_leaf_area() {
    for (thick_m, density) in [(1.0, 1.0), (1.0, 4.0), (1.0, 8.0), (2.0, 2.0), (2.0, 4.0)] {
        let found = estimate_with(&rig(), parameters(), &turbid(thick_m, density, 300, 3));
        assert!(found.contact.unwrap().hits > 10_000);
        let ratio = ratio(&found, thick_m, density);
        assert!((ratio - 1.0).abs() < 0.02, "{thick_m} m of {density} m²/m³: {ratio}");
    }
}

#[test]
fn slabs_whose_faces_cut_voxels_are_a_few_percent_off() {
    // Default region: 0..3.9 m from the sensor, 0.1..5 m high.
    let rig = Rig { ground_clearance_m: 0.1, ..rig() };
    let found = estimate_with(&rig, Parameters::default(), &turbid(1.0, 3.0, 300, 2));
    let ratio = ratio(&found, 1.0, 3.0);
    assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
}

#[test]
fn misses_matter() {
    let mut scans = turbid(1.0, 2.0, 150, 3);
    let whole = ratio(&estimate_with(&rig(), parameters(), &scans), 1.0, 2.0);
    for range_m in scans.iter_mut().flat_map(|scan| &mut scan.echoes[0].range_m) {
        if *range_m == NO_ECHO {
            *range_m = f64::NAN;
        }
    }
    let without = ratio(&estimate_with(&rig(), parameters(), &scans), 1.0, 2.0);
    assert!((whole - 1.0).abs() < 0.02 && without > 1.3, "{whole} {without}");
}

#[test]
fn mirroring_fills_dense_slabs_best() {
    let scans = turbid(2.0, 4.0, 150, 4);
    let off = |fill| {
        let found = estimate_with(&rig(), Parameters { fill, ..parameters() }, &scans);
        let contact = found.contact.unwrap();
        assert!(contact.voxels_unvisited * 10 > contact.voxels_visited);
        assert_eq!(contact.leaf_area_filled_m2 > 0.0, fill != Fill::LeaveOut);
        (ratio(&found, 2.0, 4.0) - 1.0).abs()
    };
    let [mirror, band, left_out] = [Fill::Mirror, Fill::BandMean, Fill::LeaveOut].map(off);
    assert!(mirror < 0.02 && band > 0.05 && left_out > 0.05, "{mirror} {band} {left_out}");
}

#[test]
fn lai_is_leaf_area_over_ground_by_row_and_by_tree() {
    // 2.5 m² of leaf a metre of row and m²/m³; 3 m²/m³ on 4 m of row spacing: LAI 1.875.
    let found = estimate_with(&rig(), parameters(), &turbid(1.0, 3.0, 375, 5));
    let expected = 3.0 * HIGH_M / 4.0;
    assert!(relative(found.lai.unwrap(), expected) < 0.02, "{:?}", found.lai);
    assert_eq!(found.trees.len(), 5);
    for tree in &found.trees {
        assert!(tree.complete);
        assert!(relative(tree.lai.unwrap(), expected) < 0.04, "{tree:?}");
        assert!(relative(tree.leaf_area_m2.unwrap(), tree.lai.unwrap() * 1.5 * 4.0) < 1e-12);
    }
    let of_trees: f64 = found.trees.iter().filter_map(|t| t.leaf_area_m2).sum();
    let of_slices: f64 = found.slices.iter().filter_map(|s| s.leaf_area_m2).sum();
    assert!(relative(of_trees, found.leaf_area_m2.unwrap()) < 1e-12);
    assert!(relative(of_slices, found.leaf_area_m2.unwrap()) < 1e-12);
    assert!(found.warnings.iter().any(|w| w.code() == "uncalibrated"));
}

#[test]
fn lost_lines_leave_the_leaf_area_as_it_is() {
    let scans = turbid(1.0, 2.0, 301, 6);
    let kept = scans.iter().enumerate().filter(|(i, _)| i % 3 != 1).map(|(_, scan)| scan);
    let found = estimate_with(&rig(), parameters(), kept);
    assert!(found.scans_lost > 90);
    assert!((ratio(&found, 1.0, 2.0) - 1.0).abs() < 0.02);
}

/// A round leaf.
struct Disc {
    centre: [f64; 3],
    normal: [f64; 3],
}

/// Discs of one size, thrown and turned at random into the slab, over a length of row a little longer than scanned.
fn discs(random: &mut Random, thick_m: f64, length_m: f64, density: f64, radius_m: f64) -> Vec<Disc> {
    let (y0, y1) = (-0.1, length_m + 0.1);
    let area_m2 = std::f64::consts::PI * radius_m * radius_m;
    let count = (density * thick_m * HIGH_M * (y1 - y0) / area_m2).round() as usize;
    (0..count)
        .map(|_| {
            let centre = [
                DISTANCE_M + thick_m * (random.unit() - 0.5),
                y0 + (y1 - y0) * random.unit(),
                0.5 + HIGH_M * random.unit(),
            ];
            let up = 2.0 * random.unit() - 1.0;
            let round = std::f64::consts::TAU * random.unit();
            let flat = (1.0 - up * up).sqrt();
            Disc { centre, normal: [flat * round.cos(), flat * round.sin(), up] }
        })
        .collect()
}

/// The first disc a beam from the sensor meets in the scan plane at `y_m`.
fn first_hit(discs: &[&Disc], radius_m: f64, y_m: f64, theta: f64) -> f64 {
    let (sin, cos) = theta.sin_cos();
    discs
        .iter()
        .filter_map(|disc| {
            let [nx, ny, nz] = disc.normal;
            let [x, y, z] = [disc.centre[0], disc.centre[1] - y_m, disc.centre[2] - HEIGHT_M];
            let range_m = (nx * x + ny * y + nz * z) / (nx * cos + nz * sin);
            let off = (range_m * cos - x).powi(2) + y * y + (range_m * sin - z).powi(2);
            (range_m > 0.0 && off < radius_m * radius_m).then_some(range_m)
        })
        .fold(NO_ECHO, f64::min)
}

#[test]
fn a_slab_of_real_leaves_has_its_leaf_area_but_for_the_bias_of_few_leaves_a_voxel() {
    // Leaves of 6 cm, 6 m of row, four slabs: some 32 000 leaves, 8 in a voxel of 0.25 m.
    let (density, radius_m, thick_m, lines) = (1.5, 0.03, 1.0, 300);
    let edges_m = [0.125, 0.25, 0.5];
    let mut means = [0.0; 3];
    for seed in 0..4 {
        let leaves = discs(&mut Random(100 + seed), thick_m, 6.0, density, radius_m);
        let mut near: Vec<&Disc> = Vec::new();
        let mut near_y_m = f64::NAN;
        let scans = drive(&rig(), lms111(), 50, lines, |y_m, theta| {
            if y_m != near_y_m {
                near_y_m = y_m;
                near = leaves.iter().filter(|d| (d.centre[1] - y_m).abs() < radius_m).collect();
            }
            // Steeper beams pass above and below the slab.
            if theta.abs() < 1.3 { first_hit(&near, radius_m, y_m, theta) } else { NO_ECHO }
        });
        for (mean, edge_m) in means.iter_mut().zip(edges_m) {
            let parameters = Parameters { voxel_m: edge_m, slice_m: edge_m, ..parameters() };
            *mean += ratio(&estimate_with(&rig(), parameters, &scans), thick_m, density) / 4.0;
        }
    }
    // The fewer leaves a voxel holds, the more hits / Σ free path of it is biased upwards: see `contact.rs`.
    let [small, default, large] = means;
    assert!((large - 1.0).abs() < 0.015, "{means:?}");
    assert!((default - 1.0).abs() < 0.03 && default > large, "{means:?}");
    assert!(small > 1.05, "{means:?}");
}
