//! TCP connections whose other end may vanish.

use std::io;
use std::time::Duration;

use socket2::{SockRef, TcpKeepalive};
use tokio::net::TcpStream;

/// Silence before the first probe.
const SILENCE: Duration = Duration::from_secs(30);
/// From probe to probe.
const INTERVAL: Duration = Duration::from_secs(5);
/// Unanswered probes that end a connection.
#[cfg(target_os = "linux")]
const PROBES: u32 = 4;

/// Sends small packets at once, and notices a machine that is gone within a minute: 30 s of silence, then four probes 5 s apart.
pub fn keep_alive(stream: &TcpStream) -> io::Result<()> {
    stream.set_nodelay(true)?;
    let keepalive = TcpKeepalive::new().with_time(SILENCE).with_interval(INTERVAL);
    #[cfg(target_os = "linux")]
    let keepalive = keepalive.with_retries(PROBES);
    SockRef::from(stream).set_tcp_keepalive(&keepalive)
}

/// Acknowledges what has come at once. A client that sends small messages without `TCP_NODELAY` holds back its second one until the first is
/// acknowledged, and Linux waits 40 ms with that. The system forgets it: to be said again after each read.
pub fn acknowledge_at_once(stream: &TcpStream) -> io::Result<()> {
    #[cfg(target_os = "linux")]
    return SockRef::from(stream).set_tcp_quickack(true);
    #[cfg(not(target_os = "linux"))]
    {
        let _ = stream;
        Ok(())
    }
}

/// Bytes that the system may keep for a peer that does not read, where time waits for it. Linux doubles it, and the write that fills it may
/// go beyond.
const SEND_BUFFER: usize = 24 * 1024;

/// Keeps what waits to be sent below 64 KiB. What the peer's own system buffers comes on top.
pub fn keep_near(stream: &TcpStream) -> io::Result<()> {
    SockRef::from(stream).set_send_buffer_size(SEND_BUFFER)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn the_system_has_the_interval_and_the_count() {
        let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
        let stream = TcpStream::connect(listener.local_addr().unwrap()).await.unwrap();
        keep_alive(&stream).unwrap();
        let socket = SockRef::from(&stream);
        assert!(socket.keepalive().unwrap());
        assert!(stream.nodelay().unwrap(), "small packets go at once");
        #[cfg(target_os = "linux")]
        {
            // As a connection has it that has long answered.
            socket.set_tcp_quickack(false).unwrap();
            acknowledge_at_once(&stream).unwrap();
            assert!(socket.tcp_quickack().unwrap());
        }
        #[cfg(target_os = "linux")]
        assert_eq!(
            (
                socket.tcp_keepalive_time().unwrap(),
                socket.tcp_keepalive_interval().unwrap(),
                socket.tcp_keepalive_retries().unwrap()
            ),
            (SILENCE, INTERVAL, PROBES)
        );
    }
}
