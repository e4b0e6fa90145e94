//! What J1939 makes of a CAN frame's identifier.

pub use rowscan_protocol::can::{CanFrame, CanId};

/// The nobody in particular of J1939 destinations.
pub const EVERYONE: u8 = 0xFF;
/// The address of who has none.
pub const NO_ADDRESS: u8 = 0xFE;

/// A 29-bit identifier as J1939 reads it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct J1939Id {
    /// 0 most urgent … 7.
    pub priority: u8,
    /// Parameter group, 18 bits; its low byte is 0 where the identifier carries a destination.
    pub pgn: u32,
    /// Address of the sender.
    pub source: u8,
    /// Address of the receiver; [`EVERYONE`] where the group is always broadcast.
    pub destination: u8,
}

impl J1939Id {
    /// Reads an identifier; `None` for 11 bits.
    pub fn of(id: CanId) -> Option<Self> {
        let CanId::Extended(bits) = id else { return None };
        let [high, format, specific, source] = bits.to_be_bytes();
        let page = u32::from(high & 0x03) << 16 | u32::from(format) << 8;
        let (pgn, destination) =
            if format < 240 { (page, specific) } else { (page | u32::from(specific), EVERYONE) };
        Some(Self { priority: high >> 2 & 0x07, pgn, source, destination })
    }

    /// The identifier.
    pub fn id(self) -> CanId {
        let pgn = self.pgn & 0x3_FFFF;
        let addressed = pgn >> 8 & 0xFF < 240;
        let specific = if addressed { u32::from(self.destination) } else { pgn & 0xFF };
        let bits = u32::from(self.priority & 0x07) << 26 | (pgn & 0x3_FF00) << 8 | specific << 8;
        CanId::Extended(bits | u32::from(self.source))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn identifiers_are_read_as_agisostack_writes_them() {
        // Machine selected speed command from address 0x45, priority 3.
        let id = J1939Id { priority: 3, pgn: 0xFD43, source: 0x45, destination: EVERYONE };
        assert_eq!(id.id(), CanId::Extended(0x0CFD_4345));
        assert_eq!(J1939Id::of(CanId::Extended(0x0CFD_4345)), Some(id));
        // Request for address claimed, to everyone, from the null address.
        let id = J1939Id { priority: 6, pgn: 0xEA00, source: NO_ADDRESS, destination: EVERYONE };
        assert_eq!(id.id(), CanId::Extended(0x18EA_FFFE));
        assert_eq!(J1939Id::of(id.id()), Some(id));
        // NMEA 2000 lies in data page 1.
        let id = J1939Id { priority: 2, pgn: 129_025, source: 0x1C, destination: EVERYONE };
        assert_eq!(id.id(), CanId::Extended(0x09F8_011C));
        assert_eq!(J1939Id::of(id.id()), Some(id));
        assert_eq!(J1939Id::of(CanId::Standard(0x123)), None);
    }
}
