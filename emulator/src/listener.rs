//! TCP endpoints of the virtual scanner.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;

use rowscan_faults::{GatedListener, reset_on_drop};
use rowscan_ports::clock::retry_pause;
use rowscan_ports::task;
use rowscan_ports::{keep_alive, keep_near};
use tokio::net::{TcpListener, UdpSocket};
use tokio::task::JoinSet;

use crate::connection;
use crate::shared::Shared;

/// A listening endpoint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bound {
    /// The address, with the real port where 0 was asked for.
    pub address: SocketAddr,
}

/// Why an endpoint could not listen.
#[derive(Debug, thiserror::Error)]
pub enum ListenError {
    /// Another program has the port.
    #[error(
        "cannot listen on {address}: the port is in use; end the other program, or choose another port (`--tcp 127.0.0.1:0` takes a free one)"
    )]
    Busy {
        /// What was asked for.
        address: String,
    },
    /// Anything else.
    #[error("cannot listen on {address}: {cause}; expected HOST:PORT such as 127.0.0.1:2111")]
    Other {
        /// What was asked for.
        address: String,
        /// What the system said.
        cause: io::Error,
    },
}

pub(crate) async fn bind(address: &str) -> Result<(TcpListener, Bound), ListenError> {
    let listener = TcpListener::bind(address).await.map_err(|cause| refused(address, cause))?;
    let bound = Bound { address: listener.local_addr().map_err(|cause| refused(address, cause))? };
    Ok((listener, bound))
}

/// The same for datagrams.
pub(crate) async fn bind_datagrams(address: &str) -> Result<(UdpSocket, Bound), ListenError> {
    let socket = UdpSocket::bind(address).await.map_err(|cause| refused(address, cause))?;
    let bound = Bound { address: socket.local_addr().map_err(|cause| refused(address, cause))? };
    Ok((socket, bound))
}

fn refused(address: &str, cause: io::Error) -> ListenError {
    match cause.kind() {
        io::ErrorKind::AddrInUse => ListenError::Busy { address: address.to_owned() },
        _ => ListenError::Other { address: address.to_owned(), cause },
    }
}

/// Takes clients in for as long as the scanner runs.
pub(crate) async fn accept(shared: Arc<Shared>, listener: TcpListener) {
    let mut clients = JoinSet::new();
    let mut listener = match GatedListener::new(listener, shared.config.faults.clone()) {
        Ok(listener) => listener,
        Err(cause) => return tracing::warn!(%cause, "cannot listen"),
    };
    loop {
        tokio::select! {
            accepted = listener.accept() => match accepted {
                Ok((stream, peer)) => {
                    let patient = shared.clock.delivery().is_patient();
                    if let Err(cause) = keep_alive(&stream).and_then(|()| if patient { keep_near(&stream) } else { Ok(()) }) {
                        tracing::debug!(%cause, "socket options refused");
                    }
                    let shared = Arc::clone(&shared);
                    clients.spawn(task(connection::serve(shared, peer.to_string(), stream, reset_on_drop)));
                }
                Err(cause) => {
                    // Out of descriptors, most likely: the clients already here must not suffer for it.
                    tracing::warn!(%cause, "cannot accept");
                    retry_pause().await;
                }
            },
            Some(_) = clients.join_next() => {}
        }
    }
}
