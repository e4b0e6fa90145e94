//! CAN frames as a candump line has them: `18FEF100#0102030405060708`, `123#R8`.

/// A classic frame, read from text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Frame<'a> {
    pub(crate) id: u32,
    /// Eight digits of identifier: 29 bits.
    pub(crate) extended: bool,
    /// It asks for data and has none.
    pub(crate) remote: bool,
    /// Pairs of hex digits.
    data: &'a str,
}

impl<'a> Frame<'a> {
    /// Reads a frame; none for CAN FD and other texts.
    pub(crate) fn parse(text: &'a str) -> Option<Self> {
        let (id, data) = text.split_once('#')?;
        let is_hex = |text: &str| text.bytes().all(|b| b.is_ascii_hexdigit());
        let remote = data.starts_with('R');
        let data = if remote { "" } else { data };
        let fits = matches!(id.len(), 3 | 8) && data.len() <= 16 && data.len().is_multiple_of(2);
        if !fits || !is_hex(id) || !is_hex(data) {
            return None;
        }
        Some(Self { id: u32::from_str_radix(id, 16).ok()?, extended: id.len() == 8, remote, data })
    }

    /// Its bytes.
    pub(crate) fn data(&self) -> impl Iterator<Item = u8> + use<'a> {
        let data = self.data;
        (0..data.len()).step_by(2).filter_map(move |at| u8::from_str_radix(data.get(at..at + 2)?, 16).ok())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_read_and_others_are_none() {
        let frame = Frame::parse("18FEF100#01FF").expect("a frame");
        assert_eq!((frame.id, frame.extended, frame.remote), (0x18FE_F100, true, false));
        assert_eq!(frame.data().collect::<Vec<_>>(), [1, 255]);
        let frame = Frame::parse("123#R8").expect("a frame");
        assert_eq!((frame.id, frame.extended, frame.remote, frame.data().count()), (0x123, false, true, 0));
        for text in ["", "123", "123##1", "1#2", "123#1", "XYZ#", "123#001122334455667788"] {
            assert_eq!(Frame::parse(text), None, "{text}");
        }
    }
}
