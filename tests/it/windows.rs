//! The windows that the canopy sensor tells on the bus, beside the row's own estimate and the truth: scenes, models and optics side by side.

use rowscan_bus::CanFrame;
use rowscan_bus::canopy::CanopyEcu;
use rowscan_bus::frame::J1939Id;
use rowscan_bus::message::Message;
use rowscan_bus::pgn::canopy::{CanopyReport, IMPACTED_BANDS, LEAF_BANDS, LEAF_STATUS, SUMMARY};
use rowscan_canopy::calibration::{ContactScale, FittedRows};
use rowscan_canopy::{Calibration, LeafSlice, RowClass, Withheld};
use rowscan_emulator::stage::Stage;
use rowscan_protocol::model::AnyModel;
use rowscan_protocol::scan::Scan;
use rowscan_protocol::time::{DeviceClock, SimTime};
use rowscan_protocol::validity::{DeviceStatus, ScanFault};
use rowscan_scenes::CellGrid;
use rowscan_scenes::files::load_scene;
use rowscan_scenes::optics::Stages;
use rowscan_study::calibrations::load_named_calibration;
use rowscan_study::reading::{CalibrationChoice, Reading, rig_with};
use rowscan_study::trial::{StartUpRequests, each_scan};

/// One drive past a row.
struct Drive {
    /// Every slice that a window held, once, in the order of travel.
    slices: Vec<LeafSlice>,
    /// The factor of each window told, with how far the stream had come, metres.
    factors: Vec<(f64, f64)>,
    /// The row's own.
    leaf_m2: f64,
    raw_m2: f64,
    scanned_m: f64,
}

impl Drive {
    fn factor(&self) -> f64 {
        self.leaf_m2 / self.raw_m2
    }

    fn past(stage: &Stage, model: AnyModel) -> Self {
        let rig = rig_with(&stage.rig, 0, model.name());
        let reading = Reading::of(Some(&rig), 0, true, CalibrationChoice::OfRig).expect("a reading");
        let asked = StartUpRequests { cola: reading.cola, lms2xx: reading.lms2xx };
        let mut pipeline = reading.pipeline.of_class(RowClass::default());
        let (mut slices, mut factors) = (Vec::<LeafSlice>::new(), Vec::new());
        each_scan(stage, model, asked, &mut |scan| {
            pipeline.push(scan);
            let Ok(window) = pipeline.window().and_then(|window| window.leaf) else { return };
            let progress = pipeline.progress();
            factors.push((progress.advance_m.unwrap_or(0.0), window.factor()));
            // Before the first slice has ended, a window holds what is seen of it so far.
            let whole = window.behind_m > 0.0 || window.slices().len() > 1;
            let last_m = slices.last().map_or(f64::NEG_INFINITY, |last| last.y_m[0]);
            let new = window.slices().iter().rev().filter(|slice| whole && slice.y_m[0] > last_m + 1e-9);
            slices.extend(new.copied());
        })
        .expect("scans");
        let estimate = pipeline.finish();
        let window = pipeline.window().and_then(|window| window.leaf).expect("a window");
        let last_m = slices.last().map_or(f64::NEG_INFINITY, |last| last.y_m[0]);
        slices.extend(window.slices().iter().rev().filter(|slice| slice.y_m[0] > last_m + 1e-9).copied());
        let areas = estimate.leaf.areas;
        let by_shares = areas.share_m2().is_ok();
        let raw_m2 = if by_shares { areas.share_raw_m2() } else { areas.contact_raw_m2() };
        Self {
            slices,
            factors,
            leaf_m2: areas.best_m2().expect("a leaf area"),
            raw_m2: raw_m2.expect("a raw one"),
            scanned_m: estimate.scanned_m.expect("a rig"),
        }
    }
}

fn stage(scene: &str, trees: u32, stages: Stages) -> Stage {
    let mut scene = load_scene(scene, |_| {}).expect("a scene");
    (scene.orchard.trees, scene.optics.stages) = (Some(trees), stages);
    Stage::grow(scene, &|_, _| {}).expect("it grows")
}

#[test]
fn windows_add_up_to_the_row_on_six_scenes_both_optics_and_four_models() {
    let scenes = ["spindle", "tall_spindle", "vase", "hedge", "mature", "fruiting_wall"];
    let models = ["lms111", "lms511", "tim561", "lms291"];
    for (number, scene) in scenes.into_iter().enumerate() {
        for (turn, stages) in [Stages::IDEAL, Stages::device()].into_iter().enumerate() {
            let name = models[(number + turn) % models.len()];
            let drive = Drive::past(&stage(scene, 4, stages), AnyModel::by_name(name).expect("a model"));
            let what = format!("{scene}, {name}, optics {stages}");
            let raw_m2: f64 = drive.slices.iter().map(LeafSlice::raw_m2).sum();
            let scanned_m: f64 = drive.slices.iter().map(|slice| slice.length_m).sum();
            let off = drive.factor() * raw_m2 / drive.leaf_m2 - 1.0;
            assert!(off.abs() < 0.005, "{what}: the windows' sum is off by {off}");
            assert!(
                (scanned_m - drive.scanned_m).abs() < 1e-6,
                "{what}: {scanned_m} m of {}",
                drive.scanned_m
            );
            for (way_m, live) in drive.factors.iter().filter(|(way_m, _)| *way_m > 3.0) {
                let off = live / drive.factor() - 1.0;
                assert!(off.abs() < 0.05, "{what}: at {way_m:.2} m the factor so far is off by {off}");
            }
        }
    }
}

