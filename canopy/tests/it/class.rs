//! What is told of a row's class: warnings and the interval's width, and no other number.

use crate::common::*;
use rowscan_canopy::calibration::{CalibrationClass, Provenance};
use rowscan_canopy::{Calibration, CanopyClass, Estimate, Parameters, Pipeline, RowClass, Sample, fit};
use rowscan_protocol::rig::{BeamWidth, Mount, Rig};
use rowscan_protocol::scan::{NO_ECHO, Scan};

fn rig() -> Rig {
    Rig { optics: Some(BeamWidth::Ideal), ..orchard_rig() }
}

/// Twelve metres of a porous wall whose share of hits changes from metre to metre.
fn wall() -> Vec<Scan> {
    drive(&rig(), lms111(), 50, 600, |y_m, theta| {
        let share = 0.3 + 0.2 * (y_m.floor() * 2.4).sin();
        let dice = scatter(y_m, theta);
        let x_m = 1.75 + 0.15 * scatter(theta, y_m);
        if dice < share && theta.abs() < 0.9 { x_m / theta.cos() } else { NO_ECHO }
    })
}

fn canopy() -> CanopyClass {
    CanopyClass {
        leaf_angle_deg: Some(48.0),
        leaf_area_cm2: Some(24.7),
        season: Some("full_leaf".into()),
        generator: Some("hmt".into()),
        wood_share: Some(0.05),
    }
}

fn row_class() -> RowClass {
    RowClass { preset: Some("spindle".into()), canopy: canopy() }
}

/// Of the wall, as it is seen: it lies 1.75 to 1.9 m away.
fn crown_depth_m() -> f64 {
    let depth_m = told(None, None).crown_depth_m.expect("known");
    assert!((0.1..0.14).contains(&depth_m), "{depth_m}");
    depth_m
}

fn calibration(canopy: CanopyClass) -> Calibration {
    let class = CalibrationClass {
        distance_m: Some(Mount::default().distance_m),
        height_m: Some(1.6),
        line_spacing_m: Some(0.02),
        crown_depth_m: Some(crown_depth_m()),
        canopy,
        ..class()
    };
    let sample = |f: f64| Sample {
        length_m: 10.0,
        impacted_total_area_m2: 10.0 * f,
        contact_leaf_area_m2: 20.0 * f,
        leaf_area_m2: 18.0 * f,
        ..Sample::default()
    };
    fit(&[0.2, 0.5, 1.0, 2.0, 4.0].map(sample), class, Provenance::default()).expect("it fits")
}

fn told(calibration: Option<Calibration>, class: Option<RowClass>) -> Estimate {
    let mut pipeline = Pipeline::new(Some(&rig()), 0, calibration).expect("a pipeline");
    if let Some(class) = class {
        pipeline = pipeline.of_class(class);
    }
    wall().iter().for_each(|scan| pipeline.push(scan));
    pipeline.finish()
}

fn warned(estimate: &Estimate, code: &str) -> Vec<String> {
    estimate.warnings.iter().filter(|w| w.code() == code).map(ToString::to_string).collect()
}

#[test]
fn no_number_but_the_intervals_width_depends_on_the_class() {
    let unlike = RowClass {
        preset: Some("vase".into()),
        canopy: CanopyClass { leaf_angle_deg: Some(20.0), leaf_area_cm2: Some(60.0), ..canopy() },
    };
    let same = told(Some(calibration(canopy())), Some(row_class()));
    let other = told(Some(calibration(canopy())), Some(unlike));
    let bare = told(Some(calibration(canopy())), None);
    let numbers = |estimate: &Estimate| {
        let mut json = serde_json::to_value(estimate).expect("json");
        let keys = json.as_object_mut().expect("an object");
        for key in ["warnings", "leaf_area_interval_m2", "leaf_area_uncertainty"] {
            assert!(keys.remove(key).is_some(), "{key}");
        }
        for list in ["trees", "slices"] {
            for piece in keys.get_mut(list).and_then(|list| list.as_array_mut()).expect("a list") {
                let interval = piece.as_object_mut().expect("an object").remove("leaf_area_interval_m2");
                assert!(interval.is_some(), "{list}");
            }
        }
        json
    };
    assert_eq!(numbers(&same), numbers(&other));
    assert_eq!(numbers(&same), numbers(&bare));
    let width = |estimate: &Estimate| estimate.leaf.interval_m2.map(|[low, high]| high - low);
    assert!(width(&other) > width(&same), "{:?} {:?}", width(&other), width(&same));
    let of_tree = |estimate: &Estimate| estimate.trees[1].leaf.interval_m2.map(|[low, high]| high - low);
    assert!(of_tree(&other) > of_tree(&same) && of_tree(&bare).is_none(), "{:?}", of_tree(&other));
    // Where all agree nothing is between classes; where nothing is told it is sampling error only.
    assert_eq!(same.leaf.interval_m2, same.leaf.sampling_error_m2);
    assert_eq!(width(&bare), None);
    assert!(bare.leaf.sampling_error_m2.is_some_and(|[low, high]| low < high));
}

