//! Telegrams lost.

use rowscan_protocol::random::Stream;

use crate::event::Direction;
use crate::fault::{Action, Fault, Layer, Make, OnTelegram, Skipped, Work, below};
use rowscan_settings::fault_table::{Form, Parameter};

pub(super) const FAULT: Fault = Fault {
    name: "drop",
    layer: Layer::Telegram,
    parameters: &[
        Parameter {
            key: "telegrams",
            form: Form::Whole(1, 1_000_000),
            default: "1",
            about: "so many in a row",
        },
        Parameter {
            key: "bytes",
            form: Form::Whole(1, 1_000_000),
            default: "the whole telegram",
            about: "only so many bytes out of the telegram",
        },
        Parameter {
            key: "offset",
            form: Form::Whole(0, 1_000_000),
            default: "random",
            about: "of the first of `bytes`",
        },
    ],
    directions: &[Direction::ToClient],
    on_wires: true,
    about: "Telegrams, or bytes out of one, are lost. Counters stay as the device wrote them.",
    reports: "scans_lost; with `bytes` telegrams_bad; in CoLa A, which has no checksum, possibly a wrong value",
    recovery: "next good telegram",
    make: Make::Bytes(|given| {
        let (telegrams, bytes) = (given.whole("telegrams")?, given.size("bytes")?);
        if telegrams.is_some() && bytes.is_some() {
            return Err(given.refuse("`telegrams` and `bytes` are two faults; leave one out"));
        }
        let further = given.count("telegrams", 1)?.saturating_sub(1);
        Ok(Action::Telegram(Box::new(Drop { further, bytes, offset: given.size("offset")? })))
    }),
};

#[derive(Debug)]
struct Drop {
    further: u32,
    bytes: Option<usize>,
    offset: Option<usize>,
}

impl OnTelegram for Drop {
    fn act(&self, work: &mut Work, dice: &mut Stream) -> Result<(), Skipped> {
        let Some(bytes) = self.bytes else {
            work.drop = Some(self.further);
            return Ok(());
        };
        let len = work.bytes.len();
        let offset = self.offset.unwrap_or_else(|| below(dice, len.saturating_sub(bytes) + 1));
        if offset >= len {
            return Err(Skipped(format!("offset {offset} is beyond the telegram's {len} bytes")));
        }
        work.bytes.drain(offset..offset.saturating_add(bytes).min(len));
        Ok(())
    }
}
