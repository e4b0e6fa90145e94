//! Where somebody's NMEA is heard: a TCP server, datagrams, a serial port.

use std::io;
use std::path::PathBuf;
use std::str::FromStr;

use tokio::io::AsyncReadExt;
use tokio::net::{TcpStream, UdpSocket};

use super::NmeaError;
use super::line::{rated, refused};
use rowscan_ports::Port;

/// Bytes taken at a time; a datagram is no longer.
const CHUNK: usize = 2048;
/// Rate of NMEA 0183 itself, bits a second.
const DEFAULT_RATE: u32 = 4800;

/// A receiver to listen to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum NmeaSource {
    /// `tcp:HOST:PORT`: a server, dialled again when it is lost.
    Tcp(String),
    /// `udp:ADDR:PORT`: datagrams to there.
    Udp(String),
    /// `serial:DEV@RATE`: a serial port, 4800 bits a second without a rate.
    Serial(PathBuf, u32),
}

/// A name that is no receiver.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "expected a receiver as HOST:PORT or tcp:HOST:PORT, udp:ADDR:PORT (datagrams to there) or serial:DEV@RATE, found `{0}`"
)]
pub struct NmeaSourceError(String);

impl FromStr for NmeaSource {
    type Err = NmeaSourceError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let wrong = || NmeaSourceError(text.to_owned());
        let (kind, place) = text.split_once(':').filter(|(_, place)| !place.is_empty()).ok_or_else(wrong)?;
        match kind {
            "tcp" if place.contains(':') => Ok(Self::Tcp(place.to_owned())),
            "udp" if place.contains(':') => Ok(Self::Udp(place.to_owned())),
            "serial" if !place.contains('@') => Ok(Self::Serial(place.into(), DEFAULT_RATE)),
            "serial" => rated(place).map(|(port, rate)| Self::Serial(port, rate)).ok_or_else(wrong),
            // A bare address is a server's.
            _ if kind != "tcp" && kind != "udp" && place.parse::<u16>().is_ok() => {
                Ok(Self::Tcp(text.to_owned()))
            }
            _ => Err(wrong()),
        }
    }
}

/// An open receiver.
#[derive(Debug)]
pub struct NmeaReceiver {
    source: NmeaSource,
    line: Option<Line>,
    chunk: Vec<u8>,
}

#[derive(Debug)]
enum Line {
    Tcp(TcpStream),
    Udp(UdpSocket),
    Serial(Box<Port>),
}

impl NmeaSource {
    /// Opens it.
    ///
    /// # Errors
    /// What the system refuses.
    pub async fn open(self) -> Result<NmeaReceiver, NmeaError> {
        let line = Some(self.dial().await?);
        Ok(NmeaReceiver { source: self, line, chunk: vec![0; CHUNK] })
    }

    async fn dial(&self) -> Result<Line, NmeaError> {
        Ok(match self {
            Self::Tcp(address) => Line::Tcp(TcpStream::connect(address).await.map_err(refused(address))?),
            Self::Udp(address) => Line::Udp(UdpSocket::bind(address).await.map_err(refused(address))?),
            Self::Serial(path, rate) => Line::Serial(Box::new(Port::open(path, *rate)?)),
        })
    }
}

impl NmeaReceiver {
    /// The next bytes, whole sentences or not; none once when the receiver is lost, which is then dialled again, for ever. Cancel safe.
    pub async fn hear(&mut self) -> &[u8] {
        loop {
            let Some(line) = &mut self.line else {
                rowscan_ports::clock::retry_pause().await;
                self.line = self.source.dial().await.ok();
                continue;
            };
            let read: io::Result<usize> = match line {
                Line::Tcp(stream) => stream.read(&mut self.chunk).await,
                Line::Udp(socket) => socket.recv(&mut self.chunk).await,
                Line::Serial(port) => port.read(&mut self.chunk).await,
            };
            match read {
                Ok(read @ 1..) => return self.chunk.get(..read).unwrap_or_default(),
                Ok(0) if matches!(line, Line::Udp(_)) => {}
                _ => {
                    tracing::warn!(source = ?self.source, "the receiver is gone; dialled again");
                    self.line = None;
                    return &[];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn receivers_are_named() {
        assert_eq!("tcp:10.0.0.7:10110".parse(), Ok(NmeaSource::Tcp("10.0.0.7:10110".into())));
        assert_eq!(
            "serial:/dev/ttyUSB0@38400".parse(),
            Ok(NmeaSource::Serial("/dev/ttyUSB0".into(), 38_400))
        );
        assert_eq!("serial:/dev/ttyS1".parse(), Ok(NmeaSource::Serial("/dev/ttyS1".into(), 4800)));
        assert_eq!("localhost:10110".parse(), Ok(NmeaSource::Tcp("localhost:10110".into())));
        for wrong in ["tcp:5", "gps", "serial:x@fast", "pty:x", ""] {
            let message = wrong.parse::<NmeaSource>().unwrap_err().to_string();
            assert!(message.contains(&format!("found `{wrong}`")), "{message}");
        }
    }
}
