//! What the end-to-end tests share: a small scene, a client on an in-memory stream, the facts folder.
#![allow(dead_code, unreachable_pub, reason = "each test binary uses its own part")]

pub mod binary;
pub mod captured;
pub mod points;
pub mod recorded;
pub mod replayed;
pub mod studies;
pub mod talk;

use std::path::PathBuf;

use rowscan_driver::{Connection, ConnectionEvent};
use rowscan_emulator::stage::Stage;
use rowscan_emulator::{Emulator, ScannerView};
use rowscan_protocol::angle::BeamGrid;
use rowscan_protocol::client::{ColaClient, ColaConfig};
use rowscan_protocol::device::Device;
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::host::{HostEvent, HostSession};
use rowscan_protocol::model;
use rowscan_protocol::rig::Rig;
use rowscan_protocol::scan::{Echo, Scan};
use rowscan_scenes::Scene;
use rowscan_scenes::files::load_scene;
use tokio::io::DuplexStream;

/// A row of three small trees: quick to grow in a test.
pub fn small_scene() -> Scene {
    let mut scene = load_scene("spindle", |_| {}).expect("built in");
    scene.orchard.trees = Some(3);
    scene.orchard.tree.iterations = Some(7);
    scene
}

/// A scanner of `model` in front of the small scene.
pub fn bench(model: &str) -> (Device, ScannerView) {
    let stage = Stage::grow(small_scene(), &|_, _| {}).expect("it grows");
    stage.scanner(0, model::by_name(model).expect("known")).expect("it fits")
}

/// A client session on an in-memory stream to an emulator.
pub struct RawClient {
    pub connection: Connection<DuplexStream, ColaClient>,
}

/// Attaches a client that sets the scanner up and streams.
pub fn raw_client(emulator: &mut Emulator, dialect: Dialect) -> RawClient {
    let (here, there) = tokio::io::duplex(16 * 1024);
    emulator.attach(there);
    RawClient { connection: Connection::new(here, ColaClient::new(ColaConfig::default(), dialect)) }
}

impl RawClient {
    pub async fn next_event(&mut self) -> HostEvent {
        match self.connection.next_event(None).await.expect("the link holds") {
            ConnectionEvent::Session(event) => event,
            other => panic!("the link ended: {other:?}"),
        }
    }

    pub async fn next_scan(&mut self) -> Scan {
        loop {
            match self.next_event().await {
                HostEvent::Scan => return self.connection.session().scan().clone(),
                HostEvent::Ready(_) => {}
                other => panic!("no scan but {other:?}"),
            }
        }
    }
}

/// A wall at the row axis, 0.2 to 2 m high, as a scanner of `rig` sees it: range = distance / cos θ.
pub fn wall(rig: &Rig) -> Scan {
    let mount = &rig.scanners[0];
    let beams = BeamGrid::spanning(-450_000, 2_250_000, 5000);
    let range_m = (0..beams.len()).map(|beam| {
        let theta = (beams.angle_deg(beam) - 90.0).to_radians();
        let range_m = mount.distance_m / theta.cos();
        let z_m = mount.height_m + range_m * theta.sin();
        if theta.cos() > 0.0 && (0.2..2.0).contains(&z_m) { range_m } else { f64::INFINITY }
    });
    let echo = Echo { range_m: range_m.collect(), remission: Vec::new() };
    Scan { scan_frequency_hz: 50.0, beams, echoes: vec![echo], ..Scan::default() }
}

/// The folder of written facts and real recordings, if this machine has it; says so if not.
pub fn facts(what: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("ROWSCAN_FACTS")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared"), PathBuf::from);
    if folder.is_dir() {
        Some(folder)
    } else {
        eprintln!("SKIPPED: {what}: recordings not found at {}", folder.display());
        None
    }
}
