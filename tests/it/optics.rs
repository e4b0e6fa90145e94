//! The device's eye on the wire: the same online and offline, echoes in their channels, and refused where it means nothing.

use crate::common::binary::{assert_says, refused, run};
use crate::common::{facts, small_scene};
use crate::online_offline::{bits, online};

use rowscan_canopy::estimator::TABLE;
use rowscan_canopy::{Measure, Quantity};
use rowscan_emulator::offline::Offline;
use rowscan_emulator::stage::Stage;
use rowscan_protocol::client::ColaConfig;
use rowscan_protocol::device::{DialectPolicy, Session};
use rowscan_protocol::frame::{Dialect, encode};
use rowscan_protocol::model::{self, AnyModel};
use rowscan_protocol::rig::{BeamWidth, EchoChoice, RemissionReading, Rig};
use rowscan_protocol::scan::Scan;
use rowscan_protocol::time::SimTime;
use rowscan_scenes::Scene;
use rowscan_scenes::optics::Stages;
use rowscan_scenes::scan::{ScanKind, ScanSettings};
use rowscan_study::calibrations::load_calibration_for;
use rowscan_study::reading::{CalibrationChoice, Reading, rig_with};
use rowscan_study::row_scan::{self, RowScan};
use rowscan_study::trial::Trial;

fn seen_by(stages: &str) -> Scene {
    let mut scene = small_scene();
    scene.orchard.trees = Some(1);
    scene.optics.stages = stages.parse().expect("stages");
    scene
}

#[tokio::test]
async fn a_devices_eye_sees_the_same_online_and_offline_and_not_what_an_ideal_one_sees() {
    let model = model::by_name("lms111").expect("known");
    let offline = Trial::run(seen_by("device"), model, None).expect("it runs").estimate;
    assert_eq!(bits(&online(seen_by("device"), model, Dialect::B).await), bits(&offline));
    let ideal = Trial::run(seen_by("ideal"), model, None).expect("it runs").estimate;
    let area =
        |estimate: &rowscan_canopy::Estimate| estimate.impacted_total_area_m2.expect("the rig is known");
    // A spot of 38 mm at 2 m touches more than a thin beam does.
    assert!(area(&offline) > 1.1 * area(&ideal), "{} {}", area(&offline), area(&ideal));
}

#[tokio::test]
async fn a_rig_that_reads_remission_asks_the_scanner_for_it_and_counts_shares() {
    let model = model::by_name("lms111").expect("known");
    let reading = |curve: Option<RemissionReading>| {
        let mut scene = seen_by("device");
        scene.rig.scanners[0].remission = curve;
        scene
    };
    let scene = || reading(Some(RemissionReading::Model));
    let offline = Trial::run(scene(), model, None).expect("it runs").estimate;
    assert_eq!(bits(&online(scene(), model, Dialect::B).await), bits(&offline));
    let shares_m2 = offline.leaf.areas.share_raw_m2().expect("remission is read");
    assert!(shares_m2 > 0.0 && offline.warnings.iter().any(|warning| warning.code() == "remission_assumed"));
    let silent = Trial::run(reading(None), model, None).expect("it runs").estimate;
    assert_eq!(silent.leaf.areas.share_raw_m2().ok(), None);
    assert_eq!(
        silent.leaf.areas.contact_raw_m2().ok(),
        offline.leaf.areas.contact_raw_m2().ok(),
        "remission changes no range"
    );
}

#[test]
fn a_rig_with_remission_that_tells_no_power_is_refused() {
    for name in ["tim561", "lms291"] {
        let mut scene = seen_by("device");
        scene.rig.scanners[0].remission = Some(RemissionReading::Model);
        let model = AnyModel::by_name(name).expect("known");
        let refusal = Trial::run(scene, model, None).expect_err("no power").to_string();
        assert!(refusal.contains("expected an LMS, an MRS1000"), "{name}: {refusal}");
    }
}

#[test]
fn thin_and_dense_rows_read_right_by_shares_where_contact_makes_half_of_their_difference() {
    let error = |lai: f64, remission: Option<RemissionReading>| {
        let mut scene = rowscan_scenes::files::load_scene("spindle", |_| {}).expect("built in");
        (scene.seed, scene.orchard.target_lai, scene.optics.stages) = (77, Some(lai), Stages::device());
        scene.rig.scanners[0].remission = remission;
        let calibration =
            load_calibration_for("spindle", "lms111", Some(BeamWidth::Device)).expect("shipped");
        let trial =
            Trial::run(scene, model::by_name("lms111").expect("known"), calibration).expect("it runs");
        trial.estimate.leaf.areas.best_m2().expect("an area") / trial.truth.leaf_area_m2 - 1.0
    };
    let (by_shares, by_contact) = (
        [0.8, 2.0].map(|lai| error(lai, Some(RemissionReading::Model))),
        [0.8, 2.0].map(|lai| error(lai, None)),
    );
    assert!(by_shares.iter().all(|error| error.abs() < 0.12), "{by_shares:?}");
    assert!(by_contact[0] > 0.2 && by_contact[1] < -0.04, "{by_contact:?}");
}

