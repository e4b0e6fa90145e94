//! What goes through a socket and what is made in memory are the same scans: the areas agree to the last bit.

use crate::common;

use std::time::Duration;

use common::small_scene;
use rowscan_canopy::{Estimate, Pipeline};
use rowscan_driver::{DriverConfig, Scanner, Source};
use rowscan_emulator::clock::TimeScale;
use rowscan_emulator::stage::Stage;
use rowscan_emulator::{Emulator, EmulatorConfig, SerialConfig, SerialEmulator};
use rowscan_ports::NetLine;
use rowscan_protocol::device::DialectPolicy;
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::lms2xx;
use rowscan_protocol::model::{self, Model};
use rowscan_scenes::Scene;
use rowscan_study::reading::{CalibrationChoice, Reading, rig_with};
use rowscan_study::trial::Trial;
use rowscan_vehicle::trajectory::StopAndGo;

pub(crate) async fn online(scene: Scene, model: &'static Model, dialect: Dialect) -> Estimate {
    let stage = Stage::grow(scene, &|_, _| {}).expect("it grows");
    let (device, world) = stage.scanner(0, model).expect("it fits");
    let rig = rig_with(&stage.rig, 0, model.name);
    let Reading { cola, mut pipeline, .. } =
        Reading::of(Some(&rig), 0, true, CalibrationChoice::Given(None)).expect("sound rig");
    let scans = stage.scans_per_row(&device);
    let config = EmulatorConfig {
        time_scale: TimeScale::Max,
        dialects: DialectPolicy::Strict(dialect),
        ..EmulatorConfig::default()
    };
    let mut emulator = Emulator::start(device, world, config);
    let address = emulator.listen("127.0.0.1:0").await.expect("a free port").address.to_string();
    let config = DriverConfig { cola, prefer: dialect, ..DriverConfig::default() };
    let mut scanner = Scanner::open(&Source::Tcp { address }, config).await.expect("it answers");
    while pipeline.progress().scans < scans {
        pipeline.push(scanner.next().await.expect("the link holds").expect("a scan").scan);
    }
    assert_eq!(scanner.counts().telegrams_bad, 0);
    pipeline.finish()
}

/// Row and trees, to the last bit.
pub(crate) fn bits(estimate: &Estimate) -> (Vec<Option<u64>>, Vec<u64>) {
    let row = [
        estimate.impacted_total_area_m2,
        estimate.leaf.areas.contact_raw_m2().ok(),
        estimate.leaf.areas.share_raw_m2().ok(),
        estimate.advance_m,
        estimate.ranges.mean_m,
    ];
    let trees = estimate.trees.iter().map(|tree| tree.impacted_total_area_m2.to_bits());
    (row.iter().map(|value| value.map(f64::to_bits)).collect(), trees.collect())
}

/// Going a second and standing three, the advance is known by the encoder alone.
fn stop_and_go() -> Scene {
    let mut scene = small_scene();
    scene.drive.stop_and_go = Some(StopAndGo { go_s: 1.0, stop_s: 3.0, ramp_s: 0.5 });
    scene
}

/// `demo`, `estimate` and the studies derive driver settings, pipeline and number of scans from the rig in one place.
#[tokio::test]
async fn a_row_driven_by_stop_and_go_is_estimated_as_one_driven_evenly_online_and_offline() {
    let model = model::by_name("lms111").expect("known");
    let evenly = Trial::run(small_scene(), model, None).expect("it runs").estimate;
    let offline = Trial::run(stop_and_go(), model, None).expect("it runs").estimate;
    let online = online(stop_and_go(), model, Dialect::B).await;
    assert_eq!(bits(&online), bits(&offline));
    let area = |estimate: &Estimate| estimate.leaf.areas.contact_raw_m2().expect("the rig is known");
    let off = area(&offline) / area(&evenly) - 1.0;
    assert!(off.abs() < 0.03, "standing adds no leaf area: {:+.1} %", 100.0 * off);
    assert!(offline.scans > 2 * evenly.scans, "{} scans, {} when driven evenly", offline.scans, evenly.scans);
}

#[tokio::test]
async fn areas_agree_to_the_last_bit_for_each_model_and_dialect() {
    for model in model::MODELS.iter().copied() {
        let offline = Trial::run(small_scene(), model, None).expect("it runs").estimate;
        let area = offline.impacted_total_area_m2.expect("the rig is known");
        assert!(area > 0.5, "{}: the row was seen, I_T = {area}", model.name);
        for dialect in [Dialect::A, Dialect::B] {
            let online = online(small_scene(), model, dialect).await;
            assert_eq!(online.scans, offline.scans, "{} {dialect}", model.name);
            assert_eq!((online.scans_lost, online.scans_repeated), (Some(0), 0), "{} {dialect}", model.name);
            assert_eq!(bits(&online), bits(&offline), "{} {dialect}", model.name);
        }
    }
}

