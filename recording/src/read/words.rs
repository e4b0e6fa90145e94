//! Telegrams as text without their frames, one a line, as terminals and manuals show them: `sRN DeviceIdent`, `<STX>sMN Run<ETX>`. Comments begin
//! with `;` or `#`.

use rowscan_protocol::frame::{Dialect, encode};
use rowscan_protocol::telegram::Telegram;

use super::ReadError;
use crate::{Joint, Packet, Side};

/// What people write for the frame's first and last byte.
const STX: &str = "<STX>";
const ETX: &str = "<ETX>";

/// Whether a line is such a telegram.
pub(super) fn is_telegram(line: &str) -> bool {
    sender(bare(line)).is_some()
}

/// The telegrams of a text, each in its frame again.
pub(super) fn packets(text: &str) -> Result<Vec<Packet>, ReadError> {
    let mut packets = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let line = bare(line);
        if line.is_empty() || line.starts_with([';', '#']) {
            continue;
        }
        let Some(from) = sender(line) else {
            return Err(ReadError::Line {
                line: number,
                expected: "a telegram in text such as `sRN DeviceIdent`, as in the lines before".to_owned(),
                found: line.chars().take(40).collect(),
            });
        };
        let mut bytes = Vec::new();
        encode(Dialect::A, line.as_bytes(), &mut bytes);
        packets.push(Packet { from: Some(from), joint: Joint::Anew, bytes, ..Packet::default() });
    }
    Ok(packets)
}

fn bare(line: &str) -> &str {
    let line = line.trim();
    let line = line.strip_prefix(STX).unwrap_or(line);
    line.strip_suffix(ETX).unwrap_or(line).trim_end()
}

/// Who sends such a telegram; none if it is none.
fn sender(line: &str) -> Option<Side> {
    // An error, `sFA`, has no name.
    let telegram = Telegram::parse(Dialect::A, line.as_bytes()).ok()?;
    line.is_ascii().then(|| Side::of(telegram.kind))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_line_is_a_frame_of_who_sends_such_a_telegram() {
        let text = "# a session\n<STX>sRN DeviceIdent<ETX>\nsRA DeviceIdent 6 LMS111 5 V1.30\n\nsFA 5\r\n";
        let packets = packets(text).expect("sound");
        let found: Vec<_> = packets.iter().map(|packet| (packet.from, packet.bytes.as_slice())).collect();
        assert_eq!(
            found,
            [
                (Some(Side::Host), &b"\x02sRN DeviceIdent\x03"[..]),
                (Some(Side::Device), b"\x02sRA DeviceIdent 6 LMS111 5 V1.30\x03"),
                (Some(Side::Device), b"\x02sFA 5\x03"),
            ]
        );
    }

    #[test]
    fn a_line_that_is_no_telegram_is_told() {
        let error = packets("sRN STlms\nhello there\n").expect_err("no telegram").to_string();
        assert!(
            error.starts_with("line 2: expected a telegram") && error.contains("`hello there`"),
            "{error}"
        );
    }
}
