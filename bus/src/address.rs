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
    /// `udp:GROUP:PORT`: python-can's `udp_multicast`.
    Udp(SocketAddr),
    /// `candump:FILE`: a log as candump -L writes it.
    Candump(PathBuf),
}

/// A name that is no port.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "expected slcan:LINK, socketcan:INTERFACE, socketcand:HOST:PORT, udp:GROUP:PORT (a multicast group such as 239.74.163.2:43113) or \
     candump:FILE, found `{0}`"
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
        assert!(matches!("udp:239.74.163.2:43113".parse(), Ok(BusAddress::Udp(_))));
        for wrong in ["can0", "slcan:", "udp:127.0.0.1:5", "udp:239.1.1.1", "socketcand:7", ""] {
            let message = wrong.parse::<BusAddress>().unwrap_err().to_string();
            assert!(message.contains(&format!("found `{wrong}`")), "{message}");
        }
    }
}
