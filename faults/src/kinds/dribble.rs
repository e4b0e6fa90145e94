//! A telegram a few bytes at a time.

use std::time::Duration;

use rowscan_protocol::random::Stream;

use crate::event::Direction;
use crate::fault::{Action, Fault, Layer, Make, OnTelegram, Skipped, Work};
use crate::kinds::gap::GAP_US;
use rowscan_settings::fault_table::{Form, Parameter};

pub(super) const FAULT: Fault = Fault {
    name: "dribble",
    layer: Layer::Telegram,
    parameters: &[
        Parameter { key: "bytes", form: Form::Whole(1, 100_000), default: "1", about: "at a time" },
        GAP_US,
    ],
    directions: &[Direction::ToClient],
    on_wires: true,
    about: "A telegram leaves a few bytes at a time.",
    reports: "nothing; counts unchanged",
    recovery: "no loss at all, byte-equal scans",
    make: Make::Bytes(|given| {
        let bytes = given.size("bytes")?.unwrap_or(1);
        Ok(Action::Telegram(Box::new(Dribble { bytes, gap: given.micros(GAP_US.key, 1000)? })))
    }),
};

#[derive(Debug)]
struct Dribble {
    bytes: usize,
    gap: Duration,
}

impl OnTelegram for Dribble {
    fn act(&self, work: &mut Work, _: &mut Stream) -> Result<(), Skipped> {
        let cuts = (self.bytes..work.bytes.len()).step_by(self.bytes);
        work.cuts.extend(cuts.map(|offset| (offset, self.gap)));
        Ok(())
    }
}
