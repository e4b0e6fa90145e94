//! Leaf area by contact frequency on slabs of known leaf area.

use crate::common::slab::*;
use crate::common::*;
use rowscan_canopy::{EdgeBy, Estimate, Fill, Parameters, Withheld};
use rowscan_protocol::rig::Rig;
use rowscan_protocol::scan::NO_ECHO;

/// The estimate over the truth, raw.
fn ratio(found: &Estimate, thick_m: f64, density: f64) -> f64 {
    found.leaf.areas.contact_raw_m2().ok().unwrap() / (density * thick_m * HIGH_M * found.scanned_m.unwrap())
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

/// Voxels so small that hardly a beam passes one tell nothing: no leaf area, and not 0.
#[test]
fn voxels_that_too_few_beams_pass_tell_no_leaf_area() {
    let scans = turbid(1.0, 1.0, 200, 3);
    for (edge_m, told) in [(0.02, false), (0.04, false), (0.1, true), (0.25, true)] {
        let found = estimate_with(&rig(), parameters().with_voxel_edge(edge_m, EdgeBy::Given), &scans);
        let why = found.leaf.areas.best_m2().err();
        assert_eq!(why, (!told).then_some(Withheld::TooFewBeams), "{edge_m}: {:?}", found.warnings);
        assert_eq!(found.warnings.iter().any(|warning| warning.code() == "too_few_beams"), !told, "{edge_m}");
    }
}

#[test]
fn misses_matter() {
    let mut scans = turbid(1.0, 2.0, 150, 3);
    let whole = ratio(&estimate_with(&rig(), parameters(), &scans), 1.0, 2.0);
    // Nine in ten of them: without any the row behind the slab would be unknown, and nothing told.
    for range_m in scans.iter_mut().flat_map(|scan| &mut scan.echoes[0].range_m).enumerate() {
        if let (beam, range_m @ &mut NO_ECHO) = range_m
            && beam % 10 > 0
        {
            *range_m = f64::NAN;
        }
    }
    let any = Rig { max_excluded: 1.0, ..rig() };
    let without = ratio(&estimate_with(&any, parameters(), &scans), 1.0, 2.0);
    assert!((whole - 1.0).abs() < 0.02 && without > 1.3, "{whole} {without}");
}

/// What is lost in the same directions all along the row, or in all beams of a part of it, leaves the row unknown; what is lost here and there does not.
#[test]
fn beams_that_are_never_known_withhold_and_those_lost_here_and_there_do_not() {
    let whole = turbid(1.0, 2.0, 150, 3);
    let lost = |lost: &dyn Fn(usize, usize) -> bool| {
        let mut scans = whole.clone();
        for (turn, scan) in scans.iter_mut().enumerate() {
            for (beam, range_m) in scan.echoes[0].range_m.iter_mut().enumerate() {
                *range_m = if lost(turn, beam) { f64::NAN } else { *range_m };
            }
        }
        let found = estimate_with(&rig(), parameters(), &scans);
        let reasons = ["unknown_beams", "too_much_excluded", "nothing_valid"];
        let is_told = found.warnings.iter().any(|warning| reasons.contains(&warning.code()));
        assert_eq!(found.impacted_total_area_m2.is_none(), is_told, "{:?}", found.warnings);
        is_told
    };
    assert!(!lost(&|_, _| false));
    // One beam in seven, by turns.
    assert!(!lost(&|turn, beam| (turn * 5 + beam) % 7 == 0));
    let beams = whole[0].beams.len();
    assert!(lost(&|_, beam| beam > beams / 3 && beam < beams / 2), "a sector");
    assert!(lost(&|turn, _| turn < 75), "half of the row");
    assert!(lost(&|_, _| true), "all");
}

#[test]
fn mirroring_fills_dense_slabs_best() {
    let scans = turbid(2.0, 4.0, 150, 4);
    let off = |fill| {
        let found = estimate_with(&rig(), Parameters { fill, ..parameters() }, &scans);
        let contact = found.contact.unwrap();
        assert!(contact.voxels_unvisited * 10 > contact.voxels_visited);
        assert_eq!(contact.leaf_area_filled_m2 > Some(0.0), fill != Fill::LeaveOut);
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
    assert!(
        relative(found.leaf.areas.lai().ok().unwrap(), expected) < 0.02,
        "{:?}",
        found.leaf.areas.lai().ok()
    );
    assert_eq!(found.trees.len(), 5);
    for tree in &found.trees {
        assert!(tree.complete);
        assert!(relative(tree.leaf.areas.lai().ok().unwrap(), expected) < 0.04, "{tree:?}");
        assert!(
            relative(
                tree.leaf.areas.best_m2().ok().unwrap(),
                tree.leaf.areas.lai().ok().unwrap() * 1.5 * 4.0
            ) < 1e-12
        );
    }
    let of_trees: f64 = found.trees.iter().filter_map(|t| t.leaf.areas.best_m2().ok()).sum();
    let of_slices: f64 = found.slices.iter().filter_map(|s| s.leaf.areas.best_m2().ok()).sum();
    assert!(relative(of_trees, found.leaf.areas.best_m2().ok().unwrap()) < 1e-12);
    assert!(relative(of_slices, found.leaf.areas.best_m2().ok().unwrap()) < 1e-12);
    assert!(found.warnings.iter().any(|w| w.code() == "uncalibrated"));
}

/// Lines that are far apart make 1.44 m of one tree and 1.52 m of the next: their leaf areas are of that, and their index does not alternate.
#[test]
fn the_lai_of_trees_is_of_what_was_scanned_of_them() {
    let mut scans = turbid(1.0, 3.0, 525, 5);
    let mut turn = 0;
    scans.retain(|_| {
        turn += 1;
        turn % 4 == 1
    });
    let found = estimate_with(&rig(), parameters(), &scans);
    let (mut lengths_m, mut off) = (Vec::new(), Vec::new());
    for tree in found.trees.iter().filter(|tree| tree.complete) {
        let [leaf_m2, lai] =
            [tree.leaf.areas.best_m2(), tree.leaf.areas.lai()].map(|known| known.ok().unwrap());
        assert!(relative(leaf_m2, lai * tree.scanned_m * 4.0) < 1e-12, "{tree:?}");
        lengths_m.push((100.0 * tree.scanned_m).round() as u32);
        off.push(lai / (3.0 * HIGH_M / 4.0) - 1.0);
    }
    assert!(lengths_m.contains(&144) && lengths_m.contains(&152), "{lengths_m:?}");
    assert!(off.iter().all(|off| off.abs() < 0.05), "{off:?} of {lengths_m:?}");
}

#[test]
fn lost_lines_leave_the_leaf_area_as_it_is() {
    let scans = turbid(1.0, 2.0, 301, 6);
    let kept = scans.iter().enumerate().filter(|(i, _)| i % 3 != 1).map(|(_, scan)| scan);
    let found = estimate_with(&rig(), parameters(), kept);
    assert!(found.scans_lost > Some(90));
    assert!((ratio(&found, 1.0, 2.0) - 1.0).abs() < 0.02);
}

#[test]
fn a_slab_of_real_leaves_has_its_leaf_area_but_for_the_bias_of_few_leaves_a_voxel() {
    // Leaves of 6 cm, 6 m of row, four slabs: some 32 000 leaves, 8 in a voxel of 0.25 m.
    let (density, radius_m, thick_m, lines) = (1.5, 0.03, 1.0, 300);
    let edges_m = [0.125, 0.25, 0.5];
    let mut means = [0.0; 3];
    for seed in 0..4 {
        let scans = leafy(thick_m, density, radius_m, lines, 100 + seed);
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
