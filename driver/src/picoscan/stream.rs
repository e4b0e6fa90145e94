//! Datagrams and answers of one scanner as one stream.

use std::fmt;
use std::future::Future;
use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddrV4};
use std::pin::Pin;
use std::task::{Context, Poll, ready};

use rowscan_recording::{Side, Tap};
use socket2::SockRef;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt, ReadBuf};
use tokio::net::{TcpStream, UdpSocket};

use super::http::{self, MAX_ANSWER};
use super::piece::{self, ANSWER, HEAD};
use crate::endpoint::dial;
use crate::picoscan_address::PicoscanAddress;

/// Room for a second of a multiScan's datagrams; the system may give less.
const RECEIVE_BUFFER: usize = 4 * 1024 * 1024;
/// Datagrams of others that are passed over before others of this program have their turn.
const MAX_FOREIGN: usize = 64;

/// A request under way.
type Exchange = Pin<Box<dyn Future<Output = io::Result<Vec<u8>>> + Send>>;

/// What carries the conversation with one scanner.
pub(crate) struct PicoStream {
    udp: UdpSocket,
    /// Where datagrams shall come to.
    destination: SocketAddrV4,
    /// Whose datagrams are taken.
    scanner: IpAddr,
    address: String,
    /// Connected, for the first request.
    connected: Option<TcpStream>,
    exchange: Option<Exchange>,
    tap: Tap,
}

/// Datagrams cannot be received.
#[derive(Debug)]
pub(super) struct UdpError {
    /// Where.
    pub(super) at: String,
    pub(super) cause: io::Error,
}

impl fmt::Display for UdpError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.at, self.cause)
    }
}

impl std::error::Error for UdpError {}

impl PicoStream {
    /// Connects to REST, and listens for datagrams where the scanner is reached from, unless told otherwise.
    pub(super) async fn open(place: &PicoscanAddress, tap: Tap) -> io::Result<Self> {
        let connected = dial::tcp(&place.address).await?;
        let (own, scanner) = (connected.local_addr()?.ip(), connected.peer_addr()?.ip());
        let refuse = |at: String, cause: io::Error| io::Error::other(UdpError { at, cause });
        let ip = match (place.bind, own.to_canonical()) {
            (Some(bind), _) => bind,
            (None, IpAddr::V4(own)) => own,
            (None, IpAddr::V6(own)) => {
                let why =
                    "a scanner sends to IPv4 addresses only; name one of this machine with bind=ADDRESS";
                return Err(refuse(
                    format!("[{own}]:{}", place.udp),
                    io::Error::new(io::ErrorKind::InvalidInput, why),
                ));
            }
        };
        let at = SocketAddrV4::new(ip, place.udp);
        let udp = UdpSocket::bind(at).await.map_err(|cause| refuse(at.to_string(), cause))?;
        SockRef::from(&udp).set_recv_buffer_size(RECEIVE_BUFFER)?;
        let reached = match (ip, own.to_canonical()) {
            (Ipv4Addr::UNSPECIFIED, IpAddr::V4(own)) => own,
            _ => ip,
        };
        let destination = SocketAddrV4::new(reached, udp.local_addr()?.port());
        let (address, scanner) = (place.address.clone(), scanner.to_canonical());
        Ok(Self { udp, destination, scanner, address, connected: Some(connected), exchange: None, tap })
    }

    /// Where the scanner shall send.
    pub(super) fn destination(&self) -> SocketAddrV4 {
        self.destination
    }

    /// A scanner that is reached on this machine, or through a tunnel of it, may send from elsewhere.
    fn is_from_scanner(&self, from: IpAddr) -> bool {
        self.scanner.is_loopback() || from.to_canonical() == self.scanner
    }

    fn poll_datagram(&mut self, cx: &mut Context<'_>, buffer: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        let before = buffer.filled().len();
        for _ in 0..MAX_FOREIGN {
            buffer.set_filled(before);
            // Filled in once it is known.
            buffer.put_slice(&[0; HEAD]);
            let from = match self.udp.poll_recv_from(cx, buffer) {
                Poll::Ready(from) => from,
                Poll::Pending => {
                    buffer.set_filled(before);
                    return Poll::Pending;
                }
            };
            match from {
                Ok(from) if self.is_from_scanner(from.ip()) => {
                    let head = buffer.filled_mut().get_mut(before..).and_then(<[u8]>::first_chunk_mut);
                    if let Some(head) = head {
                        *head = piece::datagram_head(from);
                    }
                    self.tap.record(Side::Device, buffer.filled().get(before + HEAD..).unwrap_or_default());
                    return Poll::Ready(Ok(()));
                }
                Ok(_) => {}
                Err(cause) => {
                    buffer.set_filled(before);
                    return Poll::Ready(Err(cause));
                }
            }
        }
        buffer.set_filled(before);
        cx.waker().wake_by_ref();
        Poll::Pending
    }
}

/// Sends one request, and takes its answer.
async fn exchange(connected: Option<TcpStream>, address: String, request: Vec<u8>) -> io::Result<Vec<u8>> {
    let mut stream = match connected {
        Some(stream) => stream,
        None => dial::tcp(&address).await?,
    };
    stream.write_all(&request).await?;
    let mut answer = Vec::new();
    let mut chunk = [0; 4096];
    while !http::is_whole(&answer) {
        let read = stream.read(&mut chunk).await?;
        if read == 0 {
            break;
        }
        answer.extend_from_slice(chunk.get(..read).unwrap_or_default());
        if answer.len() > MAX_ANSWER {
            let why = format!("an answer of more than {MAX_ANSWER} bytes");
            return Err(io::Error::new(io::ErrorKind::InvalidData, why));
        }
    }
    Ok(answer)
}

impl AsyncRead for PicoStream {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        if let Some(exchange) = &mut self.exchange
            && let Poll::Ready(answer) = exchange.as_mut().poll(cx)
        {
            self.exchange = None;
            let answer = answer?;
            buffer.put_slice(&[ANSWER]);
            let room = answer.len().min(buffer.remaining());
            buffer.put_slice(answer.get(..room).unwrap_or_default());
            return Poll::Ready(Ok(()));
        }
        ready!(self.poll_datagram(cx, buffer))?;
        Poll::Ready(Ok(()))
    }
}

impl AsyncWrite for PicoStream {
    /// Takes a whole request.
    fn poll_write(mut self: Pin<&mut Self>, _: &mut Context<'_>, request: &[u8]) -> Poll<io::Result<usize>> {
        let (connected, address) = (self.connected.take(), self.address.clone());
        self.exchange = Some(Box::pin(exchange(connected, address, request.to_vec())));
        Poll::Ready(Ok(request.len()))
    }

    fn poll_flush(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(Ok(()))
    }

    fn poll_shutdown(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(Ok(()))
    }
}
