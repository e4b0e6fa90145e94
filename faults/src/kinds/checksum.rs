//! A wrong checksum.

use rowscan_protocol::random::Stream;

use crate::event::Direction;
use crate::fault::{Action, Fault, Layer, Make, OnTelegram, Skipped, Work};
use rowscan_settings::fault_table::{Form, Parameter};

pub(super) const FAULT: Fault = Fault {
    name: "checksum",
    layer: Layer::Telegram,
    parameters: &[Parameter {
        key: "value",
        form: Form::Whole(0, 65_535),
        default: "all its bits inverted",
        about: "written in its place; of CoLa B the low byte",
    }],
    directions: &[Direction::ToClient],
    on_wires: true,
    about: "A telegram's checksum is wrong. CoLa A has none: skipped there.",
    reports: "telegrams_bad 1",
    recovery: "next telegram",
    make: Make::Bytes(|given| Ok(Action::Telegram(Box::new(Checksum { value: given.whole("value")? })))),
};

#[derive(Debug)]
struct Checksum {
    value: Option<i64>,
}

impl OnTelegram for Checksum {
    fn act(&self, work: &mut Work, _: &mut Stream) -> Result<(), Skipped> {
        let Some(range) = work.regions.checksum.clone() else {
            return Err(Skipped(format!("{} has no checksum", work.regions.kind.title())));
        };
        // The LMS2xx writes its checksum low byte first.
        let written = self.value.map(i64::to_le_bytes);
        for (n, byte) in work.bytes.iter_mut().skip(range.start).take(range.len()).enumerate() {
            *byte = written.and_then(|bytes| bytes.get(n).copied()).unwrap_or(!*byte);
        }
        Ok(())
    }
}