/// A number that is known and does not fit its field is not available, and the status says that this is why.
#[test]
fn a_leaf_area_beyond_its_field_is_said_to_be_so() {
    const BEYOND_FIELD: f64 = 250.0;
    let stage = stage("spindle", 3, Stages::IDEAL);
    let model = AnyModel::by_name("lms111").expect("a model");
    let rig = rig_with(&stage.rig, 0, model.name());
    let own = load_named_calibration("spindle", model.name(), rig.optics).expect("it is shipped");
    // A row as it is, and one with twenty times the leaves.
    for (times, fits) in [(1.0, true), (20.0, false)] {
        let fitted = own
            .contact
            .fitted
            .map(|rows| FittedRows { mean_leaf_area_m2_per_m: times * rows.mean_leaf_area_m2_per_m, ..rows });
        let contact = ContactScale { k: times * own.contact.k, fitted, ..own.contact };
        let calibration = CalibrationChoice::Given(Some(Box::new(Calibration { contact, ..own.clone() })));
        let reading = Reading::of(Some(&rig), 0, true, calibration).expect("a reading");
        let asked = StartUpRequests { cola: reading.cola, lms2xx: reading.lms2xx };
        let mut pipeline = reading.pipeline.of_class(RowClass::default());
        each_scan(&stage, model, asked, &mut |scan| pipeline.push(scan)).expect("scans");
        let report = CanopyReport { window: pipeline.window(), ..CanopyReport::default() };
        let leaf = report.window.and_then(|window| window.leaf).expect("a leaf area");
        assert_eq!(leaf.m2_per_m() < 25.0, fits, "{} m²/m", leaf.m2_per_m());
        let (summary, status) = (report.summary(), report.leaf_status());
        let (summary, status) = (SUMMARY.decode(summary.bytes()), LEAF_STATUS.decode(status.bytes()));
        assert!(summary[0].is_some(), "the impacted area fits: {summary:?}");
        assert_eq!(summary[1].is_some(), fits, "{summary:?}");
        assert_eq!(status[0], Some(if fits { 0.0 } else { BEYOND_FIELD }), "{status:?}");
    }
}

/// The relative standard deviation of windows of about this length about the truth between their faces, the row's own error taken out.
fn against_truth(stage: &Stage, drive: &Drive, length_m: f64) -> f64 {
    let grid = CellGrid { cell_m: 0.05, band_m: 5.0 };
    let cells = stage.orchard.cells_of_row(0, grid).expect("a row");
    let truth_m2 = |[from_m, to_m]: [f64; 2]| -> f64 {
        let count = ((to_m - from_m) / grid.cell_m).round() as u32;
        let columns = (0..count).map(|k| cells.column(from_m + (f64::from(k) + 0.5) * grid.cell_m));
        columns.flat_map(|column| column.bands).map(|band| band.areas.leaf_area_m2).sum()
    };
    let slice_m = drive.slices[1].y_m[1] - drive.slices[1].y_m[0];
    let count = (length_m / slice_m).round().max(1.0) as usize;
    let pairs: Vec<(f64, f64)> = drive
        .slices
        .chunks_exact(count)
        .map(|window| {
            let raw_m2: f64 = window.iter().map(LeafSlice::raw_m2).sum();
            let truth: f64 = window.iter().map(|slice| truth_m2(slice.y_m)).sum();
            (drive.factor() * raw_m2, truth)
        })
        .collect();
    let mean = |of: &dyn Fn(&(f64, f64)) -> f64| pairs.iter().map(of).sum::<f64>() / pairs.len() as f64;
    let (found, real) = (mean(&|pair| pair.0), mean(&|pair| pair.1));
    let scale = found / real;
    let variance = mean(&|(found, truth)| (found / scale - truth).powi(2));
    variance.sqrt() / real
}

#[test]
fn docs_state_how_far_a_window_is_off_the_truth() {
    let page =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/can.md")).expect("the page");
    for (words, stages) in [("rays", Stages::IDEAL), ("device", Stages::device())] {
        let stage = stage("spindle", 40, stages);
        let drive = Drive::past(&stage, AnyModel::by_name("lms111").expect("a model"));
        let [half, one, five] = [0.5, 1.0, 5.0].map(|m| 100.0 * against_truth(&stage, &drive, m));
        assert!(half > one && one > five, "longer windows scatter less: {half} {one} {five}");
        let line = format!("| {words} | {half:.1} % | {one:.1} % | {five:.1} % |");
        assert!(page.contains(&line), "docs/can.md lacks the line {line}");
    }
}

