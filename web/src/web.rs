//! The page at an address.

use std::net::SocketAddr;
use std::sync::Arc;

use rowscan_control::{Bench, Guard, Served, Server, ServerError, router};
use rowscan_ports::task;
use tokio::sync::{Semaphore, watch};
use tokio::task::JoinSet;

use crate::routes;
use crate::show::Show;
use crate::studio::{BROWSERS, Exposure, Studio, expose};

/// Connections at once: a browser has one for what is live and six for the rest.
const CONNECTIONS: usize = BROWSERS * 4;

/// The page, served. Dropping it closes its connections.
#[derive(Debug)]
pub struct Web {
    server: Server,
    camera: JoinSet<()>,
}

impl Web {
    /// Serves the page for `show` at `address` (port 0 takes a free one), with the routes of `bench` beside it if there is one. `guard` hears where that is.
    ///
    /// # Errors
    /// The address is not to be had.
    pub async fn open(
        address: &str,
        show: Show,
        bench: Option<Bench>,
        guard: impl FnOnce(&SocketAddr) -> Guard,
    ) -> Result<Self, ServerError> {
        let (exposed, exposures) = watch::channel(Exposure::default());
        let seats = Arc::new(Semaphore::new(BROWSERS));
        let studio =
            Studio { show: show.clone(), bench: bench.clone(), seats: Arc::clone(&seats), exposures };
        let watched = routes::watched(studio);
        let guarded = match bench.clone() {
            Some(bench) => watched.merge(router(bench)),
            None => watched.fallback(routes::unknown),
        };
        let served = Served { guarded, public: crate::page::routes(), connections: CONNECTIONS };
        let server = Server::open(address, served, guard).await?;
        let mut camera = JoinSet::new();
        camera.spawn(task(expose(show, bench, seats, exposed)));
        Ok(Self { server, camera })
    }

    /// Serves it no longer: when this returns, its address is free.
    pub async fn close(mut self) {
        self.camera.shutdown().await;
        self.server.close().await;
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.server.address()
    }
}