/// Scans of the middle of the row, with every echo that the model sends.
fn scans(model: &str, stages: &str) -> Vec<Scan> {
    let stage = Stage::grow(seen_by(stages), &|_, _| {}).expect("it grows");
    let model = model::by_name(model).expect("known");
    let (device, view) = stage.scanner(0, model).expect("it fits");
    let mut offline = Offline::new(device, view);
    offline
        .set_up(ColaConfig { echoes: model.echoes, echo: None, remission: true, ..ColaConfig::default() })
        .expect("taken");
    let mut scan = Scan::default();
    let all = (0..30).map(|_| {
        offline.scan_into(&mut scan).expect("a scan");
        scan.clone()
    });
    all.skip(20).collect()
}

#[test]
fn echoes_stand_in_their_channels_in_order_with_remission_and_the_lms511_sends_the_last_as_delivered() {
    let mut seconds = 0;
    for scan in scans("lms111", "device") {
        assert_eq!(scan.echoes.len(), 2);
        let [first, second] = &scan.echoes[..] else { panic!("two echoes") };
        for ((near, far), (strong, weak)) in
            first.range_m.iter().zip(&second.range_m).zip(first.remission.iter().zip(&second.remission))
        {
            assert!(near.is_finite() || far.is_infinite(), "a second echo without a first");
            assert_eq!(near.is_finite(), *strong > 0);
            assert_eq!(far.is_finite(), *weak > 0);
            seconds += usize::from(far.is_finite());
        }
        let in_order = first.range_m.iter().zip(&second.range_m).filter(|(near, _)| near.is_finite());
        // Echoes a pulse apart still disturb each other: the nearer is late by its share of what lies behind, less than the gap.
        assert!(in_order.clone().all(|(near, far)| far > near));
    }
    assert!(seconds > 0, "no beam has a second echo");
    assert!(scans("lms511", "device").iter().all(|scan| scan.echoes.len() == 1));
    assert_eq!(scans("lms511", "spot")[0].echoes.len(), 5);
}

/// The first trial of a small row by an LMS511 through its eye, its rig changed.
fn lms511(change: impl Fn(&mut Scene)) -> rowscan_canopy::Estimate {
    let mut scene = seen_by("device");
    change(&mut scene);
    let model = model::by_name("lms511").expect("known");
    Trial::run(scene, model, None).expect("it runs").estimate
}

#[test]
fn an_lms511_is_asked_for_the_first_echo_and_gives_the_last_where_the_rig_says_so() {
    let with = |echo| lms511(|scene| scene.rig.scanners[0].echo = echo);
    let (first, last) = (with(None), with(Some(EchoChoice::Last)));
    let area = |estimate: &rowscan_canopy::Estimate| estimate.impacted_total_area_m2.expect("known");
    assert_eq!(area(&first).to_bits(), area(&with(Some(EchoChoice::First))).to_bits());
    // The last echo lies behind the rims, which the first one is of.
    assert!((area(&first) / area(&last) - 1.0).abs() > 0.02, "{} {}", area(&first), area(&last));
    let code = |estimate: &rowscan_canopy::Estimate| -> Vec<&str> {
        estimate.warnings.iter().map(rowscan_canopy::Warning::code).collect()
    };
    assert!(!code(&first).contains(&"echo_unknown"), "{:?}", first.warnings);
}

#[test]
fn a_recording_that_may_hold_the_last_echo_gives_no_leaf_area_until_somebody_says_which() {
    let stage = Stage::grow(seen_by("device"), &|_, _| {}).expect("it grows");
    let rig = rig_with(&stage.rig, 0, "lms511");
    let read = |rig: &Rig| {
        let read = Reading::of_recording(Some(rig), 0, false, CalibrationChoice::Given(None)).expect("read");
        let mut pipeline = read.pipeline.with_estimators(&TABLE.iter().collect::<Vec<_>>());
        for scan in scans("lms511", "device") {
            pipeline.push(&scan);
        }
        pipeline.finish()
    };
    let unknown = read(&rig);
    assert!(
        unknown.warnings.iter().any(|warning| warning.code() == "echo_unknown"),
        "{:?}",
        unknown.warnings
    );
    assert_eq!((unknown.leaf.areas.best_m2().ok(), unknown.leaf.areas.lai().ok()), (None, None));
    let leaf_area = |m: &&Measure| m.quantity == Quantity::LeafArea && m.value.is_some();
    assert_eq!(unknown.measures.iter().find(leaf_area), None);
    assert!(unknown.impacted_total_area_m2.is_some_and(|area_m2| area_m2 > 0.0));
    let mut told = rig;
    told.scanners[0].echo = Some(EchoChoice::First);
    let known = read(&told);
    assert!(known.leaf.areas.best_m2().ok().is_some() && known.measures.iter().any(|m| leaf_area(&m)));
}

