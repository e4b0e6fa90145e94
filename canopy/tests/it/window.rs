//! The window just driven past beside the estimate of the same scans: one verdict, one leaf area.

use std::sync::Arc;

use crate::common::*;
use rowscan_canopy::{
    Calibration, Estimate, Footprint, Heading, LeafShape, LeafSlice, Parameters, Pipeline, Withheld, shipped,
};
use rowscan_protocol::model::AnyModel;
use rowscan_protocol::optics::{Fact, Spot};
use rowscan_protocol::rig::{BeamWidth, EchoChoice, Mount, Rig};
use rowscan_protocol::scan::{NO_ECHO, Scan};
use rowscan_protocol::validity::DeviceStatus;

const LINES: u32 = 600;

fn chance(y_m: f64, theta: f64) -> f64 {
    ((y_m * 977.0 + theta * 7919.0).sin() * 43_758.547).fract().abs()
}

/// A row of crowns 1.5 m apart, from 0.5 to 2.5 m high, denser in their middles, that get thinner along the row.
fn crowns(y_m: f64, theta: f64) -> f64 {
    let (thick_m, near_m) = (0.8, Mount::default().distance_m - 0.4);
    let density = (0.9 - 0.03 * y_m) * (std::f64::consts::PI * y_m / 1.5).sin().abs();
    let range_m = near_m + thick_m * -(1.0 - chance(y_m, theta)).ln() / (2.0 * density);
    let range_m = range_m / theta.cos();
    let z_m = Mount::default().height_m + range_m * theta.sin();
    let inside = theta.cos() > 0.0 && range_m * theta.cos() < near_m + thick_m && (0.5..2.5).contains(&z_m);
    if inside { range_m } else { NO_ECHO }
}

fn spindle() -> Calibration {
    toml::from_str(shipped::text("spindle-lms111").unwrap()).unwrap()
}

/// A spot as thin as a ray.
fn rays(echo: Option<EchoChoice>) -> Footprint {
    let none = Fact::assumed(0.0);
    Footprint {
        spot: Spot { exit_mm: none, divergence_mrad: none, sweep_mrad: none, effective: Fact::assumed(1.0) },
        least_power: 0.0,
        least_share: 0.0,
        least_share_sd: 0.0,
        leaf: LeafShape::default(),
        echo,
        merged_m: 0.0,
        clumping: 1.0,
        clump_m: f64::INFINITY,
        law: None,
    }
}

fn pipeline(rig: &Rig, parameters: Parameters) -> Pipeline {
    Pipeline::with_parameters(Some(rig), 0, Some(spindle()), parameters).unwrap()
}

/// What an estimate of the scans so far withholds, and what the window does.
fn verdicts(pipeline: &Pipeline) -> [Option<Withheld>; 2] {
    let estimate = pipeline.estimate();
    let of_estimate = estimate.leaf.areas.best_m2().err();
    let window = pipeline.window();
    assert_eq!(window.is_ok(), estimate.impacted_total_area_m2.is_some(), "{window:?}");
    [of_estimate, window.and_then(|window| window.leaf).err()]
}

#[test]
fn at_every_scan_the_window_withholds_what_an_estimate_of_the_scans_so_far_withholds() {
    let rig = orchard_rig();
    let foliage = drive(&rig, lms111(), 50, LINES, crowns);
    let solid = drive(&rig, lms111(), 50, LINES, wall(Mount::default().distance_m + 1e-4));
    let mut damaged = foliage.clone();
    damaged.iter_mut().skip(300).step_by(2).for_each(|scan| scan.status = DeviceStatus::ContaminationError);
    damaged.drain(400..460);
    let nothing = drive(&rig, lms111(), 50, LINES, |_, _| NO_ECHO);
    let plain = Parameters::default();
    let wide = Parameters { footprint: Some(rays(None)), ..plain };
    let cases: [(&str, Vec<Scan>, Parameters, Option<Withheld>); 5] = [
        ("foliage", foliage.clone(), plain, None),
        ("a wall", solid, plain, Some(Withheld::NoFoliage)),
        ("a dirty window", damaged, plain, Some(Withheld::TooMuchExcluded)),
        ("nothing", nothing, plain, None),
        ("an unknown echo", foliage, wide, Some(Withheld::EchoUnknown)),
    ];
    for (name, scans, parameters, expected) in cases {
        let mut pipeline = pipeline(&rig, parameters);
        for (number, scan) in scans.iter().enumerate() {
            pipeline.push(scan);
            // Of the first line nobody knows yet how much row it stands for.
            if number > 0 && number % 3 == 0 {
                let [estimate, window] = verdicts(&pipeline);
                assert_eq!(estimate, window, "{name}, scan {number}");
            }
        }
        pipeline.finish();
        assert_eq!(verdicts(&pipeline), [expected; 2], "{name}");
    }
    let mut without = Pipeline::new(None, 0, None).unwrap();
    without.push(&drive(&rig, lms111(), 50, 1, crowns)[0]);
    assert_eq!(without.window().err(), Some(Withheld::NoRig));
}

