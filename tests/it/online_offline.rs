//! What goes through a socket and what is made in memory are the same scans: the areas agree to the last bit.
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::print_stderr,
    reason = "a test fails by panicking and says what it skips"
)]

use crate::common;

use common::small_scene;
use rowscan_canopy::{Estimate, Pipeline};
use rowscan_driver::{DriverConfig, Scanner, Source};
use rowscan_emulator::clock::TimeScale;
use rowscan_emulator::stage::Stage;
use rowscan_emulator::{Emulator, EmulatorConfig};
use rowscan_protocol::device::DialectPolicy;
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::model::{self, Model};
use rowscan_study::trial::{Trial, rig_of};

async fn online(model: &'static Model, dialect: Dialect) -> Estimate {
    let stage = Stage::grow(small_scene(), &|_, _| {}).expect("it grows");
    let (device, world) = stage.scanner(0, model).expect("it fits");
    let mut pipeline = Pipeline::new(Some(&rig_of(&stage, device.model().name)), 0, None).expect("sound rig");
    let scans = stage.scans_per_row(&device);
    let config = EmulatorConfig {
        time_scale: TimeScale::Max,
        dialects: DialectPolicy::Strict(dialect),
        ..EmulatorConfig::default()
    };
    let mut emulator = Emulator::start(device, world, config);
    let address = emulator.listen("127.0.0.1:0").await.expect("a free port").address.to_string();
    let config = DriverConfig { prefer: dialect, ..DriverConfig::default() };
    let mut scanner = Scanner::open(&Source::Tcp { address }, config).await.expect("it answers");
    while pipeline.progress().scans < scans {
        pipeline.push(scanner.next().await.expect("the link holds").expect("a scan").scan);
    }
    assert_eq!(scanner.counts().telegrams_bad, 0);
    pipeline.finish()
}

#[tokio::test]
async fn areas_agree_to_the_last_bit_for_each_model_and_dialect() {
    for model in model::MODELS.iter().copied() {
        let offline = Trial::run(small_scene(), model, None).expect("it runs").estimate;
        let area = offline.impacted_total_area_m2.expect("the rig is known");
        assert!(area > 0.5, "{}: the row was seen, I_T = {area}", model.name);
        for dialect in [Dialect::A, Dialect::B] {
            let online = online(model, dialect).await;
            assert_eq!(online.scans, offline.scans, "{} {dialect}", model.name);
            assert_eq!((online.scans_lost, online.scans_repeated), (0, 0), "{} {dialect}", model.name);
            let bits = |estimate: &Estimate| {
                let row = [
                    estimate.impacted_total_area_m2,
                    estimate.leaf_area_contact_raw_m2,
                    estimate.advance_m,
                    estimate.ranges.mean_m,
                ];
                let trees = estimate.trees.iter().map(|tree| tree.impacted_total_area_m2.to_bits());
                (row.map(|value| value.map(f64::to_bits)), trees.collect::<Vec<_>>())
            };
            assert_eq!(bits(&online), bits(&offline), "{} {dialect}", model.name);
        }
    }
}
