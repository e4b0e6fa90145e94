//! A telegram in pieces.

use std::time::Duration;

use rowscan_protocol::random::Stream;

use crate::event::Direction;
use crate::fault::{Action, Fault, Layer, Make, OnTelegram, Skipped, Work};
use crate::kinds::gap::GAP_US;
use rowscan_settings::fault_table::{Form, Parameter};

pub(super) const FAULT: Fault = Fault {
    name: "split",
    layer: Layer::Telegram,
    parameters: &[
        Parameter {
            key: "offset",
            form: Form::Wholes(1, 1_000_000),
            default: "into equal pieces",
            about: "cut before this byte of the telegram, or before each of several",
        },
        Parameter {
            key: "pieces",
            form: Form::Whole(2, 1000),
            default: "2",
            about: "without `offset`: equal pieces",
        },
        GAP_US,
    ],
    directions: &[Direction::ToClient],
    on_wires: true,
    about: "A telegram leaves in pieces, a gap apart.",
    reports: "nothing; counts unchanged",
    recovery: "no loss at all, byte-equal scans",
    make: Make::Bytes(|given| {
        let (offsets, pieces) = (given.sizes("offset")?, given.size("pieces")?);
        if offsets.is_some() && pieces.is_some() {
            return Err(given.refuse("`offset` and `pieces` are two ways to say one thing; leave one out"));
        }
        let gap = given.micros(GAP_US.key, 1000)?;
        Ok(Action::Telegram(Box::new(Split { offsets, pieces: pieces.unwrap_or(2), gap })))
    }),
};

#[derive(Debug)]
struct Split {
    offsets: Option<Vec<usize>>,
    pieces: usize,
    gap: Duration,
}

impl OnTelegram for Split {
    fn act(&self, work: &mut Work, _: &mut Stream) -> Result<(), Skipped> {
        let len = work.bytes.len();
        let offsets = match &self.offsets {
            Some(offsets) => offsets.clone(),
            None => (1..self.pieces).map(|piece| piece * len / self.pieces).collect(),
        };
        if let Some(beyond) = offsets.iter().find(|offset| **offset >= len) {
            return Err(Skipped(format!("offset {beyond} is beyond the telegram's {len} bytes")));
        }
        work.cuts.extend(offsets.into_iter().map(|offset| (offset, self.gap)));
        Ok(())
    }
}
