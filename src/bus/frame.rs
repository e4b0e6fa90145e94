//! The one CAN frame type, and what J1939 makes of its identifier.

/// A classic CAN frame, up to eight bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CanFrame {
    /// Who it is for, by priority.
    pub id: CanId,
    /// A remote frame asks for data and has none; its length still counts.
    pub remote: bool,
    len: u8,
    bytes: [u8; 8],
}

/// An identifier: 11 bits, or 29.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CanId {
    /// 0..=0x7FF.
    Standard(u16),
    /// 0..=0x1FFF_FFFF.
    Extended(u32),
}

impl CanId {
    /// The identifier of these bits; `None` if they are too many.
    pub fn new(bits: u32, extended: bool) -> Option<Self> {
        match extended {
            true => (bits < 1 << 29).then_some(Self::Extended(bits)),
            false => u16::try_from(bits).ok().filter(|id| *id < 1 << 11).map(Self::Standard),
        }
    }

    /// Its bits.
    pub fn bits(self) -> u32 {
        match self {
            Self::Standard(id) => id.into(),
            Self::Extended(id) => id,
        }
    }

    /// 29 bits.
    pub fn is_extended(self) -> bool {
        matches!(self, Self::Extended(_))
    }
}

impl CanFrame {
    /// A data frame; `None` with more than eight bytes.
    pub fn new(id: CanId, data: &[u8]) -> Option<Self> {
        let mut bytes = [0; 8];
        bytes.get_mut(..data.len())?.copy_from_slice(data);
        Some(Self { id, remote: false, len: data.len() as u8, bytes })
    }

    /// A remote frame that asks for so many bytes.
    pub fn remote(id: CanId, len: u8) -> Option<Self> {
        (len <= 8).then_some(Self { id, remote: true, len, bytes: [0; 8] })
    }

    /// Its data; none in a remote frame.
    pub fn data(&self) -> &[u8] {
        let len = if self.remote { 0 } else { usize::from(self.len) };
        self.bytes.get(..len).unwrap_or_default()
    }

    /// Its data length code.
    pub fn len(&self) -> u8 {
        self.len
    }

    /// Whether its length code is 0.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Bits it takes on the wire with the most stuff bits it can have, interframe space included: what bus load is counted by.
    pub fn bits_at_most(&self) -> u32 {
        // Start, identifier, control, data, checksum are stuffed: at most one bit after every four following the first.
        let data = 8 * self.data().len() as u32;
        let (stuffed, fixed) = if self.id.is_extended() { (54 + data, 13) } else { (34 + data, 13) };
        stuffed + (stuffed - 1) / 4 + fixed
    }
}

impl CanFrame {
    /// As candump writes it: `18FE4980#0011FF`, `123#R8`; eight digits say that the identifier has 29 bits.
    pub fn to_text(&self) -> String {
        let mut text = match self.id {
            CanId::Standard(id) => format!("{id:03X}#"),
            CanId::Extended(id) => format!("{id:08X}#"),
        };
        if self.remote {
            text += &format!("R{}", self.len);
        }
        self.data().iter().for_each(|byte| text += &format!("{byte:02X}"));
        text
    }

    /// Reads what [`CanFrame::to_text`] writes; `None` for anything else, CAN FD among it.
    pub fn from_text(text: &str) -> Option<Self> {
        let (id, data) = text.split_once('#')?;
        let id = CanId::new(u32::from_str_radix(id, 16).ok()?, id.len() > 3)?;
        if let Some(len) = data.strip_prefix('R') {
            let len = if len.is_empty() { 0 } else { len.parse().ok()? };
            return Self::remote(id, len);
        }
        Self::new(id, &hex(data)?)
    }
}

/// Bytes of hexadecimal digits, at most eight.
pub(super) fn hex(text: &str) -> Option<Vec<u8>> {
    if text.len() % 2 == 1 || text.len() > 16 || !text.is_ascii() {
        return None;
    }
    (0..text.len()).step_by(2).map(|at| u8::from_str_radix(text.get(at..at + 2)?, 16).ok()).collect()
}

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

    #[test]
    fn a_frame_holds_eight_bytes_and_counts_its_bits() {
        let id = CanId::new(0x18FF_1080, true).unwrap();
        assert_eq!(CanFrame::new(id, &[0; 9]), None);
        assert_eq!(CanFrame::new(id, &[1, 2]).unwrap().data(), [1, 2]);
        // The known worst case of an extended frame with eight bytes.
        assert_eq!(CanFrame::new(id, &[0; 8]).unwrap().bits_at_most(), 160);
        assert_eq!(CanId::new(0x800, false), None);
        assert!(CanFrame::remote(id, 8).unwrap().data().is_empty());
    }
}
