//! A calibration's regression on I_T is one of rows that are planted as its own were: of others it tells nothing, and contact tells them.

use crate::common::*;
use crate::{calibration::line_on, common::scatter};
use rowscan_canopy::{Calibration, Estimate, Pipeline, Sample, Withheld};
use rowscan_protocol::rig::Rig;
use rowscan_protocol::scan::{NO_ECHO, Scan};

/// Trees of a hedge that are so high; one of no height is missing.
fn trees(heights_m: &[f64]) -> Vec<Scan> {
    let lines = 75 * heights_m.len() as u32;
    drive(&orchard_rig(), lms111(), 50, lines, |y_m, theta| {
        let z_m = 1.6 + 1.75 * theta.tan();
        let tree = ((y_m + 1e-9) / 1.5) as usize;
        let high_m = heights_m.get(tree).copied().unwrap_or_default();
        let x_m = 1.75 + 0.12 * scatter(y_m, theta);
        if (0.5..0.5 + high_m).contains(&z_m) && theta.abs() < 1.5 { x_m / theta.cos() } else { NO_ECHO }
    })
}

/// A calibration of rows like the hedge: leaf area goes by a power of I_T.
fn of_power(exponent: f64) -> Calibration {
    let (impacted, contact) = hedge_per_metre();
    let samples: Vec<Sample> = [0.7, 0.8, 0.95, 1.1, 1.2]
        .iter()
        .map(|f| Sample {
            length_m: 1.0,
            impacted_total_area_m2: f * impacted,
            contact_leaf_area_m2: f * contact,
            leaf_area_m2: 3.0 * f64::powf(f * impacted, exponent),
            ..Sample::default()
        })
        .collect();
    line_on(&samples)
}

fn told(calibration: Calibration, rig: &Rig, scans: &[Scan]) -> Estimate {
    let mut pipeline = Pipeline::new(Some(rig), 0, Some(calibration)).unwrap();
    scans.iter().for_each(|scan| pipeline.push(scan));
    pipeline.finish()
}

fn warned(estimate: &Estimate, code: &str) -> bool {
    estimate.warnings.iter().any(|warning| warning.code() == code)
}

#[test]
fn a_regression_of_rows_of_another_tree_spacing_is_withheld_and_contact_is_less_sure() {
    let scans = trees(&[2.0; 8]);
    for (spacing_m, is_told) in [
        (None, true),
        (Some(1.5), true),
        (Some(1.55), true),
        (Some(1.6), false),
        (Some(1.4), false),
        (Some(2.0), false),
    ] {
        let rig = Rig { tree_spacing_m: spacing_m, ..orchard_rig() };
        let found = told(of_power(2.0), &rig, &scans);
        let by_outline = found.leaf.areas.regression_m2();
        assert_eq!(by_outline.err(), (!is_told).then_some(Withheld::OtherSpacing), "{spacing_m:?}");
        assert_eq!(warned(&found, "other_spacing"), !is_told, "{spacing_m:?}: {:?}", found.warnings);
        assert!(found.leaf.areas.best_m2().is_ok(), "{:?}", found.warnings);
        let less_sure = found.leaf.uncertainty.and_then(|parts| parts.spacing);
        assert_eq!(less_sure.is_some_and(|sd| sd > 0.01), !is_told, "{spacing_m:?}: {less_sure:?}");
    }
}

/// A power of a row's mean is not the mean of powers; of a line it is. A gap is no tree.
#[test]
fn a_regression_on_the_mean_of_trees_that_differ_much_is_withheld() {
    let even = [2.0; 8];
    let scattered = [2.0, 1.9, 2.1, 2.0, 1.85, 2.0, 2.1, 1.95];
    let gaps = [2.0, 0.0, 2.0, 2.0, 0.0, 2.0, 2.0, 2.0];
    let replanted = [2.0, 0.5, 2.0, 2.0, 0.5, 2.0, 2.0, 2.0];
    for (heights_m, exponent, is_told) in [
        (even, 3.0, true),
        (scattered, 3.0, true),
        (gaps, 3.0, true),
        (replanted, 3.0, false),
        (replanted, 1.0, true),
    ] {
        let found = told(of_power(exponent), &orchard_rig(), &trees(&heights_m));
        let by_outline = found.leaf.areas.regression_m2();
        let case = format!("{heights_m:?}, exponent {exponent}: {:?}", found.warnings);
        assert_eq!(by_outline.err(), (!is_told).then_some(Withheld::UnevenTrees), "{case}");
        assert_eq!(warned(&found, "uneven_trees"), !is_told, "{case}");
        assert!(found.leaf.areas.best_m2().is_ok(), "{case}");
    }
}
