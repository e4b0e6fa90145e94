//! candump logs: `(1700000000.000001) can0 18FEF100#0102030405060708`, one frame a line.

use rowscan_protocol::can::CandumpLine;

use super::ReadError;
use crate::{Joint, Packet, Side};

/// The log's frames as packets of text (`ID#DATA`), a stream an interface; with the interfaces' names.
pub(super) fn packets(text: &str) -> Result<(Vec<Packet>, Vec<String>), ReadError> {
    let mut packets = Vec::new();
    let mut interfaces: Vec<String> = Vec::new();
    for (number, line) in (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty()) {
        let Some(CandumpLine { at_ns, interface, frame }) = CandumpLine::parse(line) else {
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
            bytes: frame.as_bytes().to_vec(),
        });
    }
    Ok((packets, interfaces))
}
