//! A wrong length field.

use rowscan_protocol::random::Stream;

use crate::event::Direction;
use crate::fault::{Action, Fault, Layer, Make, OnTelegram, Skipped, Work};
use crate::telegram::Kind;
use rowscan_settings::fault_table::{Form, Parameter};

pub(super) const FAULT: Fault = Fault {
    name: "length",
    layer: Layer::Telegram,
    parameters: &[
        Parameter {
            key: "by",
            form: Form::Whole(-1_000_000, 1_000_000),
            default: "1",
            about: "added to the length field",
        },
        Parameter {
            key: "value",
            form: Form::Whole(0, 4_294_967_295),
            default: "its own, and `by`",
            about: "written in its place",
        },
    ],
    directions: &[Direction::ToClient],
    on_wires: true,
    about: "A telegram's length field is wrong. CoLa A has none: skipped there.",
    reports: "telegrams_bad 1",
    recovery: "next telegram; one that is claimed as payload may be found late",
    make: Make::Bytes(|given| {
        let (by, value) = (given.whole("by")?, given.whole("value")?);
        if by.is_some() && value.is_some() {
            return Err(given.refuse("`by` and `value` are two ways to say one thing; leave one out"));
        }
        Ok(Action::Telegram(Box::new(Length { by: by.unwrap_or(1), value })))
    }),
};

#[derive(Debug)]
struct Length {
    by: i64,
    value: Option<i64>,
}

impl OnTelegram for Length {
    fn act(&self, work: &mut Work, _: &mut Stream) -> Result<(), Skipped> {
        let Some(range) = work.regions.length.clone() else {
            return Err(Skipped(format!("{} has no length field", work.regions.kind.title())));
        };
        let little = work.regions.kind == Kind::Lms2xx;
        let Some(field) = work.bytes.get_mut(range) else { return Ok(()) };
        let digit = |sum: i64, byte: &u8| sum << 8 | i64::from(*byte);
        let found = if little { field.iter().rev().fold(0, digit) } else { field.iter().fold(0, digit) };
        let mut rest = self.value.unwrap_or(found.saturating_add(self.by));
        let mut write = |byte: &mut u8| {
            *byte = (rest & 0xFF) as u8;
            rest >>= 8;
        };
        if little {
            field.iter_mut().for_each(write)
        } else {
            field.iter_mut().rev().for_each(&mut write)
        }
        Ok(())
    }
}
