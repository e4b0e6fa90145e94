//! The server, and what it tells its clients of each scan.

use std::net::SocketAddr;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::{Metre, Onlooker, Seen, Show};
use foxglove::websocket::Capability;
use foxglove::{Context, WebSocketServer, WebSocketServerHandle};

use super::frames;
use super::topics::{self, ScannerTopics, SharedTopics};

/// Messages a client that may wait; of those that are more the oldest are lost. Two seconds of one scanner at 50 Hz.
const BACKLOG: usize = 256;
/// From one message of the tractor to the next at least: 10 a second.
const TRACTOR_EVERY_NS: u64 = 100_000_000;

/// Why there is no server.
#[derive(Debug, thiserror::Error)]
pub enum FoxgloveError {
    /// Anybody who can reach it may read, so only this machine may.
    #[error(
        "expected a loopback address for Foxglove, found {0}: its protocol knows no token; listen on 127.0.0.1, and reach it through a tunnel"
    )]
    NotLoopback(SocketAddr),
    /// The address is not to be had, or the server is not to be set up.
    #[error("cannot serve Foxglove at {address}: {cause}")]
    Server {
        /// Where it was to be.
        address: SocketAddr,
        /// What Foxglove's library says.
        cause: foxglove::FoxgloveError,
    },
}

/// A server of Foxglove's WebSocket protocol. Dropped, it closes its connections.
#[derive(Debug)]
pub struct FoxgloveServer {
    serving: Serving,
    address: SocketAddr,
}

/// The server while there is one: whoever tells it something outlives it.
#[derive(Clone, Debug)]
struct Serving(Arc<Mutex<Option<WebSocketServerHandle>>>);

impl Serving {
    fn lock(&self) -> MutexGuard<'_, Option<WebSocketServerHandle>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl FoxgloveServer {
    /// Tells clients at `address` (port 0 takes a free one; loopback only) what `show` shows from now on.
    ///
    /// # Errors
    /// The address is not to be had, or not on loopback.
    pub async fn open(address: SocketAddr, show: &Show) -> Result<Self, FoxgloveError> {
        if !address.ip().is_loopback() {
            return Err(FoxgloveError::NotLoopback(address));
        }
        let failed = |cause| FoxgloveError::Server { address, cause };
        let context = Context::new();
        let names = show.about().scanners.iter().map(|scanner| scanner.name.as_str());
        let scanners: Result<Vec<_>, _> = names.map(|name| ScannerTopics::of(&context, name)).collect();
        let scanners = scanners.map_err(failed)?;
        let shared = SharedTopics::of(&context).map_err(failed)?;
        let server = WebSocketServer::new()
            .name(show.about().title.clone())
            .bind(address.ip().to_string(), address.port())
            .context(&context)
            .capabilities([Capability::Time])
            .message_backlog_size(BACKLOG);
        let handle = server.start().await.map_err(failed)?;
        let address = SocketAddr::new(address.ip(), handle.port());
        let serving = Serving(Arc::new(Mutex::new(Some(handle))));
        let (told_ns, server) = (AtomicU64::new(0), serving.clone());
        show.add(Telling {
            scanners,
            shared,
            serving: server,
            scan_ns: AtomicU64::new(0),
            told_ns,
            _context: context,
        });
        Ok(Self { serving, address })
    }

    /// Serves no longer: when this returns, its clients have been told and its address is free.
    pub async fn close(self) {
        let handle = self.serving.lock().take();
        if let Some(handle) = handle {
            handle.stop().wait().await;
        }
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }
}

impl Drop for FoxgloveServer {
    fn drop(&mut self) {
        if let Some(handle) = self.serving.lock().take() {
            // Nobody waits for the clients to be told.
            let _ = handle.stop();
        }
    }
}

/// Tells of each scan.
#[derive(Debug)]
struct Telling {
    scanners: Vec<ScannerTopics>,
    shared: SharedTopics,
    serving: Serving,
    /// When the last scan came.
    scan_ns: AtomicU64,
    /// When the tractor was told of last.
    told_ns: AtomicU64,
    _context: Arc<Context>,
}

impl Telling {
    fn tractor(&self, at_ns: u64, seen: &Seen<'_>) {
        // A replay may have gone back; then it is told of at once.
        let told_ns = self.told_ns.load(Ordering::Relaxed);
        if told_ns > 0 && (told_ns..told_ns + TRACTOR_EVERY_NS).contains(&at_ns) {
            return;
        }
        self.told_ns.store(at_ns, Ordering::Relaxed);
        if let Some(gauge) = seen.gauges.tractor() {
            let placed = || topics::frame(at_ns, frames::TRACTOR, frames::of_tractor(&gauge));
            self.shared.frames.send(at_ns, placed);
            self.shared.tractor.send(at_ns, || topics::tractor(at_ns, &gauge));
        }
        if let Some(fix) = seen.gauges.fix() {
            self.shared.fix.send(at_ns, || topics::fix(at_ns, &fix));
        }
    }
}

impl Onlooker for Telling {
    fn scan(&self, seen: &Seen<'_>) {
        let at_ns = (seen.at_s.max(0.0) * 1e9) as u64;
        let Some(scanner) = self.scanners.get(seen.scanner) else { return };
        self.scan_ns.store(at_ns, Ordering::Relaxed);
        if let Some(server) = &*self.serving.lock() {
            server.broadcast_time(at_ns);
        }
        self.tractor(at_ns, seen);
        let ScannerTopics { name, scan, points, .. } = scanner;
        if let Some(sight) = &seen.sight {
            let placed = || topics::frame(at_ns, name, frames::of_scanner(sight, seen.scan.beams));
            self.shared.frames.send(at_ns, placed);
        }
        scan.send(at_ns, || rowscan_recording::foxglove::laser_scan(at_ns, name, seen.scan));
        points.send(at_ns, || rowscan_recording::foxglove::point_cloud(at_ns, name, seen.scan));
    }

    fn measured(&self, scanner: usize, metres: &[Metre]) {
        let (Some(topics), Some(last)) = (self.scanners.get(scanner), metres.last()) else { return };
        let at_ns = self.scan_ns.load(Ordering::Relaxed);
        topics.canopy.send(at_ns, || topics::canopy(at_ns, last));
    }
}
