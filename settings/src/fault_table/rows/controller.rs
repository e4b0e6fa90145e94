//! Faults of CAN controllers and of the wire.

use std::time::Duration;

use crate::fault_table::bus::BusFault;
use crate::fault_table::parameter::{Form, Parameter};
use crate::fault_table::part_fault::PartFault;
use crate::fault_table::row::{Family, Row};

/// Rules of the wire, and data[2] of an error frame (Linux, `can/error.h`).
const RULES: &[(&str, u8)] =
    &[("bit", 0x01), ("form", 0x02), ("stuff", 0x04), ("overload", 0x20), ("active", 0x40)];
const RULE_NAMES: &[&str] = &["bit", "form", "stuff", "overload", "active"];

/// Bus-off.
pub(super) const OFF: Row = Row {
    name: "bus_off",
    family: Family::Bus,
    parameters: &[Parameter::new(
        "restart_ms",
        Form::Number(1.0, 3.6e6),
        "at the fault's end",
        "controllers come back by themselves after so long, ms",
    )],
    about: "The controllers are bus-off: nothing passes, either way. Where the port carries error frames it tells so, and that they are back.",
    reports: "link down with reason",
    recovery: "re-open, re-claim, first frame",
    make: |settings| {
        let restart = settings.number("restart_ms")?.map(|ms| Duration::from_secs_f64(ms / 1000.0));
        Ok(PartFault::Bus(BusFault::Off { restart }))
    },
};

/// Error passive.
pub(super) const PASSIVE: Row = Row {
    name: "bus_passive",
    family: Family::Bus,
    parameters: &[
        Parameter::new("tx_errors", Form::Whole(0, 255), "128", "transmit error counter"),
        Parameter::new("rx_errors", Form::Whole(0, 255), "0", "receive error counter"),
    ],
    about: "The controllers are error passive: frames pass. Told where the port carries error frames.",
    reports: "link state",
    recovery: "none needed",
    make: |settings| {
        let counter = |key, default: u8| {
            Ok(settings.whole(key)?.and_then(|count| u8::try_from(count).ok()).unwrap_or(default))
        };
        Ok(PartFault::Bus(BusFault::Passive {
            counters: (counter("tx_errors", 128)?, counter("rx_errors", 0)?),
        }))
    },
};

/// A full bus.
pub(super) const LOAD: Row = Row {
    name: "bus_load",
    family: Family::Bus,
    parameters: &[Parameter::new(
        "percent",
        Form::Number(0.1, 100.0),
        "must be given",
        "share of the bus's time at 250 kbit/s, %",
    )],
    about: "Somebody else's frames of lowest priority fill the bus.",
    reports: "nothing",
    recovery: "no frame of ours is lost below 100 %",
    make: |settings| Ok(PartFault::Bus(BusFault::Load { share: settings.needed("percent")? / 100.0 })),
};

/// Errors on the wire.
pub(super) const ERROR: Row = Row {
    name: "bus_error",
    family: Family::Bus,
    parameters: &[
        Parameter::new("rule", Form::Word(RULE_NAMES), "stuff", "the rule of the wire that is broken"),
        Parameter::new("per_s", Form::Number(0.1, 1000.0), "10", "error frames a second"),
    ],
    about: "Frames are destroyed on the wire and sent again. Told where the port carries error frames; elsewhere nobody notices.",
    reports: "bus errors",
    recovery: "none needed",
    make: |settings| {
        let rule = settings.word("rule")?.unwrap_or("stuff");
        let code = RULES.iter().find(|(name, _)| *name == rule).map_or(0, |(_, code)| *code);
        let per_s = settings.number("per_s")?.unwrap_or(10.0);
        Ok(PartFault::Bus(BusFault::Error { code, per_s }))
    },
};

/// No acknowledgement.
pub(super) const ACK_NONE: Row = Row {
    name: "ack_none",
    family: Family::Bus,
    parameters: &[],
    about: "Nobody acknowledges what the tractor sends: it is alone on its bus, and nothing of it is heard. Told where the port carries error frames.",
    reports: "no frames, link down with reason",
    recovery: "first frame",
    make: |_| Ok(PartFault::Bus(BusFault::AckNone)),
};
