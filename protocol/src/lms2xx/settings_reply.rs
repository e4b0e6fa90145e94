//! Replies that describe a device and its settings.

use super::configuration::Configuration;
use super::device::{place, rate_of};
use super::telegram::{REPLY, command};
use super::values::{MeasuringMode, Values};
use super::words::word_at;
use super::{Rate, Variant};

/// One reply that describes the device or its settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SettingsReply<'a> {
    /// `BA`: name and variant, `;`, software; as sent, with the blanks behind it.
    Type(&'a str),
    /// `B1`.
    Status {
        /// How it is set.
        variant: Variant,
        /// The rate it runs at, where that is one of the known codes.
        rate: Option<Rate>,
        /// What its values mean.
        mode: MeasuringMode,
    },
    /// `BB`: how it is set from now on.
    Variant(Variant),
    /// `F4` or `F7`: its configuration block.
    Configuration(Configuration),
}

impl<'a> SettingsReply<'a> {
    /// Reads the body of a reply; `None` for every other reply.
    pub fn parse(body: &'a [u8]) -> Option<Self> {
        let (reply, data) = body.split_first()?;
        let variant = |at: usize| {
            Some(Variant { angle_deg: word_at(body, at)?, step_centideg: word_at(body, at + 2)? })
        };
        match reply.wrapping_sub(REPLY) {
            command::TYPE => {
                let (_status, text) = data.split_last()?;
                core::str::from_utf8(text).ok().map(Self::Type)
            }
            command::STATUS => {
                let rate = word_at(body, place::RATE).and_then(rate_of);
                let mode = MeasuringMode(*body.get(place::MEASURING_MODE)?);
                Some(Self::Status { variant: variant(place::ANGLE)?, rate, mode })
            }
            // Behind whether it was done.
            command::VARIANT => variant(2).map(Self::Variant),
            command::READ_CONFIGURATION => configuration(data),
            command::WRITE_CONFIGURATION => configuration(data.get(1..)?),
            _ => None,
        }
    }
}

/// The block, and the device's status behind it.
fn configuration(data: &[u8]) -> Option<SettingsReply<'static>> {
    let (block, _status) = data.split_last_chunk::<1>()?;
    Configuration::of(block).map(SettingsReply::Configuration)
}

/// True if a body from a device carries measured values.
pub fn has_values(body: &[u8]) -> bool {
    Values::default().decode_into(body).is_ok()
}
