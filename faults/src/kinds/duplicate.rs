//! A telegram that comes again.

use rowscan_protocol::random::Stream;

use crate::event::Direction;
use crate::fault::{Action, Fault, Layer, Make, OnTelegram, Skipped, Work};
use rowscan_settings::fault_table::{Form, Parameter};

pub(super) const FAULT: Fault = Fault {
    name: "duplicate",
    layer: Layer::Telegram,
    parameters: &[Parameter {
        key: "copies",
        form: Form::Whole(1, 1000),
        default: "1",
        about: "further copies, behind it",
    }],
    directions: &[Direction::ToClient],
    on_wires: true,
    about: "A telegram comes again.",
    reports: "scans_repeated",
    recovery: "next good telegram",
    make: Make::Bytes(|given| {
        Ok(Action::Telegram(Box::new(Duplicate { copies: given.count("copies", 1)? })))
    }),
};

#[derive(Debug)]
struct Duplicate {
    copies: u32,
}

impl OnTelegram for Duplicate {
    fn act(&self, work: &mut Work, _: &mut Stream) -> Result<(), Skipped> {
        work.copies += self.copies;
        Ok(())
    }
}
