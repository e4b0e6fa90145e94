//! Bytes nobody sent.

use rowscan_protocol::frame::{ETX, STX};
use rowscan_protocol::random::Stream;

use crate::event::Direction;
use crate::fault::{Action, Fault, Layer, Make, OnTelegram, Skipped, Work, below};
use rowscan_settings::fault_table::{Form, Parameter};

pub(super) const FAULT: Fault = Fault {
    name: "inject",
    layer: Layer::Telegram,
    parameters: &[
        Parameter {
            key: "kind",
            form: Form::Word(&["stx", "etx", "junk", "telegram"]),
            default: "junk",
            about: "what comes in: a start mark, an end mark, random bytes, a well-formed telegram nobody asked for",
        },
        Parameter {
            key: "bytes",
            form: Form::Whole(1, 1_000_000),
            default: "16; of marks 1",
            about: "so many of `junk`, `stx` or `etx`",
        },
        Parameter { key: "hex", form: Form::Hex, default: "–", about: "these bytes instead" },
        Parameter {
            key: "offset",
            form: Form::Whole(0, 1_000_000),
            default: "0: before it",
            about: "place in the telegram",
        },
    ],
    directions: &[Direction::ToClient],
    on_wires: true,
    about: "Bytes nobody sent come in before a telegram, or inside it.",
    reports: "telegrams_bad and skipped bytes, by what came",
    recovery: "next telegram",
    make: Make::Bytes(|given| {
        let (kind, hex) = (given.word("kind")?, given.hex("hex")?);
        if kind.is_some() && hex.is_some() {
            return Err(given.refuse("`kind` and `hex` are two ways to say one thing; leave one out"));
        }
        let (bytes, offset) = (given.size("bytes")?, given.size("offset")?.unwrap_or(0));
        Ok(Action::Telegram(Box::new(Inject { kind: kind.unwrap_or("junk"), bytes, hex, offset })))
    }),
};

#[derive(Debug)]
struct Inject {
    kind: &'static str,
    bytes: Option<usize>,
    hex: Option<Vec<u8>>,
    offset: usize,
}

impl OnTelegram for Inject {
    fn act(&self, work: &mut Work, dice: &mut Stream) -> Result<(), Skipped> {
        let len = work.bytes.len();
        if self.offset > len {
            return Err(Skipped(format!("offset {} is beyond the telegram's {len} bytes", self.offset)));
        }
        let injected = match (&self.hex, self.kind) {
            (Some(bytes), _) => bytes.clone(),
            (None, "stx") => vec![STX; self.bytes.unwrap_or(1)],
            (None, "etx") => vec![ETX; self.bytes.unwrap_or(1)],
            (None, "telegram") => work.foreign.clone(),
            (None, _) => (0..self.bytes.unwrap_or(16)).map(|_| below(dice, 256) as u8).collect(),
        };
        work.bytes.splice(self.offset..self.offset, injected);
        Ok(())
    }
}
