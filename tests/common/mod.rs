//! What the end-to-end tests share: a small scene, a client on an in-memory stream, the facts folder.
#![allow(dead_code, unreachable_pub, reason = "each test binary uses its own part")]

pub mod binary;
pub mod replayed;

use std::path::PathBuf;

use rowscan::config::load_scene;
use rowscan::emulator::{Emulator, World};
use rowscan::stage::Stage;
use rowscan_driver::{Connection, Happened};
use rowscan_protocol::client::{Client, ClientConfig, Event};
use rowscan_protocol::device::Device;
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::model;
use rowscan_protocol::scan::Scan;
use rowscan_scenes::Scene;
use tokio::io::DuplexStream;

/// A row of three small trees: quick to grow in a test.
pub fn small_scene() -> Scene {
    let mut scene = load_scene("spindle").expect("built in");
    scene.orchard.trees = Some(3);
    scene.orchard.tree.iterations = Some(7);
    scene
}

/// A scanner of `model` in front of the small scene.
pub fn bench(model: &str) -> (Device, World) {
    let stage = Stage::grow(small_scene(), &|_, _| {}).expect("it grows");
    stage.scanner(0, model::by_name(model).expect("known")).expect("it fits")
}

/// A client session on an in-memory stream to an emulator.
pub struct RawClient {
    pub connection: Connection<DuplexStream>,
}

/// Attaches a client that sets the scanner up and streams.
pub fn raw_client(emulator: &mut Emulator, dialect: Dialect) -> RawClient {
    let (here, there) = tokio::io::duplex(16 * 1024);
    emulator.attach(there);
    RawClient { connection: Connection::new(here, Client::new(ClientConfig::default(), dialect)) }
}

impl RawClient {
    pub async fn next_event(&mut self) -> Event {
        match self.connection.next_event(None).await.expect("the link holds") {
            Happened::Event(event) => event,
            other => panic!("the link ended: {other:?}"),
        }
    }

    pub async fn next_scan(&mut self) -> Scan {
        loop {
            match self.next_event().await {
                Event::Scan => return self.connection.client().scan().clone(),
                Event::Ready(_) => {}
                other => panic!("no scan but {other:?}"),
            }
        }
    }
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
