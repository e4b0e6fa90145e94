//! Where clients find a scanner.

use std::fmt;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use rowscan_ports::{NetLine, Port, Pty, Untaken, Wire};

use crate::BenchError;

/// Where a scanner is to be found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Endpoint {
    /// A network address; port 0 takes a free one. Of an LMS2xx, the bare bytes of its line.
    Tcp(String),
    /// A link to a pseudo-terminal, removed at the end.
    Pty(PathBuf),
    /// The other end of a serial port, at this rate; at the scanner's own where none is given.
    Serial(PathBuf, Option<u32>),
    /// A serial port over TCP (RFC 2217) at this address.
    Rfc2217(String),
}

impl Endpoint {
    /// Whether it is a line, for one client, and not a network address.
    pub fn is_line(&self) -> bool {
        !matches!(self, Self::Tcp(_))
    }
}

/// Where something of a bench is found, once it is open.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The part's name: of a scanner, a bus, or `nmea`.
    pub part: String,
    /// The kind of endpoint, as the command line names it: `tcp`, `pty`, `serial`, `rfc2217`, `nmea`, `slcan`, …
    pub kind: &'static str,
    /// Where.
    pub at: At,
}

/// An address, a path, or a name of the system's.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum At {
    /// With the real port where 0 was asked for.
    Address(SocketAddr),
    /// A device file or a link to one.
    Path(PathBuf),
    /// A name, as of a CAN interface, or an address as it was given.
    Name(String),
}

impl At {
    /// The path, if it is one.
    pub fn path(&self) -> Option<&Path> {
        match self {
            Self::Path(path) => Some(path),
            Self::Address(_) | Self::Name(_) => None,
        }
    }
}

impl fmt::Display for At {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Address(address) => address.fmt(f),
            Self::Path(path) => path.display().fmt(f),
            Self::Name(name) => f.write_str(name),
        }
    }
}

impl Place {
    /// The source that reads a scanner there, as `rowscan estimate` takes it; none of a real serial port's other end.
    pub fn source(&self) -> Option<String> {
        match (self.kind, &self.at) {
            ("tcp", at) => Some(format!("tcp://{at}")),
            // Scans come to a free port of the reader's.
            ("rest", at) => Some(format!("picoscan://{at}?udp=0")),
            ("pty", at) => Some(format!("serial:{at}")),
            ("rfc2217", at) => Some(format!("rfc2217://{at}")),
            _ => None,
        }
    }
}

/// A line that was opened.
pub(crate) struct Line {
    pub(crate) wire: Box<dyn Wire>,
    pub(crate) kind: &'static str,
    pub(crate) at: At,
    /// What its client has not read yet, where the system throws that away with the line.
    pub(crate) untaken: Option<Untaken>,
}

impl Line {
    /// Opens an endpoint as a line for one client; a real port at `rate` unless the endpoint says otherwise.
    pub(crate) async fn open(endpoint: &Endpoint, rate: u32) -> Result<Self, BenchError> {
        Ok(match endpoint {
            Endpoint::Tcp(address) => Self::net("tcp", NetLine::bare(address).await?),
            Endpoint::Rfc2217(address) => Self::net("rfc2217", NetLine::rfc2217(address).await?),
            Endpoint::Pty(link) => {
                let pty = Pty::open(link)?;
                let (at, untaken) = (At::Path(pty.path().to_owned()), Some(pty.untaken()?));
                Self { wire: Box::new(pty), kind: "pty", at, untaken }
            }
            Endpoint::Serial(path, own_rate) => {
                let port = Port::open(path, own_rate.unwrap_or(rate))?;
                Self { wire: Box::new(port), kind: "serial", at: At::Path(path.clone()), untaken: None }
            }
        })
    }

    fn net(kind: &'static str, line: NetLine) -> Self {
        let at = At::Address(line.address());
        Self { wire: Box::new(line), kind, at, untaken: None }
    }
}