#[test]
fn every_key_outside_the_class_is_warned_of_and_none_inside() {
    let same = told(Some(calibration(canopy())), Some(row_class()));
    assert_eq!((warned(&same, "class"), warned(&same, "class_unknown")), (Vec::new(), Vec::new()));
    type Change = fn(&mut RowClass);
    let changes: [(&str, Change); 6] = [
        ("leaf_angle", |row| row.canopy.leaf_angle_deg = Some(35.0)),
        ("leaf_size", |row| row.canopy.leaf_area_cm2 = Some(40.0)),
        ("season", |row| row.canopy.season = Some("bloom".into())),
        ("generator", |row| row.canopy.generator = Some("import".into())),
        ("wood_share", |row| row.canopy.wood_share = Some(0.2)),
        ("training_system", |row| row.preset = Some("hedge".into())),
    ];
    for (key, change) in changes {
        let mut row = row_class();
        change(&mut row);
        let warnings = warned(&told(Some(calibration(canopy())), Some(row)), "class");
        assert!(warnings.len() == 1 && warnings[0].starts_with(&format!("class: {key} is ")), "{warnings:?}");
    }
}

/// A row whose impacted area a metre lies beyond all that the calibration was fitted on is taller or wider open than they were: its interval is wider, by how
/// far, and the number is the same.
#[test]
fn a_row_larger_than_all_that_were_fitted_has_a_wider_interval() {
    let fitted_up_to = |times: f64| {
        let mut calibration = calibration(canopy());
        let found = told(Some(calibration.clone()), Some(row_class()));
        let found_m2_per_m = found.impacted_total_area_m2.expect("known") / found.scanned_m.expect("driven");
        for quality in [&mut calibration.linear.quality, &mut calibration.power.quality] {
            quality.high_m2_per_m = times * found_m2_per_m;
        }
        told(Some(calibration), Some(row_class()))
    };
    let (among, beyond, far) = (fitted_up_to(1.01), fitted_up_to(0.9), fitted_up_to(0.8));
    let outline = |estimate: &Estimate| estimate.leaf.uncertainty.expect("told").outline;
    assert_eq!(outline(&among), None);
    for (estimate, times) in [(&beyond, 0.9_f64), (&far, 0.8)] {
        let sd = outline(estimate).expect("beyond");
        assert!((sd + 0.6 * times.ln()).abs() < 1e-6, "{times}: {sd}");
        assert_eq!(estimate.leaf.areas.best_m2(), among.leaf.areas.best_m2());
    }
    let width = |estimate: &Estimate| estimate.leaf.interval_m2.map(|[low, high]| (high / low).ln());
    assert!(width(&far) > width(&beyond) && width(&beyond) > width(&among), "{:?}", width(&far));
}

#[test]
fn a_calibration_made_from_elsewhere_or_on_other_crowns_is_warned_of_and_widens_the_interval() {
    type Place = fn(&mut CalibrationClass, Option<f64>);
    let own = Mount::default();
    let places: [(&str, f64, Place); 3] = [
        ("distance", own.distance_m, |class, distance_m| class.distance_m = distance_m),
        ("height", own.height_m, |class, height_m| class.height_m = height_m),
        ("crown_depth", crown_depth_m(), |class, depth_m| class.crown_depth_m = depth_m),
    ];
    for (key, own_m, place) in places {
        let from = |place_m: Option<f64>| {
            let mut calibration = calibration(canopy());
            place(&mut calibration.class, place_m);
            told(Some(calibration), Some(row_class()))
        };
        let width = |estimate: &Estimate| estimate.leaf.interval_m2.map(|[low, high]| high - low);
        let [here, beside, twice, four_times, unknown] =
            [Some(own_m), Some(1.2 * own_m), Some(2.0 * own_m), Some(4.0 * own_m), None].map(from);
        assert_eq!(warned(&here, "class"), Vec::<String>::new());
        assert_eq!(warned(&beside, "class"), Vec::<String>::new());
        let warning = format!("class: {key} is ");
        assert!(warned(&twice, "class")[0].starts_with(&warning), "{:?}", twice.warnings);
        assert!(warned(&unknown, "class_unknown")[0].contains(key), "{:?}", unknown.warnings);
        let widths = [&here, &beside, &twice, &four_times].map(width);
        assert!(widths.is_sorted_by(|nearer, farther| nearer < farther), "{key}: {widths:?}");
        assert!(width(&here) < width(&unknown), "what is not told widens");
    }
}

