//! The telegrams in a stream of bytes, field by field, with units:
//! `cargo run -p rowscan-protocol --example parse_telegram -- 02 73 52 41 20 4F 44 6F 70 72 68 20 33 46 34 03`

#![allow(clippy::print_stdout, reason = "an example prints")]

use std::error::Error;
use std::fmt::Write;

use rowscan_protocol::device::command;
use rowscan_protocol::frame::{Accept, FrameDecoder};
use rowscan_protocol::telegram::Telegram;
use rowscan_protocol::visit::{Group, Value, Visitor};

fn main() -> Result<(), Box<dyn Error>> {
    let hex = std::env::args().skip(1);
    let bytes: Vec<u8> = hex.map(|byte| u8::from_str_radix(&byte, 16)).collect::<Result<_, _>>()?;
    for line in describe(&bytes)? {
        println!("{line}");
    }
    Ok(())
}

/// A line a telegram. CoLa A and CoLa B may be mixed; what is no telegram is skipped.
pub(crate) fn describe(bytes: &[u8]) -> Result<Vec<String>, Box<dyn Error>> {
    let mut decoder = FrameDecoder::new(Accept::Either, 64 * 1024);
    decoder.push(bytes);
    let mut lines = Vec::new();
    while let Some(frame) = decoder.next_frame() {
        let telegram = Telegram::parse(frame.dialect, frame.payload)?;
        let mut line = Line(format!("{}: {} {}", frame.dialect, telegram.kind.letters(), telegram.name));
        match command::visit(&telegram, &mut line) {
            Some(read) => read?,
            None => line.0 += " (not known)",
        }
        lines.push(line.0);
    }
    Ok(lines)
}

/// Writes fields one behind the other.
struct Line(String);

impl Visitor for Line {
    fn value(&mut self, value: Value<'_>) {
        let _ = match value {
            Value::Absent => write!(self.0, " -"),
            Value::Flag(on) => write!(self.0, " {on}"),
            Value::Integer(number) => write!(self.0, " {number}"),
            Value::Real(number) => write!(self.0, " {number}"),
            Value::Text(text) => write!(self.0, " {text:?}"),
            Value::Opaque(bytes) => write!(self.0, " {bytes:02X?}"),
            _ => Ok(()),
        };
    }

    fn begin(&mut self, _: Group) {}

    fn field(&mut self, name: &'static str, unit: Option<&'static str>) {
        let _ = match unit {
            Some(unit) => write!(self.0, "  {name} [{unit}]"),
            None => write!(self.0, "  {name}"),
        };
    }

    fn end(&mut self) {}
}