/// A pass that tells nothing by itself tells nothing of the row joined with another one, whatever the two add up to.
#[test]
fn a_pass_that_is_withheld_withholds_what_it_is_joined_with() {
    let rig = orchard_rig();
    let foliage = drive(&rig, lms111(), 50, LINES, crowns);
    let solid = drive(&rig, lms111(), 50, LINES, wall(Mount::default().distance_m + 1e-4));
    for (other, expected) in [(&foliage, None), (&solid, Some(Withheld::NoFoliage))] {
        let mut seen = pipeline(&rig, Parameters::default()).keeping_voxels();
        other.iter().for_each(|scan| seen.push(scan));
        seen.finish();
        let side = Arc::new(seen.other_side(Heading::default()).expect("voxels"));
        let mut joined = pipeline(&rig, Parameters::default()).joined_with(side).expect("a rig");
        foliage.iter().for_each(|scan| joined.push(scan));
        joined.finish();
        assert_eq!(verdicts(&joined), [expected; 2]);
    }
}

/// The slices of all windows of a drive, each once, and the estimate; `live` hears every window.
fn slices(rig: &Rig, parameters: Parameters, mut live: impl FnMut(f64, f64)) -> (Vec<LeafSlice>, Estimate) {
    let mut pipeline = pipeline(rig, parameters);
    let mut all: Vec<LeafSlice> = Vec::new();
    for scan in drive(rig, lms111(), 50, LINES, crowns) {
        pipeline.push(&scan);
        let Ok(window) = pipeline.window().and_then(|window| window.leaf) else { continue };
        live(pipeline.progress().advance_m.unwrap(), window.factor());
        let new = window.slices().iter().rev();
        all.extend(
            new.filter(|slice| pipeline.progress().y_m.unwrap() > slice.y_m[1])
                .filter(|slice| all.last().is_none_or(|last| slice.y_m[0] > last.y_m[0] + 1e-9))
                .copied()
                .collect::<Vec<_>>(),
        );
    }
    let estimate = pipeline.finish();
    let window = pipeline.window().unwrap().leaf.unwrap();
    let last = all.last().copied().unwrap();
    all.extend(window.slices().iter().rev().filter(|slice| slice.y_m[0] > last.y_m[0] + 1e-9).copied());
    (all, estimate)
}

#[test]
fn windows_that_do_not_overlap_add_up_to_the_row() {
    for slice_m in [0.05, 0.25, 0.4, 1.0] {
        let parameters = Parameters { slice_m, ..Parameters::default() };
        let mut factors = Vec::new();
        let (slices, estimate) =
            slices(&orchard_rig(), parameters, |y_m, factor| factors.push((y_m, factor)));
        let factor = factors.last().unwrap().1;
        let raw_m2: f64 = slices.iter().map(LeafSlice::raw_m2).sum();
        let row = &estimate.leaf.areas;
        assert!(relative(raw_m2, row.contact_raw_m2().unwrap()) < 1e-9, "{slice_m}: {raw_m2}");
        assert!(relative(factor * raw_m2, row.best_m2().unwrap()) < 0.005, "{slice_m}");
        let scanned_m: f64 = slices.iter().map(|slice| slice.length_m).sum();
        assert!(relative(scanned_m, estimate.scanned_m.unwrap()) < 1e-9, "{scanned_m}");
        // The row gets thinner, so the factor of a power law changes on the way; after 3 m not by much.
        let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
        for (_, live) in factors.iter().filter(|(y_m, _)| *y_m > 3.0) {
            (least, most) = (least.min(live / factor), most.max(live / factor));
        }
        assert!(least > 0.95 && most < 1.05, "{slice_m}: {least} to {most}");
        assert!(slice_m != 0.25 || most - least > 1e-4, "a law that does not bend proves nothing");
    }
}