#[test]
fn physics_holds_each_stage_against_the_thin_beam() {
    let found = run(&[
        "study",
        "physics",
        "post",
        "--model",
        "lms111,lms291",
        "--distance",
        "2",
        "--seeds",
        "1..1",
        "--format",
        "jsonl",
    ]);
    assert_eq!(found.code, Some(0), "{}", found.stderr);
    let rows: Vec<serde_json::Value> =
        found.stdout.lines().map(|line| serde_json::from_str(line).expect("json")).collect();
    let change = |model: &str, stages: &str, output: &str| {
        let same = |row: &&serde_json::Value| {
            row["model"] == model && row["stages"] == stages && row["output"] == output
        };
        rows.iter().find(same).expect("a row")["change"].as_f64().expect("a number")
    };
    for model in ["lms111", "lms291"] {
        assert_eq!(change(model, "ideal", "impacted_total"), 0.0);
        // A post is met by beams whose middle passes it within the spot's radius: 17 mm more on either side.
        assert!(change(model, "spot", "impacted_total") > 0.05, "{model}");
        assert!(change(model, "noise", "impacted_total").abs() < 0.02, "{model}");
        assert!(change(model, "device", "width").abs() < 0.6, "{model}");
    }
}

#[test]
fn recorded_scenes_that_stand_still_scatter_as_the_models_do() {
    let Some(facts) = facts("recordings beside the models") else { return };
    // Recorded medians; tolerances of the fact sheet's targets.
    for (name, model, sigma_mm, kurtosis) in [
        ("lms111_startup_first88", "lms111", 8.3, 2.4),
        ("lms511_20210302", "lms511", 3.6, 2.9),
        ("tim781s_20210125", "tim781s", 11.3, 3.0),
    ] {
        let file = facts.join(format!("protocol/recordings/{name}.d2h.bin"));
        let file = file.to_str().expect("text");
        let found = run(&["study", "recording", file, "--model", model, "--format", "json"]);
        assert_eq!(found.code, Some(0), "{}", found.stderr);
        let both: serde_json::Value = serde_json::from_str(&found.stdout).expect("json");
        for whose in ["recorded", "modelled"] {
            let scatter = &both[whose]["scatter"];
            let number = |value: &serde_json::Value| value.as_f64().expect("a number");
            let median_mm = number(&scatter["sigma_mm"][1]);
            assert!((median_mm / sigma_mm - 1.0).abs() < 0.1, "{name} {whose} {median_mm}");
            assert!((number(&scatter["kurtosis"]) - kurtosis).abs() < 0.2, "{name} {whose} {scatter}");
            // Something moved before the LMS511 and the TiM, and the LMS111 had just started.
            let white = if whose == "recorded" { 0.06 } else { 0.03 };
            assert!(number(&scatter["lag_one"]).abs() < white, "{name} {whose} {scatter}");
            assert!(number(&scatter["neighbour"]).abs() < white, "{name} {whose} {scatter}");
            let ten_mm = number(&scatter["allan_mm"][2]);
            assert!((ten_mm / (sigma_mm / 10.0_f64.sqrt()) - 1.0).abs() < 0.15, "{name} {whose} {ten_mm}");
        }
    }
}

#[test]
fn a_scan_through_the_eye_sees_more_and_repeats_and_parallel_beams_have_no_spot() {
    let scan = |optics: &str| {
        let args = ["scan", "--dy", "0.2", "--dtheta", "1", "--format", "json", "--optics", optics]
            .map(str::to_owned);
        let found = run(&args.each_ref().map(String::as_str));
        assert_eq!(found.code, Some(0), "{}", found.stderr);
        found.stdout
    };
    let total = |text: &str| -> f64 {
        let rows: serde_json::Value = serde_json::from_str(text).expect("json");
        rows[0]["I_T"].as_f64().expect("an area")
    };
    let (ideal, device) = (scan("ideal"), scan("device"));
    assert!(total(&device) > total(&ideal));
    assert_eq!(device, scan("device"));
    let told = refused(&["scan", "--type", "zenith-orthogonal", "--optics", "spot"]);
    assert_says(&told, &["--optics ideal"]);
    assert_says(&refused(&["scan", "--optics", "sport"]), &["found `sport`"]);
}

