//! CAN frames and their text in candump's logs: `18FEF100#0102030405060708`, `123#R8`.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

/// A classic CAN frame, up to eight bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CanFrame {
    /// Its identifier, which is its priority too.
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
        if !matches!(id.len(), 3 | 8) || !is_hex(id) {
            return None;
        }
        let id = CanId::new(u32::from_str_radix(id, 16).ok()?, id.len() == 8)?;
        match data.strip_prefix('R') {
            Some("") => Self::remote(id, 0),
            Some(len) => Self::remote(id, len.parse().ok()?),
            None => Self::new(id, &hex(data)?),
        }
    }
}

/// Bytes of hexadecimal digits, at most eight.
pub fn hex(text: &str) -> Option<Vec<u8>> {
    if text.len() % 2 == 1 || text.len() > 16 || !is_hex(text) {
        return None;
    }
    (0..text.len()).step_by(2).map(|at| u8::from_str_radix(text.get(at..at + 2)?, 16).ok()).collect()
}

fn is_hex(text: &str) -> bool {
    text.bytes().all(|byte| byte.is_ascii_hexdigit())
}

/// A line of a candump log: `(1700000000.000001) can0 18FEF100#0102030405060708`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CandumpLine<'a> {
    /// Its stamp.
    pub at_ns: u64,
    /// The interface's name.
    pub interface: &'a str,
    /// The frame's text, classic or not.
    pub frame: &'a str,
}

impl<'a> CandumpLine<'a> {
    /// Reads a line; python-can's ` R` and ` T` behind the frame are left off.
    pub fn parse(line: &'a str) -> Option<Self> {
        let mut words = line.split_whitespace();
        let (seconds, fraction) = words.next()?.strip_prefix('(')?.strip_suffix(')')?.split_once('.')?;
        let (interface, frame) = (words.next()?, words.next()?);
        let (id, _) = frame.split_once('#')?;
        let ends = matches!(words.next(), None | Some("R" | "T"));
        if id.is_empty() || !is_hex(id) || !ends || fraction.len() > 9 {
            return None;
        }
        let nanoseconds = fraction.parse::<u64>().ok()? * 10_u64.pow(9 - fraction.len() as u32);
        let at_ns = seconds.parse::<u64>().ok()?.checked_mul(1_000_000_000)?.checked_add(nanoseconds)?;
        Some(Self { at_ns, interface, frame })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_read_and_others_are_none() {
        let extended = CanId::new(0x18FE_F100, true).expect("29 bits");
        assert_eq!(CanFrame::from_text("18FEF100#01FF"), CanFrame::new(extended, &[1, 255]));
        assert_eq!(CanFrame::from_text("123#R8"), CanFrame::remote(CanId::Standard(0x123), 8));
        assert_eq!(CanFrame::from_text("123#R"), CanFrame::remote(CanId::Standard(0x123), 0));
        for text in [
            "",
            "123",
            "123##1",
            "1#2",
            "123#1",
            "XYZ#",
            "+23#",
            "123#001122334455667788",
            "123#R9",
            "800#",
            "20000000#",
        ] {
            assert_eq!(CanFrame::from_text(text), None, "{text}");
        }
    }

    #[test]
    fn a_line_is_a_time_an_interface_and_a_frame() {
        let expected =
            CandumpLine { at_ns: 1_700_000_000_000_250_000, interface: "can0", frame: "18FEF100#0102" };
        for line in ["(1700000000.000250) can0 18FEF100#0102", "(1700000000.00025) can0 18FEF100#0102 R"] {
            assert_eq!(CandumpLine::parse(line), Some(expected), "{line}");
        }
        for nonsense in
            ["", "can0 1#2", "(1) can0 1#2", "(1.0) can0 12", "(1.0) can0 xyz#1", "(1.0) can0 1#2 Q"]
        {
            assert_eq!(CandumpLine::parse(nonsense), None, "{nonsense}");
        }
    }

    #[test]
    fn a_frame_holds_eight_bytes_and_counts_its_bits() {
        let id = CanId::new(0x18FF_1080, true).expect("29 bits");
        assert_eq!(CanFrame::new(id, &[0; 9]), None);
        assert_eq!(CanFrame::new(id, &[1, 2]).expect("29 bits").data(), [1, 2]);
        // The known worst case of an extended frame with eight bytes.
        assert_eq!(CanFrame::new(id, &[0; 8]).expect("29 bits").bits_at_most(), 160);
        assert_eq!(CanId::new(0x800, false), None);
        assert!(CanFrame::remote(id, 8).expect("29 bits").data().is_empty());
    }
}
