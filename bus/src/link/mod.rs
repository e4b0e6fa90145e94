//! Ports of the bus: one file a kind. Frames in, frames out; nothing of what they mean.

pub mod agopengps;
pub mod bridge;
pub mod candump;
pub mod dialect;
pub mod lines;
mod pty;
pub mod slcan;
pub mod socketcan;
pub mod socketcand;
pub mod socketcand_client;
mod tcp;
pub mod udp;

use std::fmt;
use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;

use tokio::net::UdpSocket;
use tokio::sync::mpsc;

use super::BusAddress;
pub use super::port_event::PortEvent;
use super::port_event::{Origin, OutgoingFrame};
use rowscan_ports::Untaken;

/// Why a port could not be opened.
#[derive(Debug, thiserror::Error)]
pub enum BusError {
    /// No pseudo-terminal.
    #[error(transparent)]
    Line(#[from] rowscan_ports::PortError),
    /// A log that cannot be written.
    #[error("cannot write the candump log {}: {cause}", path.display())]
    Log {
        /// The file.
        path: PathBuf,
        /// What the system said.
        cause: io::Error,
    },
    /// A network address.
    #[error("cannot open {what} at {address}: {cause}")]
    Network {
        /// What was to be there.
        what: &'static str,
        /// Where.
        address: String,
        /// What the system said.
        cause: io::Error,
    },
    /// No CAN interface.
    #[error(
        "no CAN carrier on `{interface}`: {cause}; bring it up (`ip link set {interface} up type can bitrate 250000`, or \
         `ip link add dev {interface} type vcan`), or use a bus without it: --can udp:239.74.163.2:43113 or --can slcan:./can"
    )]
    Carrier {
        /// The interface.
        interface: String,
        /// What the system said.
        cause: String,
    },
}

/// A UDP socket at `place`, and where that is.
async fn listen_udp(what: &'static str, place: &str) -> Result<(UdpSocket, SocketAddr), BusError> {
    let failed = |cause| BusError::Network { what, address: place.to_owned(), cause };
    let socket = UdpSocket::bind(place).await.map_err(failed)?;
    let address = socket.local_addr().map_err(failed)?;
    Ok((socket, address))
}

/// Where a link hands what it hears.
#[derive(Clone, Debug)]
pub struct PortListener {
    origin: Origin,
    heard: mpsc::Sender<(Origin, PortEvent)>,
}

impl PortListener {
    pub(super) fn new(port: usize, heard: mpsc::Sender<(Origin, PortEvent)>) -> Self {
        Self { origin: Origin { port, client: 0 }, heard }
    }

    /// The same for one of the port's clients.
    fn of_client(&self, client: u64) -> Self {
        Self { origin: Origin { client, ..self.origin }, heard: self.heard.clone() }
    }

    async fn hear(&self, heard: PortEvent) {
        // Nobody listening any more means that the bus is closing.
        let _ = self.heard.send((self.origin, heard)).await;
    }
}

/// An open port.
#[derive(Debug)]
pub enum Link {
    /// A Lawicel adapter on a pseudo-terminal.
    Slcan(Box<pty::PtyLink<slcan::Adapter>>),
    /// A CAN interface.
    Socketcan(socketcan::SocketcanLink),
    /// A socketcand server.
    Socketcand(tcp::TcpLink<socketcand::Conversation>),
    /// The bus of a socketcand server elsewhere.
    SocketcandClient(Box<socketcand_client::SocketcandClientLink>),
    /// Lines of text on a pseudo-terminal.
    Lines(Box<pty::PtyLink<lines::Lines>>),
    /// Lines of text over TCP.
    LinesTcp(tcp::TcpLink<lines::Lines>),
    /// A machine module of AgOpenGPS.
    Agopengps(agopengps::AgopengpsLink),
    /// A CAN bridge by UDP, there or here.
    Bridge(bridge::BridgeLink, &'static str),
    /// UDP multicast.
    Udp(udp::UdpLink),
    /// A log file.
    Candump(candump::CandumpLink),
}

/// Where an open port is found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Found {
    /// At a network address.
    Address(SocketAddr),
    /// Under a path.
    Path(PathBuf),
    /// By its name.
    Name(String),
}

impl fmt::Display for Found {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Address(address) => address.fmt(f),
            Self::Path(path) => path.display().fmt(f),
            Self::Name(name) => name.fmt(f),
        }
    }
}

