//! Bits inverted.

use rowscan_protocol::random::Stream;

use crate::event::Direction;
use crate::fault::{Action, Fault, Layer, Make, OnTelegram, Skipped, Work, below};
use rowscan_settings::fault_table::{Form, Parameter};

pub(super) const FAULT: Fault = Fault {
    name: "flip",
    layer: Layer::Telegram,
    parameters: &[
        Parameter {
            key: "bits",
            form: Form::Whole(1, 64),
            default: "1",
            about: "so many bits, of different bytes where they suffice",
        },
        Parameter {
            key: "offset",
            form: Form::Whole(0, 1_000_000),
            default: "random",
            about: "byte of the first one",
        },
        Parameter {
            key: "region",
            form: Form::Word(&["header", "length", "payload", "checksum"]),
            default: "anywhere",
            about: "where random ones are",
        },
    ],
    directions: &[Direction::ToClient],
    on_wires: true,
    about: "Bits of a telegram are inverted.",
    reports: "telegrams_bad 1; in CoLa A, which has no checksum, possibly a wrong value",
    recovery: "next telegram; no resync longer than 2 telegrams",
    make: Make::Bytes(|given| {
        let (bits, offset, region) = (given.size("bits")?, given.size("offset")?, given.word("region")?);
        if offset.is_some() && region.is_some() {
            return Err(given.refuse("`offset` and `region` are two ways to say one thing; leave one out"));
        }
        Ok(Action::Telegram(Box::new(Flip { bits: bits.unwrap_or(1), offset, region })))
    }),
};

#[derive(Debug)]
struct Flip {
    bits: usize,
    offset: Option<usize>,
    region: Option<&'static str>,
}

impl OnTelegram for Flip {
    fn act(&self, work: &mut Work, dice: &mut Stream) -> Result<(), Skipped> {
        let (len, regions) = (work.bytes.len(), &work.regions);
        let title = regions.kind.title();
        let range = match self.region {
            None => 0..len,
            Some("header") => regions.header.clone(),
            Some("payload") => regions.payload.clone(),
            Some("length") => {
                regions.length.clone().ok_or_else(|| Skipped(format!("{title} has no length field")))?
            }
            Some(_) => regions.checksum.clone().ok_or_else(|| Skipped(format!("{title} has no checksum")))?,
        };
        let first = self.offset.unwrap_or_else(|| range.start + below(dice, range.len()));
        if first >= len {
            return Err(Skipped(format!("offset {first} is beyond the telegram's {len} bytes")));
        }
        for n in 0..self.bits {
            // Different bytes first, in a row within the range; then further bits of them.
            let at = if self.offset.is_some() {
                (first + n) % len
            } else {
                range.start + (first - range.start + n) % range.len().max(1)
            };
            let bit = if n < range.len() { below(dice, 8) } else { n % 8 };
            work.bytes.iter_mut().skip(at).take(1).for_each(|byte| *byte ^= 1 << bit);
        }
        Ok(())
    }
}
