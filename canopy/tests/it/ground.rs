//! Ground that a wrong rig puts among the leaves is told, and ground on a slope that the rig tells is no leaf.

use crate::common::{
    drive, estimate, estimate_with, hedge_at, lms111, lms511, orchard_rig, relative, scatter, wall,
};
use rowscan_canopy::{EdgeBy, Estimate, Heading, Parameters, Withheld};
use rowscan_protocol::angle::BeamGrid;
use rowscan_protocol::rig::{Mount, Rig, RowSide};
use rowscan_protocol::scan::{NO_ECHO, Scan};

/// Even ground that rises towards the row axis, Z = 0 there, below a mirror at `height_m`; a porous crown before it.
fn ranges_on_ground(height_m: f64, axis_m: f64, slope_deg: f64) -> impl FnMut(f64, f64) -> f64 {
    let rise = slope_deg.to_radians().tan();
    move |y_m, theta| {
        let dice = scatter(y_m, theta);
        let (sin, cos) = theta.sin_cos();
        let crown = (1.65 + 0.1 * scatter(theta, y_m)) / cos;
        let z_m = height_m + crown * sin;
        if (0.6..2.8).contains(&z_m) && dice < 0.5 {
            crown
        } else if sin < rise * cos {
            (height_m + rise * axis_m) / (rise * cos - sin)
        } else {
            NO_ECHO
        }
    }
}

/// Level ground below a mirror at `height_m`, a porous crown before it.
fn orchard_on_ground(told: &Rig, height_m: f64) -> Estimate {
    let mount = Mount { height_m, ..told.scanners[0].clone() };
    let real = Rig { scanners: vec![mount], ..told.clone() };
    let axis_m = real.scanners[0].distance_m;
    let scans = drive(&real, lms111(), 50, 200, ranges_on_ground(height_m, axis_m, 0.0));
    // The real heights; the rig that is told has its own.
    estimate(told, &scans)
}

fn warned(estimate: &Estimate, code: &str) -> bool {
    estimate.warnings.iter().any(|warning| warning.code() == code)
}

#[test]
fn ground_that_counts_as_canopy_is_told() {
    let warned = |estimate: &Estimate| warned(estimate, "ground_as_canopy");
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
        let sky_below = Rig { ground_clearance_m: -10.0, ..told.clone() };
        let scans = drive(&sky_below, lms111(), 50, 200, |_, theta| {
            if theta > 0.0 { (real_m / theta.sin()).min(1.7 / theta.cos().max(1e-9)) } else { NO_ECHO }
        });
        told.scanners[0].height_m = real_m;
        assert!(warned(&estimate(&told, &scans)), "{real_m} upside down");
    }
}

/// Beams that a wrong roll leads to the ground meet nothing; where a part of the ground does not answer, or no beam leads there, that tells nothing.
#[test]
fn a_clearance_that_takes_leaves_for_ground_is_told() {
    // The crown begins at 0.6 m.
    for clearance_m in [0.1, 0.5, 0.8, 1.5] {
        let told = Rig { ground_clearance_m: clearance_m, scanners: vec![Mount::default()], ..orchard_rig() };
        let found = orchard_on_ground(&told, Mount::default().height_m);
        let text =
            found.warnings.iter().map(ToString::to_string).find(|text| text.starts_with("ground_clearance"));
        assert_eq!(text.is_some(), clearance_m > 0.6, "{clearance_m}: {:?}", found.warnings);
        // Of 2.2 m of crown so much lies below.
        let share = 100.0 * (clearance_m - 0.6) / 2.2;
        let told: Option<f64> = text.and_then(|text| text.split(' ').nth(1)?.parse().ok());
        assert!(told.is_none_or(|told| (told - share).abs() < 6.0), "{clearance_m}: {told:?} {share}");
    }
}

