//! candump logs: `(1700000000.000001) can0 18FEF100#0102030405060708`, one frame a line.

use super::ReadError;
use crate::{Joint, Packet, Side};

/// The log's frames as packets of text (`ID#DATA`), a stream an interface; with the interfaces' names.
pub(super) fn packets(text: &str) -> Result<(Vec<Packet>, Vec<String>), ReadError> {
    let mut packets = Vec::new();
    let mut interfaces: Vec<String> = Vec::new();
    for (number, line) in (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty()) {
        let Some(Frame { at_ns, interface, data }) = frame(line) else {
            return Err(ReadError::NotCandump { line: number, found: line.chars().take(40).collect() });
        };
        let known = interfaces.iter().position(|known| known == interface);
        let stream = known.unwrap_or_else(|| {
            interfaces.push(interface.to_owned());
            interfaces.len() - 1
        });
        packets.push(Packet {
            stream,
            from: Some(Side::Device),
            at_ns: Some(at_ns),
            joint: Joint::Anew,
            bytes: data.as_bytes().to_vec(),
        });
    }
    Ok((packets, interfaces))
}

/// One line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Frame<'a> {
    at_ns: u64,
    interface: &'a str,
    /// `ID#DATA`.
    data: &'a str,
}

/// The frame of a line; python-can's ` R` and ` T` behind it are left off.
pub(super) fn frame(line: &str) -> Option<Frame<'_>> {
    let mut words = line.split_whitespace();
    let (seconds, fraction) = words.next()?.strip_prefix('(')?.strip_suffix(')')?.split_once('.')?;
    let (interface, data) = (words.next()?, words.next()?);
    let (id, _) = data.split_once('#')?;
    let is_hex = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_hexdigit());
    if !is_hex(id) || !matches!(words.next(), None | Some("R" | "T")) || fraction.len() > 9 {
        return None;
    }
    let nanoseconds = fraction.parse::<u64>().ok()? * 10_u64.pow(9 - fraction.len() as u32);
    let at_ns = seconds.parse::<u64>().ok()?.checked_mul(1_000_000_000)?.checked_add(nanoseconds)?;
    Some(Frame { at_ns, interface, data })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_a_time_an_interface_and_a_frame() {
        let expected = Frame { at_ns: 1_700_000_000_000_250_000, interface: "can0", data: "18FEF100#0102" };
        for line in ["(1700000000.000250) can0 18FEF100#0102", "(1700000000.00025) can0 18FEF100#0102 R"] {
            assert_eq!(frame(line), Some(expected), "{line}");
        }
        for nonsense in
            ["", "can0 1#2", "(1) can0 1#2", "(1.0) can0 12", "(1.0) can0 xyz#1", "(1.0) can0 1#2 Q"]
        {
            assert_eq!(frame(nonsense), None, "{nonsense}");
        }
    }
}
