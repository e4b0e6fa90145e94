//! A row that does not stand about the rig's axis has no leaf area: what is hidden would be taken for the mirror image of what was seen, about the wrong axis.

use crate::common::slab::*;
use crate::common::*;

use rowscan_canopy::{Warning, Withheld};
use rowscan_protocol::scan::Scan;

/// The same scans, read by a rig whose row is so far from the scanner.
fn told_at(distance_m: f64, scans: &[Scan]) -> (Result<f64, Withheld>, Vec<Warning>) {
    let mut rig = rig();
    rig.scanners[0].distance_m = distance_m;
    let found = estimate_with(&rig, parameters(), scans);
    (found.leaf.areas.best_m2(), found.warnings)
}

#[test]
fn what_is_told_of_a_row_hangs_little_on_where_its_axis_is_believed_to_be() {
    let (mut withheld, mut told) = (0, 0);
    // Thick and thin, sparse and dense.
    for (thick_m, density) in [(0.5, 1.0), (0.6, 8.0), (1.0, 0.7), (1.0, 4.0), (1.2, 1.0), (1.2, 3.0)] {
        let scans = turbid(thick_m, density, 400, 11);
        let right_m2 =
            told_at(DISTANCE_M, &scans).0.unwrap_or_else(|why| panic!("{thick_m} {density}: {why}"));
        for off_m in [-1.0, -0.5, 0.5, 1.0] {
            let case = format!("{thick_m} {density} {off_m}");
            match told_at(DISTANCE_M + off_m, &scans) {
                (Ok(found_m2), _) => {
                    assert!(relative(found_m2, right_m2) < 0.15, "{case}: {found_m2} for {right_m2}");
                    told += 1;
                }
                (Err(why), warnings) => {
                    assert_eq!(why, Withheld::RowElsewhere, "{case}");
                    let faces = warnings.iter().find(|warning| warning.code() == "row_elsewhere");
                    let Some(Warning::RowElsewhere { near_m, far_m, distance_m }) = faces else {
                        panic!("{warnings:?}")
                    };
                    let middle_m = distance_m + 0.5 * (near_m + far_m);
                    // Of a dense slab more of its near half is seen.
                    assert!((middle_m - DISTANCE_M).abs() < 0.25 * thick_m, "{case}: {middle_m}");
                    withheld += 1;
                }
            }
        }
    }
    assert!(withheld > 2 && told > 6, "{withheld} {told}");
}

#[test]
fn how_well_the_distance_is_known_widens_the_interval_by_what_is_hidden() {
    let of = |off_m: f64, distance_sd_m: f64, scans: &[Scan]| {
        let mut rig = rig();
        rig.scanners[0].distance_m += off_m;
        rig.scanners[0].distance_sd_m = distance_sd_m;
        let found = estimate_with(&rig, parameters(), scans);
        (found.leaf.areas.best_m2().ok(), found.leaf.uncertainty.unwrap().distance)
    };
    let mut sds = Vec::new();
    for (thick_m, density) in [(1.0, 0.3), (1.0, 0.7), (1.2, 1.0), (0.6, 8.0), (1.0, 4.0), (1.0, 6.0)] {
        let scans = turbid(thick_m, density, 400, 11);
        let (right_m2, none) = of(0.0, 0.0, &scans);
        assert_eq!(none, None, "nobody says how well it is known");
        for off_m in [-0.2, -0.1, 0.1, 0.2_f64] {
            let (found_m2, sd) = of(off_m, off_m.abs(), &scans);
            let Some((found_m2, sd)) = found_m2.zip(sd) else { continue };
            let off = (found_m2 / right_m2.unwrap()).ln();
            // And 3 % that another grid of voxels makes.
            assert!(off.abs() <= 1.96 * sd + 0.03, "{thick_m} {density} {off_m}: {off} {sd}");
            assert!(
                of(off_m, 2.0 * off_m.abs(), &scans).1.is_some_and(|twice| (twice - 2.0 * sd).abs() < 1e-12)
            );
        }
        sds.push(of(0.0, 0.1, &scans).1.unwrap());
        assert_eq!(of(0.0, 0.1, &scans).0, right_m2, "the number stays");
    }
    assert!(sds[0] < 0.01 && sds[5] > 0.05, "{sds:?}");
}

#[test]
fn a_row_of_which_only_the_near_face_is_seen_is_not_told_either() {
    // 12 m² of leaves a m³: beams end within 0.7 m, before the axis.
    let (found, warnings) = told_at(DISTANCE_M, &turbid(1.5, 12.0, 400, 5));
    assert_eq!(found, Err(Withheld::RowElsewhere));
    let text = warnings.iter().map(ToString::to_string).find(|text| text.starts_with("row_elsewhere"));
    assert!(text.as_ref().is_some_and(|text| text.contains("so dense")), "{text:?}");
}

#[test]
fn a_scanner_that_is_driven_through_the_crowns_tells_no_leaf_area() {
    // The near face lies 0.1 m beside the mirror, then 0.6 m.
    let (found, warnings) = told_at(DISTANCE_M, &turbid(3.6, 4.0, 400, 5));
    assert_eq!(found, Err(Withheld::CanopyAtScanner));
    let text = warnings.iter().map(ToString::to_string).find(|text| text.starts_with("canopy_at_scanner"));
    assert!(text.as_ref().is_some_and(|text| text.contains("within 0.35 m")), "{text:?}");
    let (found, _) = told_at(DISTANCE_M, &turbid(2.6, 4.0, 400, 5));
    assert_ne!(found, Err(Withheld::CanopyAtScanner));
}
