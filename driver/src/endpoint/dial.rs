//! Opens TCP connections with the socket options a scanner link wants.

use std::io;
use std::time::Duration;

use socket2::{SockRef, TcpKeepalive};
use tokio::net::TcpStream;

/// A dead peer is noticed after about IDLE + RETRIES × INTERVAL, long before the system's own two hours.
const KEEPALIVE_IDLE: Duration = Duration::from_secs(5);
const KEEPALIVE_INTERVAL: Duration = Duration::from_secs(2);

/// Room for about two seconds of LMS511 scans, so that a busy host does not stall the device.
const RECEIVE_BUFFER: usize = 256 * 1024;

/// Connects; the caller limits how long that may take.
pub(crate) async fn tcp(address: &str) -> io::Result<TcpStream> {
    let stream = TcpStream::connect(address).await?;
    // Commands are small and each waits for its reply: Nagle's delay would only add to it.
    stream.set_nodelay(true)?;
    let socket = SockRef::from(&stream);
    socket.set_tcp_keepalive(
        &TcpKeepalive::new().with_time(KEEPALIVE_IDLE).with_interval(KEEPALIVE_INTERVAL),
    )?;
    socket.set_recv_buffer_size(RECEIVE_BUFFER)?;
    Ok(stream)
}
