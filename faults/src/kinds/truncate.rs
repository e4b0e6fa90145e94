//! The end of a telegram lost.

use rowscan_protocol::random::Stream;

use crate::event::Direction;
use crate::fault::{Action, Fault, Layer, Make, OnTelegram, Skipped, Work};
use rowscan_settings::fault_table::{Form, Parameter};

pub(super) const FAULT: Fault = Fault {
    name: "truncate",
    layer: Layer::Telegram,
    parameters: &[
        Parameter {
            key: "bytes",
            form: Form::Whole(1, 1_000_000),
            default: "1",
            about: "cut off at the end",
        },
        Parameter {
            key: "keep",
            form: Form::Whole(0, 1_000_000),
            default: "all but `bytes`",
            about: "kept at the beginning",
        },
    ],
    directions: &[Direction::ToClient],
    on_wires: true,
    about: "The end of a telegram is lost.",
    reports: "telegrams_bad 1",
    recovery: "next telegram; the cut one's claim may swallow it",
    make: Make::Bytes(|given| {
        let (bytes, keep) = (given.size("bytes")?, given.size("keep")?);
        if bytes.is_some() && keep.is_some() {
            return Err(given.refuse("`bytes` and `keep` are two ways to say one thing; leave one out"));
        }
        Ok(Action::Telegram(Box::new(Truncate { bytes: bytes.unwrap_or(1), keep })))
    }),
};

#[derive(Debug)]
struct Truncate {
    bytes: usize,
    keep: Option<usize>,
}

impl OnTelegram for Truncate {
    fn act(&self, work: &mut Work, _: &mut Stream) -> Result<(), Skipped> {
        let len = work.bytes.len();
        work.bytes.truncate(self.keep.unwrap_or(len.saturating_sub(self.bytes)));
        Ok(())
    }
}
