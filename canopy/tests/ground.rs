//! Ground that a wrong rig puts among the leaves is told.
#![allow(clippy::unwrap_used)]

mod common;

use common::{drive, estimate, lms111, orchard_rig};
use rowscan_canopy::Estimate;
use rowscan_protocol::rig::{Mount, Rig};
use rowscan_protocol::scan::NO_ECHO;

/// Level ground below a mirror at `height_m`, a porous crown before it.
fn orchard_on_ground(told: &Rig, height_m: f64) -> Estimate {
    let mount = Mount { height_m, ..told.scanners[0].clone() };
    let real = Rig { scanners: vec![mount], ..told.clone() };
    let scans = drive(&real, lms111(), 50, 200, |y_m, theta| {
        let dice = ((y_m * 977.0 + theta * 7919.0).sin() * 43_758.547).fract().abs();
        let crown = 1.7 / theta.cos();
        let z_m = height_m + crown * theta.sin();
        if (0.6..2.8).contains(&z_m) && dice < 0.5 {
            crown
        } else if theta < 0.0 {
            height_m / -theta.sin()
        } else {
            NO_ECHO
        }
    });
    // The real heights; the rig that is told has its own.
    estimate(told, &scans)
}

#[test]
fn ground_that_counts_as_canopy_is_told() {
    let warned = |estimate: &Estimate| estimate.warnings.iter().any(|w| w.code() == "ground_as_canopy");
    let told_at = |height_m: f64| {
        let mount = Mount { height_m, ..Mount::default() };
        Rig { scanners: vec![mount], ..orchard_rig() }
    };
    for real_m in [1.2, 1.6, 2.4] {
        for off_m in [-0.3, -0.1, 0.0, 0.05] {
            let found = orchard_on_ground(&told_at(real_m + off_m), real_m);
            assert!(!warned(&found), "{real_m} {off_m}");
        }
        for off_m in [0.12, 0.2, 0.5] {
            let found = orchard_on_ground(&told_at(real_m + off_m), real_m);
            assert!(warned(&found), "{real_m} {off_m}");
        }
        // The mirror the wrong way up.
        let mut told = told_at(real_m);
        let scans = drive(&told, lms111(), 50, 200, |_, theta| {
            if theta > 0.0 { (real_m / theta.sin()).min(1.7 / theta.cos().max(1e-9)) } else { NO_ECHO }
        });
        told.scanners[0].height_m = real_m;
        assert!(warned(&estimate(&told, &scans)), "{real_m} upside down");
    }
}
