//! Between a client and a device: everything passes, both ways, through the faults on the client's side.

use std::io;

use tokio::io::{AsyncRead, AsyncWrite, copy_bidirectional_with_sizes};

use crate::stream::FaultyStream;

/// Bytes taken at a time.
const CHUNK: usize = 16 * 1024;

/// What passed, on the client's side.
#[derive(Debug)]
pub struct Relayed {
    /// Bytes the client was sent.
    pub to_client: u64,
    /// Bytes the client has sent.
    pub to_device: u64,
    /// How it ended; an error of either side.
    pub ended: io::Result<()>,
}

/// Relays until both sides have closed or one has failed. One side's orderly close is handed on while the other goes on.
pub async fn relay<C, D>(client: &mut FaultyStream<C>, device: &mut D) -> Relayed
where
    C: AsyncRead + AsyncWrite + Unpin,
    D: AsyncRead + AsyncWrite + Unpin,
{
    let ended = copy_bidirectional_with_sizes(client, device, CHUNK, CHUNK).await.map(|_| ());
    let [to_client, to_device] = client.passed();
    Relayed { to_client, to_device, ended }
}