#[test]
fn a_window_is_shared_out_by_height_and_over_ground() {
    let mut pipeline = pipeline(&orchard_rig(), Parameters::default());
    drive(&orchard_rig(), lms111(), 50, 200, crowns).iter().for_each(|scan| pipeline.push(scan));
    let window = pipeline.window().unwrap().leaf.unwrap();
    let bands = window.bands_m2_per_m();
    assert!((window.length_m() - 0.5).abs() < 0.05 && window.behind_m < 0.27, "{window:?}");
    assert!(relative(bands.iter().sum(), window.m2_per_m()) < 1e-12);
    // Foliage stands from 0.5 to 2.5 m; voxels reach a little beyond.
    assert!(
        bands[1..5].iter().all(|band| *band > 0.1) && bands[6..].iter().all(|band| *band == 0.0),
        "{bands:?}"
    );
    assert!(relative(window.lai().unwrap(), window.m2_per_m() / 4.0) < 1e-12);
    let unspaced = Rig { tree_spacing_m: None, ..orchard_rig() };
    let mut pipeline = Pipeline::new(Some(&unspaced), 0, None).unwrap();
    drive(&unspaced, lms111(), 50, 200, crowns).iter().for_each(|scan| pipeline.push(scan));
    let window = pipeline.window().unwrap().leaf.unwrap();
    assert_eq!(window.lai(), Err(Withheld::NoSpacing));
    assert_eq!(pipeline.finish().leaf.areas.lai(), Err(Withheld::NoSpacing));
}

#[test]
fn a_calibration_of_rays_on_wide_beams_withholds_the_regression_and_keeps_contact() {
    let rig = Rig { optics: Some(BeamWidth::Device), ..orchard_rig() };
    let spot = rays(Some(EchoChoice::First));
    let mut pipeline = pipeline(&rig, Parameters { footprint: Some(spot), ..Parameters::default() });
    drive(&rig, lms111(), 50, LINES, crowns).iter().for_each(|scan| pipeline.push(scan));
    let areas = pipeline.finish().leaf.areas;
    assert_eq!(areas.regression_m2(), Err(Withheld::CalibratedOnRays));
    let window = pipeline.window().unwrap().leaf.unwrap();
    assert!(areas.best_m2().is_ok() && window.m2_per_m() > 0.0);
}

#[test]
fn a_scanner_that_refuses_the_echo_and_sends_the_last_by_itself_tells_no_leaf_area() {
    use rowscan_protocol::host::SettingNote;
    let refused = |command| SettingNote::Refused { command, error: None };
    for (model, notes, withheld) in [
        ("lms511", vec![refused("FREchoFilter")], Some(Withheld::EchoUnknown)),
        // Another setting; and a scanner that sends the first by itself.
        ("lms511", vec![refused("LMPoutputRange")], None),
        ("lms111", vec![refused("FREchoFilter")], None),
        ("lms511", vec![], None),
    ] {
        let mut rig = orchard_rig();
        rig.optics = Some(BeamWidth::Device);
        rig.scanners[0].model = model.into();
        let optics = AnyModel::by_name(model).unwrap().optics();
        let footprint = Footprint::of(optics, LeafShape::default());
        let mut pipeline = pipeline(&rig, Parameters { footprint: Some(footprint), ..Parameters::default() });
        pipeline.set_up(&notes);
        drive(&rig, lms111(), 50, 200, wall(2.0)).iter().for_each(|scan| pipeline.push(scan));
        let told = pipeline.window().unwrap().leaf.err();
        assert_eq!(told.filter(|why| *why == Withheld::EchoUnknown), withheld, "{model} {notes:?}");
        assert_eq!(pipeline.finish().warnings.iter().any(|w| w.code() == "echo_unknown"), withheld.is_some());
    }
}

/// Scans that tell their echo are measured as by a rig that says the same, whatever it says; once they tell another, nothing is known.
#[test]
fn the_echo_that_scans_tell_decides_to_the_last_bit() {
    use rowscan_canopy::estimator::TABLE;
    let mut rig = orchard_rig();
    rig.optics = Some(BeamWidth::Device);
    let all = TABLE.iter().collect::<Vec<_>>();
    let measured = |believed: Option<EchoChoice>, told: &[Option<EchoChoice>]| {
        let optics = AnyModel::by_name("lms511").unwrap().optics();
        let footprint = Footprint { echo: believed, ..Footprint::of(optics, LeafShape::default()) };
        let parameters = Parameters { footprint: Some(footprint), ..Parameters::default() };
        let pipeline = Pipeline::with_parameters(Some(&rig), 0, None, parameters).unwrap();
        let mut pipeline = pipeline.with_estimators(&all).with_profile(0.5).unwrap();
        let scans = drive(&rig, lms111(), 50, LINES, crowns);
        let half = scans.len().div_ceil(told.len());
        for (number, mut scan) in scans.into_iter().enumerate() {
            scan.echo = told[number / half];
            pipeline.push(&scan);
        }
        let estimate = pipeline.finish();
        let measures: Vec<_> =
            estimate.measures.iter().map(|measure| measure.value.map(f64::to_bits)).collect();
        (estimate.leaf.areas.best_m2().map(f64::to_bits), measures)
    };
    let (first, last) = (Some(EchoChoice::First), Some(EchoChoice::Last));
    for echo in [first, last] {
        let by_rig = measured(echo, &[None]);
        assert!(by_rig.0.is_ok());
        for believed in [None, first, last] {
            assert_eq!(measured(believed, &[echo]), by_rig, "{believed:?}, told {echo:?}");
        }
    }
    assert_ne!(measured(first, &[None]).0, measured(last, &[None]).0, "both echoes measure the same");
    for told in [[first, last], [last, first], [first, None], [None, last]] {
        assert_eq!(measured(first, &told).0, Err(Withheld::EchoUnknown), "{told:?}");
    }
    assert_eq!(measured(first, &[None, first]), measured(first, &[None]));
}