impl Link {
    /// Opens a port.
    pub(super) async fn open(address: &BusAddress) -> Result<Self, BusError> {
        Ok(match address {
            BusAddress::Slcan(link) => Self::Slcan(Box::new(pty::PtyLink::open(link)?)),
            BusAddress::Socketcan(interface) => Self::Socketcan(socketcan::SocketcanLink::open(interface)?),
            BusAddress::Socketcand(place) => Self::Socketcand(tcp::TcpLink::open(place).await?),
            BusAddress::SocketcandClient { server, bus } => Self::SocketcandClient(Box::new(
                socketcand_client::SocketcandClientLink::open(server, bus).await?,
            )),
            BusAddress::Lines(link) => Self::Lines(Box::new(pty::PtyLink::open(link)?)),
            BusAddress::LinesTcp(place) => Self::LinesTcp(tcp::TcpLink::open(place).await?),
            BusAddress::Agopengps(place) => Self::Agopengps(agopengps::AgopengpsLink::open(place).await?),
            BusAddress::Bridge(place) => Self::Bridge(bridge::BridgeLink::to(place).await?, "udp-aog"),
            BusAddress::BridgeListen(place) => {
                Self::Bridge(bridge::BridgeLink::at(place).await?, "udp-aog-listen")
            }
            BusAddress::Udp(group) => Self::Udp(udp::UdpLink::open(*group)?),
            BusAddress::Candump(path) => Self::Candump(candump::CandumpLink::open(path)?),
        })
    }

    /// Carries frames until the bus closes.
    pub(super) async fn run(self, queue: mpsc::Receiver<OutgoingFrame>, ear: PortListener) {
        match self {
            Self::Slcan(link) => link.run(queue, ear).await,
            Self::Socketcan(link) => link.run(queue, ear).await,
            Self::Socketcand(link) => link.run(queue, ear).await,
            Self::SocketcandClient(link) => link.run(queue, ear).await,
            Self::Lines(link) => link.run(queue, ear).await,
            Self::LinesTcp(link) => link.run(queue, ear).await,
            Self::Agopengps(link) => link.run(queue, ear).await,
            Self::Bridge(link, _) => link.run(queue, ear).await,
            Self::Udp(link) => link.run(queue, ear).await,
            Self::Candump(link) => link.run(queue).await,
        }
    }

    /// Whether frames can be heard there without anyone opening it first.
    pub fn is_open_from_the_start(&self) -> bool {
        matches!(
            self,
            Self::Socketcan(_)
                | Self::SocketcandClient(_)
                | Self::Lines(_)
                | Self::Agopengps(_)
                | Self::Bridge(..)
                | Self::Udp(_)
                | Self::Candump(_)
        )
    }

    /// What its client has not read yet, where that can be told.
    pub(super) fn untaken(&self) -> Result<Option<Untaken>, BusError> {
        match self {
            Self::Slcan(link) => Ok(Some(link.untaken()?)),
            Self::Lines(link) => Ok(Some(link.untaken()?)),
            Self::Socketcan(_)
            | Self::Socketcand(_)
            | Self::SocketcandClient(_)
            | Self::LinesTcp(_)
            | Self::Agopengps(_)
            | Self::Bridge(..)
            | Self::Udp(_)
            | Self::Candump(_) => Ok(None),
        }
    }

    /// Its kind, as the command line names it.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Slcan(_) => "slcan",
            Self::Socketcan(_) => "socketcan",
            Self::Socketcand(_) => "socketcand",
            Self::SocketcandClient(_) => "socketcand-client",
            Self::Lines(_) => "lines",
            Self::LinesTcp(_) => "lines-tcp",
            Self::Agopengps(_) => "agopengps",
            Self::Bridge(_, kind) => kind,
            Self::Udp(_) => "udp",
            Self::Candump(_) => "candump",
        }
    }

    /// Where it is found.
    pub fn found(&self) -> Found {
        match self {
            Self::Slcan(link) => Found::Path(link.path().to_owned()),
            Self::Socketcan(link) => Found::Name(link.interface().to_owned()),
            Self::Socketcand(link) => Found::Address(link.address()),
            Self::SocketcandClient(link) => Found::Address(link.address()),
            Self::Lines(link) => Found::Path(link.path().to_owned()),
            Self::LinesTcp(link) => Found::Address(link.address()),
            Self::Agopengps(link) => Found::Address(link.address()),
            Self::Bridge(link, _) => Found::Address(link.address()),
            Self::Udp(link) => Found::Address(link.group()),
            Self::Candump(link) => Found::Path(link.path().to_owned()),
        }
    }
}
