//! A serial line over TCP: with RFC 2217, which carries the client's rate, or the bare bytes.

use std::io;
use std::net::SocketAddr;
use std::pin::Pin;
use std::task::{Context, Poll, ready};

use rowscan_protocol::rfc2217;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};

use crate::{PortError, Tally, Wire, keep_alive};

/// Bytes taken from a client at a time.
const READ_CHUNK: usize = 512;
/// Bytes kept for a client that does not read.
const MAX_OUT: usize = 16 * 1024;

/// A TCP port that is a serial line: one client at a time, others are turned away.
#[derive(Debug)]
pub struct NetLine {
    listener: TcpListener,
    address: SocketAddr,
    telnet: bool,
    client: Option<Session>,
    refused: Tally,
}

#[derive(Debug)]
struct Session {
    stream: TcpStream,
    /// None on a line of bare bytes.
    server: Option<rfc2217::Server>,
    arrived: Vec<u8>,
    out: Vec<u8>,
}

impl NetLine {
    /// Listens on `address` for an RFC 2217 client.
    pub async fn rfc2217(address: &str) -> Result<Self, PortError> {
        Self::listen(address, true).await
    }

    /// Listens on `address` for a client that sends and receives the bare bytes.
    pub async fn bare(address: &str) -> Result<Self, PortError> {
        Self::listen(address, false).await
    }

    async fn listen(address: &str, telnet: bool) -> Result<Self, PortError> {
        let fail = |cause| PortError::Listen { address: address.to_owned(), cause };
        let listener = TcpListener::bind(address).await.map_err(fail)?;
        let address = listener.local_addr().map_err(fail)?;
        Ok(Self { listener, address, telnet, client: None, refused: Tally::default() })
    }

    /// Where it listens, with the real port where 0 was asked for.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Takes a client in if there is none.
    fn poll_accept(&mut self, cx: &mut Context<'_>) {
        while let Poll::Ready(accepted) = self.listener.poll_accept(cx) {
            match accepted {
                Ok((stream, _)) if self.client.is_none() => {
                    if let Err(cause) = keep_alive(&stream) {
                        tracing::debug!(%cause, "socket options refused");
                    }
                    let server = self.telnet.then(rfc2217::Server::new);
                    self.client = Some(Session { stream, server, arrived: Vec::new(), out: Vec::new() });
                }
                Ok((_, client)) => {
                    if let Some(so_far) = self.refused.count() {
                        tracing::warn!(
                            "{client} is refused: the serial line at {} has a client already ({so_far} refused so far)",
                            self.address
                        );
                    }
                }
                Err(cause) => {
                    tracing::warn!(%cause, "cannot accept");
                    return;
                }
            }
        }
    }
}

impl Session {
    /// Sends what is waiting; ready once it is gone.
    fn poll_out(&mut self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        while !self.out.is_empty() {
            let sent = ready!(Pin::new(&mut self.stream).poll_write(cx, &self.out))?;
            self.out.drain(..sent);
        }
        Poll::Ready(Ok(()))
    }

    /// Reads on until data has arrived; `Ok(false)` once the client has left.
    fn poll_in(&mut self, cx: &mut Context<'_>) -> Poll<io::Result<bool>> {
        while self.arrived.is_empty() {
            let mut chunk = [0; READ_CHUNK];
            let mut room = ReadBuf::new(&mut chunk);
            ready!(Pin::new(&mut self.stream).poll_read(cx, &mut room))?;
            match (room.filled(), &mut self.server) {
                ([], _) => return Poll::Ready(Ok(false)),
                (bytes, None) => self.arrived.extend_from_slice(bytes),
                (bytes, Some(server)) => {
                    // A client that asks and does not read the answers is not served for ever.
                    if self.out.len() > MAX_OUT {
                        return Poll::Ready(Ok(false));
                    }
                    server.decode(bytes, &mut self.arrived, &mut self.out);
                }
            }
            if let Poll::Ready(Err(cause)) = self.poll_out(cx) {
                return Poll::Ready(Err(cause));
            }
        }
        Poll::Ready(Ok(true))
    }
}

impl Wire for NetLine {
    fn client_rate(&self) -> io::Result<Option<u32>> {
        let server = self.client.as_ref().and_then(|client| client.server.as_ref());
        Ok(server.and_then(|server| server.settings().rate))
    }

    fn set_rate(&mut self, _: u32) -> io::Result<()> {
        Ok(())
    }

    fn is_open(&self) -> bool {
        self.client.is_some()
    }
}

impl AsyncRead for NetLine {
    fn poll_read(self: Pin<&mut Self>, cx: &mut Context<'_>, buf: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        let this = self.get_mut();
        loop {
            this.poll_accept(cx);
            let Some(client) = &mut this.client else { return Poll::Pending };
            match ready!(client.poll_in(cx)) {
                Ok(true) => {
                    let taken = client.arrived.len().min(buf.remaining());
                    buf.put_slice(client.arrived.get(..taken).unwrap_or_default());
                    client.arrived.drain(..taken);
                    return Poll::Ready(Ok(()));
                }
                // Gone, in order or not: the line waits for the next one.
                Ok(false) | Err(_) => this.client = None,
            }
        }
    }
}

impl AsyncWrite for NetLine {
    fn poll_write(self: Pin<&mut Self>, cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        let this = self.get_mut();
        let Some(client) = &mut this.client else { return Poll::Ready(Ok(bytes.len())) };
        match client.poll_out(cx) {
            Poll::Ready(Err(_)) => {
                this.client = None;
                return Poll::Ready(Ok(bytes.len()));
            }
            Poll::Pending if client.out.len() > MAX_OUT => return Poll::Pending,
            _ => {}
        }
        match client.server {
            Some(_) => rfc2217::escape(bytes, &mut client.out),
            None => client.out.extend_from_slice(bytes),
        }
        // Begun now, and gone on with by whatever comes next.
        let _ = client.poll_out(cx);
        Poll::Ready(Ok(bytes.len()))
    }

    fn poll_flush(self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        let this = self.get_mut();
        let Some(client) = &mut this.client else { return Poll::Ready(Ok(())) };
        if ready!(client.poll_out(cx)).is_err() {
            // Gone, in order or not: the line waits for the next one.
            this.client = None;
        }
        Poll::Ready(Ok(()))
    }

    fn poll_shutdown(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        self.get_mut().client = None;
        Poll::Ready(Ok(()))
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use socket2::SockRef;
    use tokio::io::{AsyncReadExt, AsyncWriteExt};
    use tokio::time::{sleep, timeout};

    use super::*;

    /// What a client leaves behind when it is killed with bytes unread.
    #[tokio::test]
    async fn a_client_that_resets_its_connection_does_not_end_the_line() {
        let mut line = NetLine::bare("127.0.0.1:0").await.expect("a free port");
        for round in 0..2 {
            let mut client = TcpStream::connect(line.address()).await.expect("it listens");
            client.write_all(b"ask").await.expect("taken");
            let mut heard = [0; 3];
            let heard_in_time = timeout(Duration::from_secs(5), line.read_exact(&mut heard)).await;
            heard_in_time.expect("heard").expect("the line holds");
            assert_eq!(&heard, b"ask", "round {round}");
            SockRef::from(&client).set_linger(Some(Duration::ZERO)).expect("set");
            drop(client);
            sleep(Duration::from_millis(20)).await;
            // Nothing looks whether the client is there but this.
            line.client.as_mut().expect("not noticed yet").out.extend_from_slice(&[0; 64]);
            line.flush().await.expect("a line without a client is one");
            line.write_all(&[0; 64]).await.expect("a line without a client is one");
        }
    }
}
