//! The device's eye on the wire: the same online and offline, echoes in their channels, and refused where it means nothing.
#![allow(clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use crate::common::binary::{assert_says, refused, run};
use crate::common::small_scene;
use crate::online_offline::{bits, online};

use rowscan_emulator::offline::Offline;
use rowscan_emulator::stage::Stage;
use rowscan_protocol::client::ColaConfig;
use rowscan_protocol::device::{DialectPolicy, Session};
use rowscan_protocol::frame::{Dialect, encode};
use rowscan_protocol::model;
use rowscan_protocol::scan::Scan;
use rowscan_protocol::time::SimTime;
use rowscan_scenes::Scene;
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

/// Scans of the middle of the row, with every echo that the model sends.
fn scans(model: &str, stages: &str) -> Vec<Scan> {
    let stage = Stage::grow(seen_by(stages), &|_, _| {}).expect("it grows");
    let model = model::by_name(model).expect("known");
    let (device, view) = stage.scanner(0, model).expect("it fits");
    let mut offline = Offline::new(device, view);
    offline
        .set_up(ColaConfig { echoes: model.echoes, remission: true, ..ColaConfig::default() })
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
        // Echoes are more than a pulse apart, noise is less.
        assert!(in_order.clone().all(|(near, far)| far - near > 0.9));
    }
    assert!(seconds > 0, "no beam has a second echo");
    assert!(scans("lms511", "device").iter().all(|scan| scan.echoes.len() == 1));
    assert_eq!(scans("lms511", "spot")[0].echoes.len(), 5);
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