async fn online_on_a_line(model: &'static lms2xx::model::Model) -> Estimate {
    let stage = Stage::grow(small_scene(), &|_, _| {}).expect("it grows");
    let options = lms2xx::device::Options { pause_slack: Duration::from_secs(3600), ..Default::default() };
    let (device, world) = stage.serial_scanner(0, model, options).expect("it fits");
    let rig = rig_with(&stage.rig, 0, model.name);
    let Reading { lms2xx: config, mut pipeline, .. } =
        Reading::of(Some(&rig), 0, true, CalibrationChoice::Given(None)).expect("sound rig");
    let hertz = f64::from(lms2xx::model::TURNS_PER_SECOND) / f64::from(model.turns(device.variant()));
    let scans = stage.scans_to_row_end(hertz);
    let line = NetLine::rfc2217("127.0.0.1:0").await.expect("a free port");
    let source = Source::Rfc2217 { address: line.address().to_string(), rate: lms2xx::Rate::R500000 };
    let serial = SerialConfig::at(TimeScale::Max);
    let _emulator = SerialEmulator::start(device, world, Box::new(line), serial);
    let config = DriverConfig { lms2xx: config, ..DriverConfig::default() };
    let mut scanner = Scanner::open(&source, config).await.expect("it answers");
    while pipeline.progress().scans < scans {
        pipeline.push(scanner.next().await.expect("the link holds").expect("a scan").scan);
    }
    pipeline.finish()
}

/// The two begin at different mirror turns, so times differ by a nanosecond here and there.
#[tokio::test]
async fn an_lms2xx_on_its_line_and_in_memory_see_the_same_row() {
    for model in
        lms2xx::model::MODELS.iter().copied().filter(|model| ["lms200", "lms291"].contains(&model.name))
    {
        let offline = Trial::run(small_scene(), model, None).expect("it runs").estimate;
        let online = online_on_a_line(model).await;
        assert_eq!((online.scans, online.scans_lost), (offline.scans, Some(0)), "{}", model.name);
        let area = |estimate: &Estimate| estimate.impacted_total_area_m2.expect("the rig is known");
        assert!(area(&offline) > 0.5, "{}: the row was seen", model.name);
        let off = area(&online) / area(&offline) - 1.0;
        assert!(off.abs() < 1e-3, "{}: {off:+e}", model.name);
    }
}

/// A host that is late for a moment loses nothing: the line catches up. One that is late for longer leaves turns out, and counts them: their time passes, and no telegram of
/// them is lost.
#[tokio::test]
async fn scans_that_the_host_has_no_time_for_are_those_that_an_lms2xxs_client_misses() {
    let stage = Stage::grow(small_scene(), &|_, _| {}).expect("it grows");
    let options = lms2xx::device::Options { pause_slack: Duration::from_secs(3600), ..Default::default() };
    let lms291 = lms2xx::model::MODELS.iter().find(|model| model.name == "lms291").expect("known");
    let (device, world) = stage.serial_scanner(0, lms291, options).expect("it fits");
    let line = NetLine::rfc2217("127.0.0.1:0").await.expect("a free port");
    let source = Source::Rfc2217 { address: line.address().to_string(), rate: lms2xx::Rate::R500000 };
    let config = SerialConfig::at(TimeScale::Paced(1.0));
    let emulator = SerialEmulator::start(device, world, Box::new(line), config);
    let mut scanner = Scanner::open(&source, DriverConfig::default()).await.expect("it answers");
    let mut pipeline = Pipeline::new(Some(&stage.rig), 0, None).expect("a sound rig");
    for scan in 0..40 {
        pipeline.push(scanner.next().await.expect("the link holds").expect("a scan").scan);
        // All tasks are on this thread.
        match scan {
            10 => std::thread::sleep(Duration::from_millis(100)),
            20 => std::thread::sleep(Duration::from_millis(700)),
            _ => {}
        }
    }
    let missed = emulator.counts().scans_missed;
    assert!(missed > 0, "700 ms are more than it catches up with");
    let estimate = pipeline.finish();
    assert_eq!((estimate.scans_lost, estimate.turns_left_out), (Some(0), missed));
}
