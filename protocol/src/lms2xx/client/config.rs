//! How a device is to be set up, and what a client tells its caller.

use alloc::string::String;
use alloc::vec::Vec;
use core::time::Duration;

use crate::lms2xx::values::{MeasuringMode, Unit, ValuesError};
use crate::lms2xx::{Rate, Variant};

/// How a device is to be set up.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ClientConfig {
    /// The rate to stream at; the one it is found at where the device cannot, or the line does not carry it.
    pub rate: Rate,
    /// The rate the device answered at last, tried first.
    pub known: Option<Rate>,
    /// Angle and resolution; as the device has it where absent.
    pub variant: Option<Variant>,
    /// Unit of the values.
    pub unit: Unit,
    /// What their bits mean.
    pub measuring_mode: MeasuringMode,
    /// Have the device count mirror turns beside the values, so that lost telegrams show.
    pub real_time_index: bool,
    /// How long a reply may take, beside its transmission and that of what is on the line before it.
    pub reply_timeout: Duration,
    /// The same for a write of the configuration block: the device's EEPROM is slow.
    pub save_timeout: Duration,
    /// How long the device takes to change its rate.
    pub settle: Duration,
}

impl Default for ClientConfig {
    fn default() -> Self {
        Self {
            rate: Rate::R38400,
            known: None,
            variant: None,
            unit: Unit::Mm,
            measuring_mode: MeasuringMode::RANGE_32_M,
            real_time_index: true,
            reply_timeout: Duration::from_millis(300),
            save_timeout: Duration::from_secs(15),
            settle: Duration::from_millis(300),
        }
    }
}

/// Something to be sent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Transmit {
    /// One frame.
    Frame(Vec<u8>),
    /// Nothing to send: from here on the line runs at this rate.
    Rate(Rate),
}

/// What happened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// The device is set up and will send scans.
    Ready(DeviceInfo),
    /// A scan came: [`Client::scan`](super::Client::scan).
    Scan,
    /// The device refused something.
    Refused {
        /// What it was asked to do.
        what: &'static str,
        /// The start-up cannot go on without it: the client is done.
        fatal: bool,
    },
    /// No answer in time. The client is done.
    NoAnswer {
        /// What it was asked to do.
        what: &'static str,
    },
    /// A scan telegram in a good frame that makes no sense.
    Malformed {
        /// Why.
        reason: ValuesError,
    },
    /// The device has restarted, and must be set up again. The client is done.
    Restarted,
    /// The clean stop is done.
    Stopped,
}

/// What a device says of itself.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DeviceInfo {
    /// Name and variant.
    pub ident: String,
    /// Software version.
    pub software: String,
    /// The rate it streams at.
    pub rate: Rate,
}
