//! What whoever runs a node wants to know of its bus: each change once.

use std::collections::BTreeSet;

use super::node::AddressState;
use super::port_event::{BusLoss, PortEvent, Refused};

/// A change.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BusNews {
    /// A better NAME has the address.
    #[error("another control function keeps address {0}; nothing is sent on the bus any more")]
    AddressLost(u8),
    /// A port is off.
    #[error(transparent)]
    Off(#[from] BusLoss),
    /// A port that was off is on the bus again.
    #[error("the CAN bus is back")]
    Back,
    /// The first that a client of a port sent and that was refused.
    #[error(
        "a client of the bus sent {0}; nothing came of it, and what else is refused on this port is not told"
    )]
    Refused(Refused),
}

/// Knows what has been told.
#[derive(Clone, Debug, Default)]
pub struct BusWatch {
    address_lost: bool,
    off: BTreeSet<usize>,
    /// Ports of which a refusal was told.
    refused: BTreeSet<usize>,
}

impl BusWatch {
    /// What is new when `port` tells this, and the node then stands so.
    pub fn news(&mut self, port: usize, heard: PortEvent, address: AddressState) -> Option<BusNews> {
        match (heard, address) {
            (PortEvent::Lost(loss), _) => self.off.insert(port).then_some(BusNews::Off(loss)),
            (PortEvent::Refused(refused), _) => {
                self.refused.insert(port).then_some(BusNews::Refused(refused))
            }
            (PortEvent::Opened, _) if self.off.remove(&port) => Some(BusNews::Back),
            (_, AddressState::Lost(address)) if !self.address_lost => {
                self.address_lost = true;
                Some(BusNews::AddressLost(address))
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_change_is_told_once() {
        let mut watch = BusWatch::default();
        let claimed = AddressState::Claimed(0xF0);
        assert_eq!(watch.news(0, PortEvent::Opened, claimed), None, "it was never off");
        let off = PortEvent::Lost(BusLoss::BusOff);
        assert_eq!(watch.news(0, off, claimed), Some(BusNews::Off(BusLoss::BusOff)));
        assert_eq!(watch.news(0, off, claimed), None);
        assert_eq!(watch.news(1, PortEvent::Opened, claimed), None, "another port");
        assert_eq!(watch.news(0, PortEvent::Opened, claimed), Some(BusNews::Back));
        let lost = AddressState::Lost(0xF0);
        assert_eq!(watch.news(0, PortEvent::Opened, lost), Some(BusNews::AddressLost(0xF0)));
        assert_eq!(watch.news(0, PortEvent::Opened, lost), None);
        let refused = |text: &str| PortEvent::Refused(Refused::of(text.as_bytes(), "no frame"));
        let first = watch.news(0, refused("send 18FF1427 8 FA"), lost);
        assert!(
            first.is_some_and(|news| news.to_string().contains("`send 18FF1427 8 FA`: no frame")),
            "{first:?}"
        );
        assert_eq!(watch.news(0, refused("send 1"), lost), None);
        assert!(watch.news(1, refused("send 1"), lost).is_some(), "another port");
    }
}
