//! Between a client and a device: everything passes, both ways, through the faults on the client's side.

use std::io;

use tokio::io::{AsyncRead, AsyncWrite, copy_bidirectional_with_sizes};

use crate::stream::FaultyStream;

/// Bytes taken at a time.
const CHUNK: usize = 16 * 1024;

/// Relays until both sides have closed or one has failed. One side's orderly close is handed on while the other goes on, and so is a reset by the device. What has passed,
/// the client's stream counts.
pub async fn relay<C, D>(client: &mut FaultyStream<C>, device: &mut D) -> io::Result<()>
where
    C: AsyncRead + AsyncWrite + Unpin,
    D: AsyncRead + AsyncWrite + Unpin,
{
    let relayed = copy_bidirectional_with_sizes(client, device, CHUNK, CHUNK).await.map(|_| ());
    if relayed.as_ref().is_err_and(|cause| cause.kind() == io::ErrorKind::ConnectionReset) {
        client.break_off();
    }
    relayed
}
