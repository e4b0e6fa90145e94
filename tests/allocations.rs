//! From a scan's bytes to its CAN frames nothing is allocated, scan after scan: what would be cannot be late.
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::unwrap_used,
    clippy::print_stderr,
    reason = "a test fails by panicking and says what it skips"
)]

#[path = "it/common/mod.rs"]
mod common;

use std::time::Duration;

use allocation_counter::measure;
use common::small_scene;
use rowscan_bus::CanFrame;
use rowscan_bus::canopy::CanopyEcu;
use rowscan_bus::link::slcan::Adapter;
use rowscan_canopy::Pipeline;
use rowscan_emulator::offline::Offline;
use rowscan_emulator::stage::Stage;
use rowscan_protocol::client::ColaClient;
use rowscan_protocol::device::scan_event;
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::host::{HostEvent, HostSession};
use rowscan_protocol::model;
use rowscan_protocol::time::{DeviceClock, SimTime};

/// Telegrams of a drive past the whole row, one after the other.
fn telegrams(stage: &Stage, dialect: Dialect) -> Vec<Vec<u8>> {
    let (device, world) = stage.scanner(0, model::by_name("lms111").unwrap()).unwrap();
    let scans = stage.scans_per_row(&device);
    let mut offline = Offline::new(device, world);
    let mut telegram = || {
        let mut frame = Vec::new();
        scan_event(dialect, offline.telegram().expect("it measures"), &mut frame);
        frame
    };
    (0..scans).map(|_| telegram()).collect()
}

#[test]
fn a_scan_costs_no_allocation_from_its_bytes_to_its_can_frames() {
    let mut scene = small_scene();
    scene.orchard.trees = Some(6);
    let stage = Stage::grow(scene, &|_, _| {}).expect("it grows");
    for dialect in [Dialect::A, Dialect::B] {
        let mut client = ColaClient::listen(64 * 1024);
        let mut pipeline = Pipeline::new(Some(&stage.rig), 0, None).unwrap();
        let (mut ecu, mut clock, mut adapter) =
            (CanopyEcu::default(), DeviceClock::default(), Adapter::default());
        let (mut frames, mut wire): (Vec<CanFrame>, _) = (Vec::new(), Vec::new());
        adapter.handle_bytes(b"S5\rO\r", &mut wire, &mut Vec::new());
        ecu.open(SimTime::ZERO, &mut frames);
        let mut sent = 0;
        let allocated: Vec<u64> = telegrams(&stage, dialect)
            .iter()
            .map(|telegram| {
                let scan = || {
                    client.handle_bytes(Duration::ZERO, telegram);
                    assert_eq!(client.poll_event(), Some(HostEvent::Scan));
                    let scan = client.scan();
                    pipeline.push(scan);
                    let at = SimTime((clock.seconds(scan.scan_time_us) * 1e9) as u64);
                    ecu.tell(at, &pipeline, &mut frames);
                    sent += frames.len();
                    wire.clear();
                    for frame in frames.drain(..) {
                        adapter.frame(at, &frame, &mut wire);
                    }
                };
                measure(scan).count_total
            })
            .collect();
        assert!(sent > 100, "{sent} frames");
        // The first second fills buffers and learns; after it memory grows only as the row does, metre by metre and tree by tree.
        let steady = allocated.get(50..).unwrap();
        let at_all = steady.iter().filter(|count| **count > 0).count();
        let metres = steady.len() / 50;
        assert!(at_all <= metres, "{dialect}: {allocated:?}");
    }
}