#[test]
fn a_scan_takes_the_echo_that_the_rig_asks_for_and_else_the_one_that_the_model_sends() {
    let impacted = |model: &str, echo| {
        let mut scene = seen_by("device");
        (scene.rig.scanners[0].model, scene.rig.scanners[0].echo) = (model.into(), echo);
        let settings =
            ScanSettings { dy_m: 0.2, dtheta_deg: 1.0, ..row_scan::settings(&scene, ScanKind::Lateral) };
        let stage = Stage::grow(scene, &|_, _| {}).expect("it grows");
        let scanned = RowScan::new(&stage, 0, &settings).expect("it fits").lines(|_| ()).0;
        serde_json::to_value(scanned).expect("json")["I_T"].as_f64().expect("an area")
    };
    let [first, last] = [EchoChoice::First, EchoChoice::Last].map(|echo| impacted("lms511", Some(echo)));
    assert_ne!(first.to_bits(), last.to_bits());
    assert_eq!(impacted("lms511", None).to_bits(), last.to_bits(), "as delivered");
    assert_eq!(
        impacted("lms111", None).to_bits(),
        impacted("lms111", Some(EchoChoice::First)).to_bits(),
        "as delivered"
    );
}

/// First echoes of ten scans of a row in fog, after a client has told the device this: those where fog answers, and all.
fn in_fog(model: &str, visibility_m: f64, told: &[&str]) -> (usize, usize) {
    let mut scene = seen_by("spot,echoes,energy,air");
    scene.optics.air.visibility_m = Some(visibility_m);
    let stage = Stage::grow(scene, &|_, _| {}).expect("it grows");
    let model = model::by_name(model).expect("known");
    let (mut device, view) = stage.scanner(0, model).expect("it fits");
    let mut session = Session::new(DialectPolicy::Auto);
    let mut replies = Vec::new();
    for text in ["sMN SetAccessMode 3 F4724744", "sWN FREchoFilter 0"].iter().chain(told) {
        let mut frame = Vec::new();
        encode(Dialect::A, text.as_bytes(), &mut frame);
        session.handle_bytes(&mut device, SimTime::ZERO, &frame, &mut replies);
    }
    assert!(replies.iter().all(|reply| !reply.bytes.windows(3).any(|word| word == b"sFA")), "{replies:?}");
    let mut offline = Offline::new(device, view);
    let mut scan = Scan::default();
    let (mut fog, mut met) = (0, 0);
    for _ in 0..10 {
        assert!(offline.scan_into(&mut scan).expect("a scan"));
        let ranges = &scan.echoes[0].range_m;
        fog += ranges.iter().filter(|range_m| (0.9..1.5).contains(*range_m)).count();
        met += ranges.iter().filter(|range_m| range_m.is_finite()).count();
    }
    (fog, met)
}

#[test]
fn the_fog_filter_that_a_client_sets_takes_fog_away_and_leaves_the_trees() {
    // By their least power an LMS111 sees thick fog only, and eight times an LMS511's suffices against a thin one.
    for (name, visibility_m) in [("lms111", 60.0), ("lms511", 500.0)] {
        let (fog, met) = in_fog(name, visibility_m, &["sWN MSsuppmode 0"]);
        assert_eq!((fog, met), in_fog(name, visibility_m, &[]), "{name}: glitches only is as delivered");
        let (left, seen) = in_fog(name, visibility_m, &["sWN MSsuppmode 1"]);
        assert!(fog > 1000 && left < fog / 50, "{name}: {fog} echoes of fog, {left} with the filter");
        assert!(seen > 200, "{name}: {seen} of {met} echoes left");
    }
}

#[test]
fn weather_that_no_beam_meets_is_told_unless_a_flag_brings_its_stage() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = |name: &str, stages: &str| {
        let path = folder.path().join(name);
        let text = format!(
            "version = 2\n[orchard]\ntrees = 1\n[optics]\nstages = \"{stages}\"\n[optics.air]\nrain_mm_h = 20.0\n"
        );
        std::fs::write(&path, text).expect("written");
        path.to_string_lossy().into_owned()
    };
    let told = "`[optics.air]` has no effect, for its stage is off";
    let (off, on) = (scene("off.toml", "spot"), scene("on.toml", "device"));
    for (args, expected) in [
        (&["scene", "check", &off][..], true),
        (&["scan", &off, "--type", "lateral"], true),
        (&["scan", &off, "--type", "lateral", "--optics", "spot,energy"], true),
        (&["scan", &off, "--type", "lateral", "--optics", "device"], false),
        (&["scene", "check", &on], false),
    ] {
        let ended = run(args);
        assert_eq!(ended.code, Some(0), "{args:?}: {}", ended.stderr);
        assert_eq!(ended.stderr.matches(told).count(), usize::from(expected), "{args:?}: {}", ended.stderr);
    }
}
