//! Serves routes at an address: so many connections, none that only waits.

use std::net::SocketAddr;
use std::sync::Arc;

use axum::{Router, middleware};
use hyper::server::conn::http1;
use hyper_util::rt::TokioIo;
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;
use tokio::task::JoinSet;

use crate::clock;
use crate::guard::{self, Guard};
use rowscan_ports::task;

/// Connections at once, unless told otherwise; more wait to be taken.
const MOST: usize = 32;
/// What a request's head may hold.
const HEAD_BYTES: usize = 16 * 1024;

/// Routes at an address. Dropping it closes its connections.
#[derive(Debug)]
pub struct Server {
    address: SocketAddr,
    tasks: JoinSet<()>,
}

/// Why nothing can be served.
#[derive(Debug, thiserror::Error)]
#[error("cannot listen on {address} for control: {cause}")]
pub struct ServerError {
    address: String,
    cause: std::io::Error,
}

/// Routes to be served.
#[derive(Clone, Debug)]
pub struct Served {
    /// What only those may ask whom the guard lets.
    pub guarded: Router,
    /// What is no secret: a page that asks for the token, without what the token is for.
    pub public: Router,
    /// Connections at once; more wait to be taken.
    pub connections: usize,
}

impl From<Router> for Served {
    fn from(guarded: Router) -> Self {
        Self { guarded, public: Router::new(), connections: MOST }
    }
}

impl Server {
    /// Serves `routes` at `address` (port 0 takes a free one) to whom `guard` lets. `guard` hears where that is.
    ///
    /// # Errors
    /// The address is not to be had.
    pub async fn open(
        address: &str,
        routes: impl Into<Served>,
        guard: impl FnOnce(&SocketAddr) -> Guard,
    ) -> Result<Self, ServerError> {
        let Served { guarded, public, connections } = routes.into();
        let (listener, address) = bind(address).await?;
        let routes =
            guarded.layer(middleware::from_fn_with_state(guard(&address), guard::check)).merge(public);
        let mut tasks = JoinSet::new();
        tasks.spawn(task(accept(listener, routes, connections)));
        Ok(Self { address, tasks })
    }

    /// Whether `address` is to be had now; the port that it has, where 0 is asked for.
    ///
    /// # Errors
    /// It is not.
    pub async fn vacant(address: &str) -> Result<SocketAddr, ServerError> {
        bind(address).await.map(|(_, address)| address)
    }

    /// Serves no longer: when this returns, its address is free.
    pub async fn close(mut self) {
        self.tasks.shutdown().await;
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }
}

/// A listener, and where it is.
async fn bind(address: &str) -> Result<(TcpListener, SocketAddr), ServerError> {
    let refused = |cause| ServerError { address: address.to_owned(), cause };
    let listener = TcpListener::bind(address).await.map_err(refused)?;
    let address = listener.local_addr().map_err(refused)?;
    Ok((listener, address))
}

async fn accept(listener: TcpListener, routes: Router, connections: usize) {
    let seats = Arc::new(Semaphore::new(connections));
    let mut serving = JoinSet::new();
    loop {
        // It is never closed.
        let Ok(seat) = Arc::clone(&seats).acquire_owned().await else { return };
        match listener.accept().await {
            Ok((stream, _)) => {
                let routes = routes.clone();
                serving.spawn(task(async move {
                    serve(stream, routes).await;
                    drop(seat);
                }));
            }
            Err(_) => rowscan_ports::clock::retry_pause().await,
        }
        while serving.try_join_next().is_some() {}
    }
}

async fn serve(stream: TcpStream, routes: Router) {
    let _ = stream.set_nodelay(true);
    let mut http = http1::Builder::new();
    http.timer(clock::hyper_timer())
        .header_read_timeout(clock::HEAD)
        .max_buf_size(HEAD_BYTES)
        .keep_alive(true);
    let connection = http.serve_connection(TokioIo::new(stream), TowerToHyperService::new(routes));
    // Upgrades, so that a WebSocket may be among the routes. A client that breaks off has its reasons.
    let _ = connection.with_upgrades().await;
}