/// Grass that stands out of the clearance counts as leaves: it is told, and the interval reaches down to the row without it. Mown grass, and a clearance above
/// it, are not.
#[test]
fn grass_in_the_alley_is_told_and_the_interval_reaches_to_the_row_without_it() {
    let row = |grass_m: f64, clearance_m: f64| grassy_row(grass_m, 1.0 / 3.0, clearance_m);
    let mown = row(0.0, 0.1);
    let low_m2 = mown.leaf.areas.best_m2().unwrap();
    for (grass_m, clearance_m) in [(0.05, 0.1), (0.0, 0.1), (0.3, 0.35)] {
        let found = row(grass_m, clearance_m);
        assert!(!warned(&found, "growth_in_alley"), "{grass_m} {clearance_m}: {:?}", found.warnings);
        assert!(found.leaf.uncertainty.unwrap().growth.is_none());
    }
    // Tall blades stand in fewer beams.
    for (grass_m, stands) in [(0.3, 1.0 / 3.0), (0.4, 1.0 / 3.0), (0.7, 0.1)] {
        let found = grassy_row(grass_m, stands, 0.1);
        assert!(warned(&found, "growth_in_alley"), "{grass_m}: {:?}", found.warnings);
        let leaf_m2 = found.leaf.areas.best_m2().unwrap();
        let shift = found.leaf.uncertainty.unwrap().growth.unwrap();
        assert!(
            leaf_m2 > 1.02 * low_m2 && leaf_m2 * shift.exp() < 1.02 * low_m2,
            "{grass_m}: {leaf_m2} {low_m2} {shift}"
        );
        // No lower than what of the crown stands below the blades' tops, and what they shade.
        let of_crown = (grass_m - 0.6).max(0.0) / 2.2 + 0.1;
        assert!(leaf_m2 * shift.exp() > (0.95 - of_crown) * low_m2, "{grass_m}: {leaf_m2} {low_m2} {shift}");
    }
}

/// A row of which a share of the beams meets blades of grass in the alley, up to `grass_m`.
fn grassy_row(grass_m: f64, share: f64, clearance_m: f64) -> Estimate {
    let mount = Mount::default();
    let told = Rig { ground_clearance_m: clearance_m, scanners: vec![mount.clone()], ..orchard_rig() };
    let mut on_ground = ranges_on_ground(mount.height_m, mount.distance_m, 0.0);
    let scans = drive(&told, lms111(), 50, 400, |y_m, theta| {
        let behind = on_ground(y_m, theta);
        // Blades 0.7 to 1.2 m before the mirror: the crown begins at 1.65 m.
        let across_m = 0.7 + 0.5 * scatter(2.0 * theta, y_m);
        let stands = scatter(theta, 3.0 * y_m) < share;
        let range_m = across_m / theta.cos();
        let above_m = mount.height_m + range_m * theta.sin();
        if stands && range_m < behind && (0.0..grass_m).contains(&above_m) { range_m } else { behind }
    });
    estimate(&told, &scans)
}

#[test]
fn ground_that_answers_no_beam_withholds() {
    for height_m in [1.2, 1.6, 2.4] {
        let told = Rig { scanners: vec![Mount { height_m, ..Mount::default() }], ..orchard_rig() };
        let no_ground = Rig { ground_clearance_m: -10.0, ..told.clone() };
        let mut on_ground = ranges_on_ground(height_m, told.scanners[0].distance_m, 0.0);
        let mut answers = |share: f64, least_rad: f64| {
            let scans = drive(&no_ground, lms111(), 50, 200, |y_m, theta| {
                let is_ground = 0.2 > height_m + on_ground(y_m, theta) * theta.sin();
                let silent = is_ground && scatter(theta, y_m) >= share || theta < least_rad;
                if silent { NO_ECHO } else { on_ground(y_m, theta) }
            });
            let found = estimate(&told, &scans);
            let words =
                found.warnings.iter().map(ToString::to_string).find(|text| text.starts_with("ground_silent"));
            assert!(words.iter().all(|text| text.contains("`roll_deg`")), "{words:?}");
            let withheld = found.leaf.areas.best_m2().err();
            assert_eq!(
                withheld == Some(Withheld::GroundSilent),
                words.is_some(),
                "{height_m} {share}: {withheld:?}"
            );
            words.is_some()
        };
        assert!(answers(0.0, -2.0), "{height_m}");
        assert!(answers(0.05, -2.0), "{height_m}");
        // Wet spots, and a part of the field that meets nothing.
        assert!(!answers(0.5, -2.0), "{height_m}");
        assert!(!answers(1.0, -1.1), "{height_m}");
        // A scanner whose field ends above the ground before the row.
        let narrow = BeamGrid::spanning(700_000, 1_800_000, 5000);
        let scans = drive(&no_ground, narrow, 50, 200, |y_m, theta| {
            let range_m = on_ground(y_m, theta);
            if 0.2 > height_m + range_m * theta.sin() { NO_ECHO } else { range_m }
        });
        assert!(!warned(&estimate(&told, &scans), "ground_silent"), "{height_m}");
    }
}

