//! Telegrams in one piece.

use std::time::Duration;

use rowscan_protocol::random::Stream;

use crate::event::Direction;
use crate::fault::{Action, Fault, Layer, Make, OnTelegram, Skipped, Work};
use rowscan_settings::fault_table::{Form, Parameter};

pub(super) const FAULT: Fault = Fault {
    name: "coalesce",
    layer: Layer::Telegram,
    parameters: &[
        Parameter {
            key: "telegrams",
            form: Form::Whole(2, 10_000),
            default: "2",
            about: "so many telegrams in one piece",
        },
        Parameter {
            key: "wait_ms",
            form: Form::Whole(1, 600_000),
            default: "1000",
            about: "leave at the latest so long after the first, ms",
        },
    ],
    directions: &[Direction::ToClient],
    on_wires: true,
    about: "Telegrams wait for each other and leave in one piece.",
    reports: "nothing; counts unchanged",
    recovery: "no loss at all, byte-equal scans",
    make: Make::Bytes(|given| {
        let further = given.count("telegrams", 2)?.saturating_sub(1);
        let wait = Duration::from_millis(given.count("wait_ms", 1000)?.into());
        Ok(Action::Telegram(Box::new(Coalesce { further, wait })))
    }),
};

#[derive(Debug)]
struct Coalesce {
    further: u32,
    wait: Duration,
}

impl OnTelegram for Coalesce {
    fn act(&self, work: &mut Work, _: &mut Stream) -> Result<(), Skipped> {
        work.joined = Some((self.further, self.wait));
        Ok(())
    }
}