/// What the bus, the page and the file say at the end of a drive, each number there or not.
fn told_everywhere(stage: &Stage, what: &str, mut damage: impl FnMut(u64, &mut Scan) -> bool) {
    let model = AnyModel::by_name("lms111").expect("a model");
    let rig = rig_with(&stage.rig, 0, model.name());
    let reading = Reading::of(Some(&rig), 0, true, CalibrationChoice::OfRig).expect("a reading");
    let asked = StartUpRequests { cola: reading.cola, lms2xx: reading.lms2xx };
    let mut pipeline = reading.pipeline;
    let (mut ecu, mut frames, mut clock, mut number) =
        (CanopyEcu::default(), Vec::new(), DeviceClock::default(), 0);
    ecu.open(SimTime::ZERO, &mut frames);
    each_scan(stage, model, asked, &mut |scan| {
        let mut scan = scan.clone();
        number += 1;
        if damage(number, &mut scan) {
            pipeline.push(&scan);
        } else {
            pipeline.push_unreadable(&ScanFault::AngularStep);
        }
        let at = SimTime((clock.seconds(scan.scan_time_us) * 1e9) as u64);
        ecu.tell(at, &pipeline, &mut frames);
    })
    .expect("scans");
    let estimate = pipeline.finish();
    let file = serde_json::to_value(&estimate).expect("JSON");
    let last = |message: &Message| {
        let of = |frame: &&CanFrame| J1939Id::of(frame.id).is_some_and(|id| id.pgn == message.pgn);
        message.decode(frames.iter().rev().find(of).expect("a frame").data())
    };
    let (summary, status) = (last(&SUMMARY), last(&LEAF_STATUS));
    for (key, place) in [("impacted_total_area_m2", 0), ("leaf_area_m2", 1), ("lai", 3)] {
        let (in_file, on_bus) = (!file[key].is_null(), summary[place].is_some());
        assert_eq!(
            in_file, on_bus,
            "{what}: {key} is {} in the file, {:?} on the bus",
            file[key], summary[place]
        );
    }
    let bands = [last(&LEAF_BANDS), last(&IMPACTED_BANDS)];
    assert!(
        bands[0].iter().all(|band| band.is_some() != file["leaf_area_m2"].is_null()),
        "{what}: {bands:?}"
    );
    assert!(
        bands[1].iter().all(|band| band.is_some() != file["impacted_total_area_m2"].is_null()),
        "{what}: {bands:?}"
    );
    // The reason is one, in the file as on the bus.
    let reason = estimate.leaf.areas.best_m2().err();
    assert_eq!(status[0], Some(reason.map_or(0.0, |why| f64::from(why.number()))), "{what}");
    assert_eq!(file["leaf_area_withheld"].as_str(), reason.map(Withheld::code), "{what}");
    assert_eq!(status[1..3].iter().all(Option::is_some), reason.is_none(), "{what}: {status:?}");
    // Where the row has none, no part of it has one.
    let parts = file["trees"].as_array().into_iter().chain(file["slices"].as_array()).flatten();
    for part in parts.filter(|_| reason.is_some_and(|why| why != Withheld::Refused)) {
        let keys = ["leaf_area_m2", "leaf_area_contact_m2", "leaf_area_regression_m2", "lai"];
        assert!(keys.iter().all(|key| part[key].is_null()), "{what}: {part}");
    }
    for key in file.as_object().expect("an object").keys().filter(|key| key.starts_with("leaf_area_")) {
        let number = file[key].is_number() && key != "leaf_area_spot_relative_sd";
        assert!(
            reason.is_none_or(|why| why == Withheld::Refused) || !number,
            "{what}: {key} = {}",
            file[key]
        );
    }
}

#[test]
fn what_is_null_in_the_file_is_not_available_on_the_bus_and_the_other_way_round() {
    for scene in rowscan_scenes::builtin::names() {
        let mut scene_of = load_scene(scene, |_| {}).expect("built in");
        scene_of.orchard.trees = scene_of.orchard.trees.map(|trees| trees.min(3)).or(Some(3));
        let stage = Stage::grow(scene_of, &|_, _| {}).expect("it grows");
        told_everywhere(&stage, scene, |_, _| true);
    }
    let spindle = stage("spindle", 4, Stages::IDEAL);
    told_everywhere(&spindle, "a dirty window", |number, scan| {
        if number > 60 && number % 9 == 0 {
            scan.status = DeviceStatus::ContaminationError;
        }
        true
    });
    told_everywhere(&spindle, "holes", |number, _| !(40..60).contains(&number));
    told_everywhere(&spindle, "telegrams that give no scan", |_, _| false);
    told_everywhere(&spindle, "a bare field", |_, scan| {
        scan.echoes.iter_mut().for_each(|echo| echo.range_m.fill(f64::INFINITY));
        true
    });
}