/// The end of a window is told from the mirror on, however the scan plane leans: who sprays by it opens where the leaves are.
#[test]
fn how_far_behind_the_mirror_a_window_ends_is_told_of_leaning_planes_too() {
    for (yaw_deg, pitch_deg, offset_y_m) in [
        (0.0, 0.0, 0.0),
        (0.0, 0.0, 0.7),
        (-30.0, 0.0, 0.0),
        (30.0, 0.0, 0.0),
        (0.0, 15.0, 0.0),
        (-20.0, 8.0, -0.7),
    ] {
        let mount = Mount { yaw_deg, pitch_deg, offset_y_m, ..Mount::default() };
        let rig = Rig { scanners: vec![mount], ..orchard_rig() };
        let mut pipeline = pipeline(&rig, Parameters::default());
        let (mut told, mut nearest_m) = (0, f64::INFINITY);
        for (number, scan) in drive(&rig, lms111(), 50, 400, crowns).iter().enumerate() {
            pipeline.push(scan);
            let window = pipeline.window().ok().and_then(|window| window.leaf.ok());
            let Some(window) = window.filter(|_| number > 200) else { continue };
            // A line counts when the next one has come.
            let mirror_y_m = 0.02 * (number as f64 - 1.0) + offset_y_m;
            let behind_m = mirror_y_m - window.slices()[0].y_m[1];
            assert!(
                (window.behind_m - behind_m).abs() < 1e-6,
                "{yaw_deg} {pitch_deg}: {} {behind_m}",
                window.behind_m
            );
            nearest_m = window.behind_m.min(nearest_m);
            told += 1;
        }
        assert!(told > 100, "{yaw_deg} {pitch_deg}: {told}");
        // It ends no farther ahead than the plane looks, and of a level one soon behind the mirror.
        let ahead_m = 1.9 * f64::tan(yaw_deg.to_radians());
        assert!(nearest_m > -ahead_m - 0.1, "{yaw_deg} {pitch_deg}: {nearest_m}");
        assert!(yaw_deg != 0.0 || pitch_deg != 0.0 || (0.0..0.3).contains(&nearest_m), "{nearest_m}");
    }
}

/// The rule: what the bus tells of the row just passed sums up to what the estimate tells of the whole: of the volume each is the half of the side seen.
#[test]
fn the_volumes_of_windows_sum_to_half_of_the_rows() {
    let rig = orchard_rig();
    for scene in [crowns as fn(f64, f64) -> f64, |y_m, theta| crowns(y_m + 0.7 * theta.sin(), theta)] {
        let all: Vec<_> = rowscan_canopy::estimator::TABLE.iter().collect();
        let mut pipeline = pipeline(&rig, Parameters::default()).with_estimators(&all);
        let (mut sum_m3, mut length_m) = (0.0, 0.0);
        // 25 lines of 20 mm are a window.
        for (number, scan) in (1..).zip(drive(&rig, lms111(), 50, LINES, scene)) {
            pipeline.push(&scan);
            if number % 25 == 0 {
                let window = pipeline.window().unwrap();
                sum_m3 += window.volume_m3;
                length_m += window.length_m;
            }
        }
        let estimate = pipeline.finish();
        let volume = estimate
            .measures
            .iter()
            .find(|measure| measure.quantity == rowscan_canopy::Quantity::Volume)
            .unwrap();
        let row_m3 = volume.value.unwrap() * length_m / estimate.scanned_m.unwrap();
        assert!(row_m3 > 3.0 && (2.0 * sum_m3 / row_m3 - 1.0).abs() < 0.03, "{sum_m3} {row_m3}");
    }
}
