//! A listener that faults may close, or have act as if nobody were behind it.

use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use rowscan_ports::clock::retry_pause;
use rowscan_ports::task;
use socket2::SockRef;
use tokio::io::AsyncReadExt;
use tokio::net::{TcpListener, TcpSocket, TcpStream};
use tokio::sync::watch;
use tokio::task::JoinSet;

use crate::fault::Door;
use crate::handle::StreamFaults;

/// Connections that may wait to be taken, as of other listeners here.
const BACKLOG: u32 = 1024;

/// A TCP listener behind the faults of its stream. Without any it is just a listener.
#[derive(Debug)]
pub struct GatedListener {
    /// None while nobody listens.
    listener: Option<TcpListener>,
    /// Has the port while nobody listens: no other program may take it meanwhile.
    held: Option<TcpSocket>,
    address: SocketAddr,
    faults: Option<(StreamFaults, watch::Receiver<u64>)>,
    /// Connections that are taken and never answered.
    silent: JoinSet<()>,
}

impl StreamFaults {
    /// Puts the faults before a listener.
    ///
    /// # Errors
    /// The listener's address cannot be told.
    pub fn guard(&self, listener: TcpListener) -> io::Result<GatedListener> {
        GatedListener::new(listener, Some(self.clone()))
    }
}

impl GatedListener {
    /// A listener behind `faults`, if there are any.
    ///
    /// # Errors
    /// The listener's address cannot be told.
    pub fn new(listener: TcpListener, faults: Option<StreamFaults>) -> io::Result<Self> {
        let address = listener.local_addr()?;
        let faults = faults.map(|faults| {
            let changes = faults.changes();
            (faults, changes)
        });
        Ok(Self { listener: Some(listener), held: None, address, faults, silent: JoinSet::new() })
    }

    /// Where it listens, also while nobody does.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// The next connection that is served. Cancel safe.
    ///
    /// # Errors
    /// The system's, such as too many open files; try again later.
    pub async fn accept(&mut self) -> io::Result<(TcpStream, SocketAddr)> {
        loop {
            while self.silent.try_join_next().is_some() {}
            let Some((faults, changes)) = &mut self.faults else {
                return accept((&mut self.listener, &mut self.held), self.address).await;
            };
            changes.borrow_and_update();
            let refuses = faults.refuses();
            if refuses && self.listener.take().is_some() {
                self.held = hold(self.address);
            }
            tokio::select! {
                accepted = accept((&mut self.listener, &mut self.held), self.address), if !refuses => {
                    let (stream, peer) = accepted?;
                    match faults.admit() {
                        None => return Ok((stream, peer)),
                        Some(Door::Silent) => drop(self.silent.spawn(task(ignore(stream)))),
                        Some(Door::Close) => drop(stream),
                        Some(Door::Refuse) => reset_on_drop(&stream),
                    }
                }
                // The sender lives as long as the faults do.
                _ = changes.changed() => {}
            }
        }
    }
}

/// A socket that has the port and does not listen there: whoever connects is refused.
fn hold(address: SocketAddr) -> Option<TcpSocket> {
    let bound = || {
        let socket = if address.is_ipv4() { TcpSocket::new_v4() } else { TcpSocket::new_v6() }?;
        // Connections that were taken before still have it, too.
        socket.set_reuseaddr(true)?;
        socket.bind(address)?;
        io::Result::Ok(socket)
    };
    bound().inspect_err(|cause| tracing::debug!(%cause, "cannot keep {address}")).ok()
}

/// Listens again if nobody does, and accepts. Cancel safe.
async fn accept(
    (listener, held): (&mut Option<TcpListener>, &mut Option<TcpSocket>),
    address: SocketAddr,
) -> io::Result<(TcpStream, SocketAddr)> {
    loop {
        if let Some(listener) = listener {
            return listener.accept().await;
        }
        let again = match held.take() {
            Some(socket) => socket.listen(BACKLOG),
            None => TcpListener::bind(address).await,
        };
        match again {
            Ok(bound) => *listener = Some(bound),
            Err(cause) => {
                tracing::warn!(%cause, "cannot listen on {address} again");
                retry_pause().await;
            }
        }
    }
}

/// Reads until the client has had enough.
async fn ignore(mut stream: TcpStream) {
    let mut chunk = [0; 512];
    while stream.read(&mut chunk).await.is_ok_and(|read| read > 0) {}
}

/// Has the connection end with a reset when it is dropped; what [`StreamFaults::wrap`] takes for TCP.
pub fn reset_on_drop(stream: &TcpStream) {
    if let Err(cause) = SockRef::from(stream).set_linger(Some(Duration::ZERO)) {
        tracing::debug!(%cause, "socket options refused");
    }
}