#[test]
fn lines_farther_apart_than_the_calibrations_are_warned_of_and_widen_the_interval() {
    let fitted_at = |line_spacing_m: Option<f64>| {
        let mut calibration = calibration(canopy());
        calibration.class.line_spacing_m = line_spacing_m;
        told(Some(calibration), Some(row_class()))
    };
    let width = |estimate: &Estimate| estimate.leaf.interval_m2.map(|[low, high]| high - low);
    // The scans have a line each 2 cm.
    let [same, near, far, unknown] = [Some(0.02), Some(0.03), Some(0.2), None].map(fitted_at);
    assert!(same.contact.as_ref().unwrap().line_spacing_m.is_some_and(|m| (m - 0.02).abs() < 1e-4));
    assert_eq!((warned(&same, "class"), warned(&near, "class")), (Vec::new(), Vec::new()));
    let warnings = warned(&far, "class");
    assert!(warnings[0].starts_with("class: line_spacing is 0.020 m"), "{warnings:?}");
    assert!(warned(&unknown, "class_unknown")[0].contains("line_spacing"), "{:?}", unknown.warnings);
    assert!(width(&same) < width(&near) && width(&near) < width(&far) && width(&same) < width(&unknown));
}

#[test]
fn without_calibration_lines_are_held_against_what_the_voxels_were_chosen_for() {
    let planned = |line_spacing_m: Option<f64>| {
        let parameters = Parameters { line_spacing_m, ..Parameters::default() };
        let mut pipeline = Pipeline::with_parameters(Some(&rig()), 0, None, parameters).expect("a pipeline");
        wall().iter().for_each(|scan| pipeline.push(scan));
        let found = warned(&pipeline.finish(), "class");
        found.into_iter().filter(|warning| warning.contains("line_spacing")).collect::<Vec<_>>()
    };
    assert_eq!((planned(None), planned(Some(0.02))), (Vec::new(), Vec::new()));
    let warnings = planned(Some(0.005));
    assert!(warnings[0].contains("line_spacing is 0.020 m"), "{warnings:?}");
}

#[test]
fn without_calibration_the_row_is_held_against_what_the_contact_frequency_assumes() {
    let flat = warned(&told(None, Some(row_class())), "class");
    assert!(
        flat.iter().any(|w| w.contains("leaf_angle is 48°, without calibration it is taken for 57°")),
        "{flat:?}"
    );
    assert!(!flat.iter().any(|w| w.contains("leaf_size")), "{flat:?}");
    let assumed = CanopyClass {
        leaf_angle_deg: Some(57.0),
        leaf_area_cm2: Some(24.0),
        wood_share: Some(0.01),
        ..CanopyClass::default()
    };
    let row = RowClass { preset: None, canopy: assumed };
    assert_eq!(warned(&told(None, Some(row)), "class"), Vec::<String>::new());
}

#[test]
fn what_is_not_told_is_unknown_of_row_and_of_old_calibrations() {
    let bare = warned(&told(Some(calibration(canopy())), None), "class_unknown");
    assert!(bare.len() == 1 && bare[0].contains("leaf_angle, leaf_size, season, generator"), "{bare:?}");
    // A calibration of a version before these keys.
    let old = calibration(CanopyClass::default());
    let text = toml::to_string(&old).expect("toml");
    assert!(!text.contains("leaf_angle"));
    assert_eq!(toml::from_str::<Calibration>(&text).expect("it is read"), old);
    let found = told(Some(old), Some(row_class()));
    assert_eq!(warned(&found, "class"), Vec::<String>::new());
    assert!(warned(&found, "class_unknown")[0].contains("leaf_angle"));
    assert!(found.leaf.interval_m2.is_some(), "an unknown key widens as much as one that differs");
}
