//! Serves routes at an address: so many connections, of which none keeps its seat by waiting.

use std::collections::VecDeque;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use axum::{Router, middleware};
use hyper::server::conn::http1;
use hyper::service::Service;
use hyper::{Request, StatusCode};
use hyper_util::rt::TokioIo;
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::task::{AbortHandle, JoinSet};

use crate::clock;
use crate::guard::{self, Guard};
use rowscan_ports::task;

/// Connections at once, unless told otherwise.
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
    /// Connections at once.
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

/// Takes connections; in a full house the one that has been without a request for longest makes room.
async fn accept(listener: TcpListener, routes: Router, most: usize) {
    let mut serving = JoinSet::new();
    let mut seats: VecDeque<Seat> = VecDeque::new();
    loop {
        match listener.accept().await {
            Ok((stream, _)) => {
                while serving.try_join_next().is_some() {}
                seats.retain(|seat| !seat.serving.is_finished());
                if seats.len() >= most {
                    // Where all of them work, the oldest: an answer takes a second at most.
                    let idle = seats.iter().position(|seat| !seat.requests.is_busy()).unwrap_or_default();
                    if let Some(seat) = seats.remove(idle) {
                        seat.serving.abort();
                    }
                }
                let requests = Requests::default();
                let work = serve(stream, routes.clone(), requests.clone());
                seats.push_back(Seat { serving: serving.spawn(task(work)), requests });
            }
            Err(_) => rowscan_ports::clock::retry_pause().await,
        }
    }
}

/// A connection.
struct Seat {
    serving: AbortHandle,
    requests: Requests,
}

/// Requests of a connection that are being answered.
#[derive(Clone, Debug, Default)]
struct Requests(Arc<AtomicUsize>);

impl Requests {
    fn is_busy(&self) -> bool {
        self.0.load(Ordering::Acquire) > 0
    }
}

async fn serve(stream: TcpStream, routes: Router, requests: Requests) {
    let _ = stream.set_nodelay(true);
    let mut http = http1::Builder::new();
    http.timer(clock::hyper_timer())
        .header_read_timeout(clock::HEAD)
        .max_buf_size(HEAD_BYTES)
        .keep_alive(true);
    let routes = TowerToHyperService::new(routes);
    let counted = hyper::service::service_fn(move |request: Request<_>| {
        let (answer, requests) = (routes.call(request), requests.clone());
        requests.0.fetch_add(1, Ordering::AcqRel);
        async move {
            let answer = answer.await;
            // A connection that has become a socket of its own is busy to its end.
            if !answer.as_ref().is_ok_and(|answer| answer.status() == StatusCode::SWITCHING_PROTOCOLS) {
                requests.0.fetch_sub(1, Ordering::AcqRel);
            }
            answer
        }
    });
    let connection = http.serve_connection(TokioIo::new(stream), counted);
    // Upgrades, so that a WebSocket may be among the routes. A client that breaks off has its reasons.
    let _ = connection.with_upgrades().await;
}

#[cfg(test)]
mod tests {
    use axum::routing::get;
    use tokio::io::{AsyncReadExt, AsyncWriteExt};
    use tokio::time::{Duration, timeout};

    use super::*;

    #[tokio::test]
    async fn connections_that_say_nothing_make_room() {
        let routes = Router::new().route("/here", get(|| async { "here" }));
        let server = Server::open("127.0.0.1:0", routes, |_| Guard::open()).await.expect("a port");
        let mut silent = Vec::new();
        for _ in 0..MOST + 8 {
            silent.push(TcpStream::connect(server.address()).await.expect("it is taken"));
        }
        let mut client = TcpStream::connect(server.address()).await.expect("it is taken");
        let request = format!("GET /here HTTP/1.1\r\nHost: {}\r\n\r\n", server.address());
        client.write_all(request.as_bytes()).await.expect("sent");
        let mut answer = [0; 15];
        // Less than a silent connection may take for its head.
        let read = timeout(clock::HEAD / 2, client.read_exact(&mut answer)).await;
        read.expect("it is answered at once").expect("whole");
        assert_eq!(&answer, b"HTTP/1.1 200 OK");
        // The first of those who said nothing have gone.
        let gone = timeout(Duration::from_secs(4), silent[0].read(&mut answer)).await;
        assert!(matches!(gone, Ok(Ok(0) | Err(_))), "{gone:?}");
    }
}
