//! Rows on a slope: whichever row is passed, from whichever side, an estimate and its truth are those of the same trees on level ground.

use rowscan_canopy::Estimate;
use rowscan_emulator::offline::Offline;
use rowscan_emulator::stage::Stage;
use rowscan_protocol::model;
use rowscan_protocol::rig::Axes;
use rowscan_protocol::scan::Scan;
use rowscan_scenes::files::scene_from_text;
use rowscan_scenes::{BeamFan, Truth, TruthGrid};
use rowscan_study::reading::{CalibrationChoice, Reading};

/// Three rows of small trees on this slope, and scanners that look to these sides of this alley.
fn scene(slope_deg: f64, alley: i32, sides: [&str; 2]) -> String {
    let scanners =
        sides.map(|side| format!("[[rig.scanner]]\nmodel = \"lms111\"\nrow = \"{side}\"\n")).concat();
    format!(
        "version = 2\n[orchard]\nrows = 3\ntrees = 3\n[orchard.ground]\nslope_deg = {slope_deg}\n[orchard.tree]\niterations = 7\n[drive]\nalley = {alley}\n{scanners}"
    )
}

/// What is estimated of a pass by the rig's scanner of this number, and the truth of the row that it sees.
fn pass(stage: &Stage, number: usize) -> (Estimate, Truth) {
    let (device, view) = stage.scanner(number, model::by_name("lms111").expect("known")).expect("it fits");
    let scans = stage.scans_per_row(&device);
    let reading =
        Reading::of(Some(&stage.rig), number, false, CalibrationChoice::Given(None)).expect("sound");
    let (mut offline, mut pipeline, mut scan) =
        (Offline::new(device, view), reading.pipeline, Scan::default());
    offline.set_up(reading.cola).expect("taken");
    for _ in 0..scans {
        if offline.scan_into(&mut scan).expect("readable") {
            pipeline.push(&scan);
        }
    }
    (pipeline.finish(), stage.truth(number))
}

fn grown(text: &str) -> Stage {
    Stage::grow(scene_from_text(text, |_| {}).expect("a scene"), &|_, _| {}).expect("it grows")
}

#[test]
fn a_row_on_a_slope_is_measured_as_the_same_row_on_level_ground() {
    for (alley, sides) in [(0, ["right", "right"]), (1, ["right", "left"]), (2, ["left", "right"])] {
        let level = grown(&scene(0.0, alley, sides));
        for slope_deg in [-5.0, 4.0] {
            let slope = grown(&scene(slope_deg, alley, sides));
            for number in [0, 1] {
                let case = format!("{slope_deg}°, alley {alley}, {}", sides[number]);
                let ((flat, on_level), (found, on_slope)) = (pass(&level, number), pass(&slope, number));
                let leaves = |estimate: &Estimate| estimate.leaf.areas.best_m2();
                let (flat, found) = (leaves(&flat), leaves(&found));
                let (Ok(flat), Ok(found)) = (flat, found) else { panic!("{case}: {flat:?} {found:?}") };
                assert!((found / flat - 1.0).abs() < 0.06, "{case}: {found} for {flat}");
                for (a, b) in on_slope.trees.iter().zip(&on_level.trees) {
                    assert!((a.height_m - b.height_m).abs() < 1e-9, "{case}: {} {}", a.height_m, b.height_m);
                }
                assert_eq!(on_slope.row, on_level.row, "{case}");
                assert_eq!(bands(&slope, number), bands(&level, number), "{case}");
            }
        }
    }
}

/// Leaf area by half a metre of height, to the square centimetre.
fn bands(stage: &Stage, number: usize) -> Vec<(f64, f64)> {
    let grid = TruthGrid { band_m: 0.5, ..TruthGrid::default() };
    let truth = stage.orchard.truth_of_row(stage.row_seen(number).row, grid);
    truth.bands.iter().map(|band| (band.z_from_m, (band.leaf_area_m2 * 1e4).round() / 1e4)).collect()
}

#[test]
fn the_tractor_is_as_high_as_the_row_on_its_left_where_a_scanner_looks_left() {
    let slope = grown(&scene(4.0, 2, ["right", "left"]));
    let rise_m = slope.orchard.foot_m(1) - slope.orchard.foot_m(0);
    let spacing_m = slope.orchard.row_spacing_m().expect("rows");
    assert!((rise_m - spacing_m * 4f64.to_radians().tan()).abs() < 1e-12);
    let model = model::by_name("lms111").expect("known");
    for number in [0, 1] {
        let (device, mut view) = slope.scanner(number, model).expect("it fits");
        view.look(device.mirror(), rowscan_protocol::time::SimTime::ZERO);
        let (_, sight) = view.sight().expect("level");
        let height_m = slope.rig.scanners[number].height_m;
        // Row 1 is on its left.
        assert!((sight.origin.z_m - height_m - rise_m).abs() < 1e-12, "{number}: {}", sight.origin.z_m);
    }
}

/// A scan by hand (the truth of gaps and impacted areas is one) stands where the device stands, and looks where it looks.
#[test]
fn a_mount_s_pose_and_fan_are_those_of_its_view() {
    let model = model::by_name("lms111").expect("known");
    for (alley, sides) in [(0, ["right", "right"]), (1, ["right", "left"]), (2, ["left", "left"])] {
        for turned in ["", "roll_deg = 7\n", "yaw_deg = 20\npitch_deg = -10\nroll_deg = 4\n"] {
            let stage = grown(&(scene(-6.0, alley, sides) + turned));
            for number in [0, 1] {
                let case = format!("alley {alley}, {} {turned:?}", sides[number]);
                let (device, mut view) = stage.scanner(number, model).expect("it fits");
                let mirror = device.mirror();
                view.look(mirror, rowscan_protocol::time::SimTime::ZERO);
                let (grid, sight) = view.sight().expect("level");
                let mount = &stage.rig.scanners[number];
                let fan = BeamFan::of_mount(mount, grid, stage.row_seen(number).towards_x);
                let pose = stage.pose(number, mount, stage.rig.y_m(0.0));
                let here = [
                    (pose.x_m, sight.origin.x_m),
                    (pose.y_m, sight.origin.y_m),
                    (pose.z_m, sight.origin.z_m),
                    (fan.theta_rad(0), sight.first_rad),
                    (fan.step_rad(), sight.step_rad),
                ];
                let axes = *fan.axes().unwrap_or(&Axes::LEVEL);
                let of = |axes: Axes| [axes.to_row, axes.ahead, axes.up].concat();
                let planes = of(axes).into_iter().zip(of(sight.axes));
                for (by_hand, seen) in here.into_iter().chain(planes) {
                    assert!((by_hand - seen).abs() < 1e-12, "{case}: {here:?} {axes:?} {sight:?}");
                }
            }
        }
    }
}