#[test]
fn ground_that_lies_elsewhere_than_the_rig_has_it_is_told() {
    for real_m in [1.2, 1.6, 2.4] {
        for (off_m, told) in [
            (-0.3, true),
            (-0.14, true),
            (-0.05, false),
            (0.0, false),
            (0.04, false),
            (0.1, true),
            (0.3, true),
        ] {
            let mount = Mount { height_m: real_m + off_m, ..Mount::default() };
            let found = orchard_on_ground(&Rig { scanners: vec![mount], ..orchard_rig() }, real_m);
            // Where it counts as canopy, that is told, and no leaf area.
            let counts = warned(&found, "ground_as_canopy");
            assert_eq!(counts, off_m >= 0.1, "{real_m} {off_m}: {:?}", found.warnings);
            assert_eq!(found.leaf.areas.best_m2().err(), counts.then_some(Withheld::GroundAsCanopy));
            // Half a metre and more below, low leaves are taken for ground.
            let mount = Mount { height_m: real_m - 0.5, ..Mount::default() };
            let below = orchard_on_ground(&Rig { scanners: vec![mount], ..orchard_rig() }, real_m);
            assert_eq!(below.leaf.areas.best_m2().err(), Some(Withheld::GroundLevel), "{real_m}");
            assert_eq!(warned(&found, "ground_level") || counts, told, "{real_m} {off_m}");
            assert!(!warned(&found, "ground_slope"), "{real_m} {off_m}");
        }
    }
}

/// A rig whose first scanner looks at this row, and how high its mirror is above that row's foot where the ground has this slope.
fn on_a_slope(rows: &[RowSide], slope_deg: f64) -> (Rig, f64) {
    let scanners: Vec<Mount> = rows.iter().map(|row| Mount { row: *row, ..Mount::default() }).collect();
    let rig = Rig { ground_slope_deg: Some(slope_deg), scanners, ..orchard_rig() };
    // Between two rows, the one on the right is a spacing up the slope.
    let up_m = if rows == [RowSide::Right, RowSide::Left] { 4.0 * slope_deg.to_radians().tan() } else { 0.0 };
    let height_m = rig.scanners[0].height_m - up_m;
    (rig, height_m)
}

/// What its first scanner sees; the slope as the scanner sees it has the other sign on the tractor's left.
fn scans_on_a_slope(rig: &Rig, grid: BeamGrid, height_m: f64, slope_deg: f64) -> Vec<Scan> {
    let mount = &rig.scanners[0];
    drive(rig, grid, 50, 320, ranges_on_ground(height_m, mount.distance_m, mount.side() * slope_deg))
}

const ROWS: [&[RowSide]; 3] = [&[RowSide::Right], &[RowSide::Left], &[RowSide::Right, RowSide::Left]];
const SLOPES_DEG: [f64; 8] = [-15.0, -10.0, -6.0, -3.5, 3.5, 6.0, 10.0, 15.0];

#[test]
fn on_a_slope_that_is_told_a_row_has_the_leaves_of_level_ground() {
    let raw_m2 = |estimate: &Estimate| estimate.leaf.areas.contact_raw_m2().unwrap();
    for rows in ROWS {
        for grid in [lms111(), lms511()] {
            for slope_deg in SLOPES_DEG {
                let (rig, height_m) = on_a_slope(rows, slope_deg);
                let found = estimate(&rig, &scans_on_a_slope(&rig, grid, height_m, slope_deg));
                // The same crown, seen from as high above its foot.
                let mut level = Rig { ground_slope_deg: None, ..rig.clone() };
                level.scanners.iter_mut().for_each(|mount| mount.height_m = height_m);
                let flat = estimate(&level, &scans_on_a_slope(&level, grid, height_m, 0.0));
                let off = relative(raw_m2(&found), raw_m2(&flat));
                assert!(off < 0.05, "{rows:?} {slope_deg}: {off}");
                assert!(!warned(&found, "ground_slope"), "{rows:?} {slope_deg}: {:?}", found.warnings);
                assert_eq!(
                    found.returns.unwrap().canopy,
                    flat.returns.unwrap().canopy,
                    "{rows:?} {slope_deg}"
                );
            }
        }
    }
}

