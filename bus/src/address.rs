//! How a port of the bus is named on the command line.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::str::FromStr;

/// A port of the bus.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BusAddress {
    /// `slcan:LINK`: a Lawicel adapter on a pseudo-terminal of this name.
    Slcan(PathBuf),
    /// `socketcan:can0`: a CAN interface of the system.
    Socketcan(String),
    /// `socketcand:HOST:PORT`: a socketcand server.
    Socketcand(String),
    /// `socketcand-client:HOST:PORT/BUS`: the bus of a socketcand server elsewhere.
    SocketcandClient {
        /// Host and port.
        server: String,
        /// The bus's name there.
        bus: String,
    },
    /// `lines:LINK`: lines of text on a pseudo-terminal of this name.
    Lines(PathBuf),
    /// `lines-tcp:HOST:PORT`: a server of lines of text.
    LinesTcp(String),
    /// `agopengps:HOST:PORT`: a machine module of AgOpenGPS, by UDP.
    Agopengps(String),
    /// `udp-aog:HOST:PORT`: a CAN bridge as AgOpenGPS's task controller has it, which listens there.
    Bridge(String),
    /// `udp-aog-listen:HOST:PORT`: such a bridge, which listens here.
    BridgeListen(String),
    /// `udp:GROUP:PORT`: python-can's `udp_multicast`.
    Udp(SocketAddr),
    /// `candump:FILE`: a log as candump -L writes it.
    Candump(PathBuf),
}

/// A name that is no port.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "expected slcan:LINK, socketcan:INTERFACE, socketcand:HOST:PORT (a server), socketcand-client:HOST:PORT/BUS, lines:LINK, lines-tcp:HOST:PORT, \
     agopengps:HOST:PORT, \
     udp-aog:HOST:PORT, udp-aog-listen:HOST:PORT, udp:GROUP:PORT (a multicast group such as 239.74.163.2:43113) or candump:FILE, found `{0}`"
)]
pub struct BusAddressError(String);

impl FromStr for BusAddress {
    type Err = BusAddressError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let wrong = || BusAddressError(text.to_owned());
        let (kind, place) = text.split_once(':').filter(|(_, place)| !place.is_empty()).ok_or_else(wrong)?;
        match kind {
            "slcan" => Ok(Self::Slcan(place.into())),
            "socketcan" => Ok(Self::Socketcan(place.to_owned())),
            "socketcand" if place.contains(':') => Ok(Self::Socketcand(place.to_owned())),
            "socketcand-client" => {
                let (server, bus) = place.split_once('/').unwrap_or((place, "can0"));
                let is_name =
                    !bus.is_empty() && bus.bytes().all(|b| b.is_ascii_alphanumeric() || b"-_.".contains(&b));
                if !server.contains(':') || !is_name {
                    return Err(wrong());
                }
                Ok(Self::SocketcandClient { server: server.to_owned(), bus: bus.to_owned() })
            }
            "lines" => Ok(Self::Lines(place.into())),
            "lines-tcp" if place.contains(':') => Ok(Self::LinesTcp(place.to_owned())),
            "agopengps" if place.contains(':') => Ok(Self::Agopengps(place.to_owned())),
            "udp-aog" if place.contains(':') => Ok(Self::Bridge(place.to_owned())),
            "udp-aog-listen" if place.contains(':') => Ok(Self::BridgeListen(place.to_owned())),
            "udp" => place
                .parse()
                .ok()
                .filter(|group: &SocketAddr| group.ip().is_multicast())
                .map(Self::Udp)
                .ok_or_else(wrong),
            "candump" => Ok(Self::Candump(place.into())),
            _ => Err(wrong()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_say_what_they_are() {
        assert_eq!("slcan:/tmp/can".parse(), Ok(BusAddress::Slcan("/tmp/can".into())));
        assert_eq!("socketcand:127.0.0.1:0".parse(), Ok(BusAddress::Socketcand("127.0.0.1:0".into())));
        assert_eq!("lines:/tmp/boom".parse(), Ok(BusAddress::Lines("/tmp/boom".into())));
        assert_eq!("lines-tcp:127.0.0.1:0".parse(), Ok(BusAddress::LinesTcp("127.0.0.1:0".into())));
        let client =
            |server: &str, bus: &str| BusAddress::SocketcandClient { server: server.into(), bus: bus.into() };
        assert_eq!("socketcand-client:gate:29536/can1".parse(), Ok(client("gate:29536", "can1")));
        assert_eq!("socketcand-client:gate:29536".parse(), Ok(client("gate:29536", "can0")));
        assert!("socketcand-client:gate:1/a b".parse::<BusAddress>().is_err());
        assert_eq!("agopengps:127.0.0.1:8888".parse(), Ok(BusAddress::Agopengps("127.0.0.1:8888".into())));
        assert!("agopengps:8888".parse::<BusAddress>().is_err());
        assert_eq!("udp-aog:127.0.0.1:2234".parse(), Ok(BusAddress::Bridge("127.0.0.1:2234".into())));
        assert_eq!("udp-aog-listen:[::1]:0".parse(), Ok(BusAddress::BridgeListen("[::1]:0".into())));
        assert!(matches!("udp:239.74.163.2:43113".parse(), Ok(BusAddress::Udp(_))));
        for wrong in [
            "can0",
            "slcan:",
            "udp:127.0.0.1:5",
            "udp:239.1.1.1",
            "socketcand:7",
            "lines:",
            "lines-tcp:7",
            "",
        ] {
            let message = wrong.parse::<BusAddress>().unwrap_err().to_string();
            assert!(message.contains(&format!("found `{wrong}`")), "{message}");
        }
    }
}
