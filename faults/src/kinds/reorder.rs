//! A telegram behind the next.

use rowscan_protocol::random::Stream;

use crate::event::Direction;
use crate::fault::{Action, Fault, Layer, Make, OnTelegram, Skipped, Work};
use rowscan_settings::fault_table::{Form, Parameter};

pub(super) const FAULT: Fault = Fault {
    name: "reorder",
    layer: Layer::Telegram,
    parameters: &[Parameter {
        key: "by",
        form: Form::Whole(1, 1000),
        default: "1",
        about: "behind so many further telegrams",
    }],
    directions: &[Direction::ToClient],
    on_wires: true,
    about: "A telegram leaves behind the ones that follow it.",
    reports: "scans_late in `record --info`, up to 63 behind; a restart beyond",
    recovery: "next good telegram",
    make: Make::Bytes(|given| Ok(Action::Telegram(Box::new(Reorder { by: given.count("by", 1)? })))),
};

#[derive(Debug)]
struct Reorder {
    by: u32,
}

impl OnTelegram for Reorder {
    fn act(&self, work: &mut Work, _: &mut Stream) -> Result<(), Skipped> {
        work.behind += self.by;
        Ok(())
    }
}