#[test]
fn a_slope_that_is_not_the_rigs_is_told_from_3_degrees_and_withheld_from_6() {
    let judged = |told: Option<f64>, found: &Estimate| {
        let withheld = found.leaf.areas.best_m2().err().map(|why| why.code());
        let text =
            found.warnings.iter().map(ToString::to_string).find(|text| text.starts_with("ground_slope"));
        assert!(text.iter().all(|text| text.contains("`ground_slope_deg`")), "{text:?}");
        let codes = [None, Some("ground_slope"), Some("ground_as_canopy")];
        assert!(codes.contains(&withheld), "{told:?}: {withheld:?}");
        // Ground that reaches the canopy withholds whatever its slope.
        (text, withheld == Some("ground_slope"))
    };
    for rows in &ROWS[..2] {
        for slope_deg in [-15.0, -6.0, -3.5, -3.0, -2.0, 0.0, 2.0, 3.0, 3.5, 6.0, 15.0] {
            let (right, height_m) = on_a_slope(rows, slope_deg);
            let scans = scans_on_a_slope(&right, lms111(), height_m, slope_deg);
            for told in [None, Some(0.0), Some(slope_deg), Some(-slope_deg), Some(slope_deg / 2.0)] {
                let off_deg = (slope_deg - told.unwrap_or(0.0)).abs();
                let rig = Rig { ground_slope_deg: told, ..right.clone() };
                let (text, withheld) = judged(told, &estimate(&rig, &scans));
                if off_deg >= 3.0 || off_deg <= 2.0 {
                    assert_eq!(
                        text.is_some(),
                        off_deg >= 3.0,
                        "{rows:?} {slope_deg}, told {told:?}: {text:?}"
                    );
                }
                if off_deg >= 6.0 || off_deg <= 4.0 {
                    assert_eq!(withheld, off_deg >= 6.0, "{rows:?} {slope_deg}, told {told:?}: {text:?}");
                }
                // Found, and told: to a third of a degree.
                let numbers: Vec<f64> = text
                    .iter()
                    .flat_map(|text| text.split(['°', ' ']))
                    .filter_map(|word| word.parse().ok())
                    .collect();
                let near = numbers
                    .iter()
                    .zip([slope_deg, told.unwrap_or(0.0)])
                    .all(|(found, expected)| (found - expected).abs() < 0.3);
                assert!(
                    near && (text.is_none() || numbers.len() == 2),
                    "{slope_deg}, told {told:?}: {text:?}"
                );
            }
        }
    }
}

/// A hedge that no beam passes, in voxels so large that it fills them by what it holds at its face, has no leaf area.
#[test]
fn more_leaves_than_any_orchard_has_are_withheld() {
    // On the axis, and 0.4 m before it.
    for (face_m, edge_m, expected) in [(1.75, 0.25, None), (1.5, 0.3, Some(Withheld::TooManyLeaves))] {
        let parameters = Parameters::default().with_voxel_edge(edge_m, EdgeBy::Given);
        let found = estimate_with(&orchard_rig(), parameters, &hedge_at(face_m, 225));
        assert_eq!(found.leaf.areas.best_m2().err(), expected, "{edge_m}: {:?}", found.warnings);
        let words =
            found.warnings.iter().map(ToString::to_string).find(|text| text.starts_with("too_many_leaves"));
        assert_eq!(words.is_some_and(|text| text.contains("`distance_m`")), expected.is_some());
    }
}

/// Whatever a roll or a slope is off by: a leaf area that is told is that of the rig that is right.
#[test]
fn a_leaf_area_that_is_told_has_no_ground_in_it() {
    let raw_m2 = |estimate: &Estimate| estimate.leaf.areas.contact_raw_m2();
    for rows in &ROWS[..2] {
        for height_m in [1.2, 1.6, 2.4] {
            let mut rig = on_a_slope(rows, 0.0).0;
            rig.scanners[0].height_m = height_m;
            let of = |slope_deg| {
                let scans = scans_on_a_slope(&rig, lms111(), height_m, slope_deg);
                estimate(&rig, &scans)
            };
            let flat_m2 = raw_m2(&of(0.0)).unwrap();
            let mut withheld = 0;
            for half_degrees in -18..=18 {
                let slope_deg = f64::from(half_degrees) / 2.0;
                match raw_m2(&of(slope_deg)) {
                    Ok(found_m2) => {
                        let off = found_m2 / flat_m2 - 1.0;
                        assert!(off.abs() < 0.1, "{rows:?} {height_m} m, {slope_deg}°: {off}");
                    }
                    Err(_) => withheld += 1,
                }
            }
            // The rig's own slope, and a little beside it, is told.
            assert!((14..=30).contains(&withheld), "{rows:?} {height_m} m: {withheld}");
        }
    }
}

/// A roll that is wrong by any angle, all around.
#[test]
fn no_leaf_area_is_told_by_a_roll_that_is_far_off() {
    for rows in &ROWS[..2] {
        for height_m in [1.2, 1.6, 2.4] {
            let mut real = on_a_slope(rows, 0.0).0;
            real.scanners[0].height_m = height_m;
            let scans = scans_on_a_slope(&real, lms111(), height_m, 0.0);
            let of = |off_deg: i32| {
                let mut told = real.clone();
                told.scanners[0].roll_deg = f64::from(off_deg);
                estimate(&told, &scans)
            };
            assert!(of(0).leaf.areas.contact_raw_m2().is_ok_and(|leaf_m2| leaf_m2 > 1.0));
            for off_deg in (-180_i32..180).step_by(5).filter(|off_deg| off_deg.abs() > 5) {
                let found = of(off_deg);
                let leaf_m2 = found.leaf.areas.contact_raw_m2();
                assert!(
                    leaf_m2.is_err(),
                    "{rows:?} {height_m} m, {off_deg}°: {leaf_m2:?} {:?}",
                    found.warnings
                );
            }
        }
    }
}

/// Half of the drive is in an alley driven back, where the tractor has the slope's upper side on its other hand.
#[test]
fn an_alley_driven_back_has_the_other_slope_and_that_is_told() {
    let (rig, height_m) = on_a_slope(&[RowSide::Right], 6.0);
    let axis_m = rig.scanners[0].distance_m;
    let mut ahead = ranges_on_ground(height_m, axis_m, 6.0);
    let mut back = ranges_on_ground(height_m, axis_m, -6.0);
    let scans =
        drive(
            &rig,
            lms111(),
            50,
            1000,
            |y_m, theta| {
                if y_m < 10.0 { ahead(y_m, theta) } else { back(y_m, theta) }
            },
        );
    let found = estimate(&rig, &scans);
    assert_eq!(
        found.leaf.areas.best_m2().map_err(|why| why.code()),
        Err("ground_slope"),
        "{:?}",
        found.warnings
    );
    // A pass from the row's other side that is driven back is read with the other sign.
    for (is_back, expected) in [(false, 6.0), (true, -6.0)] {
        let other = Heading { start_m: 3.0, back: is_back }.rig(&rig, 0.25);
        assert_eq!(other.ground_slope_deg, Some(expected));
    }
}

#[test]
fn ground_that_is_not_seen_tells_no_slope() {
    let rig = orchard_rig();
    let mount = &rig.scanners[0];
    // A wall before it, and one whose foot leans.
    for lean in [0.0, 0.3] {
        let scans = drive(&rig, lms111(), 50, 300, |y_m, theta| {
            wall(1.2 + lean * (theta * 9.0).sin())(y_m, theta).min(if theta < -1.2 {
                mount.height_m / -theta.sin()
            } else {
                NO_ECHO
            })
        });
        assert!(!warned(&estimate(&rig, &scans), "ground_slope"), "{lean}");
    }
}

#[test]
fn level_ground_that_is_told_changes_no_number() {
    let rig = Rig { ground_slope_deg: Some(0.0), ..orchard_rig() };
    let scans = scans_on_a_slope(&rig, lms111(), 1.6, 0.0);
    let json = |rig: &Rig| serde_json::to_string(&estimate(rig, &scans)).unwrap();
    assert_eq!(json(&rig), json(&orchard_rig()));
}
