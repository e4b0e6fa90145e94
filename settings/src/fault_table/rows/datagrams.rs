//! Datagrams that do not arrive, arrive twice, late or in another order.

use std::time::Duration;

use crate::fault_table::datagrams::{DatagramFault, Fate};
use crate::fault_table::parameter::{Form, Parameter};
use crate::fault_table::part_fault::PartFault;
use crate::fault_table::row::{Family, Row};
use crate::fault_table::settings::Settings;

const PARAMETERS: &[Parameter] = &[
    Parameter::new(
        "pb",
        Form::Number(0.0, 1.0),
        "no bursts",
        "probability that a burst begins with a datagram; with `pg`",
    ),
    Parameter::new(
        "pg",
        Form::Number(0.0, 1.0),
        "no bursts",
        "probability that a burst ends with a datagram; in a burst `p` holds, outside nothing happens",
    ),
];

fn datagrams(settings: &Settings<'_>, fate: Fate) -> Result<PartFault, crate::TomlError> {
    let bursts = match (settings.number("pb")?, settings.number("pg")?) {
        (Some(begins), Some(ends)) => Some((begins, ends)),
        (None, None) => None,
        _ => return Err(settings.refuse("`pb` and `pg` go together: when bursts begin, and when they end")),
    };
    Ok(PartFault::Datagrams(DatagramFault { fate, bursts }))
}

/// Lost.
pub(super) const UDP_LOSS: Row = Row {
    name: "udp_loss",
    family: Family::Datagrams,
    parameters: PARAMETERS,
    about: "Datagrams of Compact telegrams, NMEA sentences or CAN frames are lost, each with probability `p`, or in bursts.",
    reports: "segments_lost, frames lost",
    recovery: "next frame",
    make: |settings| datagrams(settings, Fate::Lost),
};

/// Twice.
pub(super) const UDP_DUP: Row = Row {
    name: "udp_dup",
    family: Family::Datagrams,
    parameters: PARAMETERS,
    about: "Datagrams of Compact telegrams, NMEA sentences or CAN frames come twice, each with probability `p`, or in bursts.",
    reports: "nothing",
    recovery: "next frame",
    make: |settings| datagrams(settings, Fate::Doubled),
};

/// Late.
pub(super) const UDP_LATE: Row = Row {
    name: "udp_late",
    family: Family::Datagrams,
    parameters: &[Parameter::new("ms", Form::Number(0.1, 60_000.0), "50", "so much later, milliseconds")],
    about: "Datagrams of Compact telegrams come late, each with probability `p`: behind those that are sent meanwhile.",
    reports: "segments_lost where more than four telegrams of later turns overtake one",
    recovery: "next turn",
    make: |settings| {
        let late = Duration::from_secs_f64(settings.number("ms")?.unwrap_or(50.0) / 1e3);
        Ok(PartFault::Datagrams(DatagramFault { fate: Fate::Late(late), bursts: None }))
    },
};

/// In another order.
pub(super) const UDP_REORDER: Row = Row {
    name: "udp_reorder",
    family: Family::Datagrams,
    parameters: &[Parameter::new(
        "behind",
        Form::Whole(1, 100),
        "1",
        "so many that are sent after it come before it",
    )],
    about: "Datagrams of Compact telegrams are overtaken by those behind them, each with probability `p`.",
    reports: "nothing up to four; segments_lost beyond",
    recovery: "next turn",
    make: |settings| {
        let behind = settings.whole("behind")?.and_then(|behind| u32::try_from(behind).ok()).unwrap_or(1);
        Ok(PartFault::Datagrams(DatagramFault { fate: Fate::Overtaken(behind), bursts: None }))
    },
};

/// A part of it is lost.
pub(super) const UDP_FRAGMENT: Row = Row {
    name: "udp_fragment",
    family: Family::Datagrams,
    parameters: &[Parameter::new(
        "mtu",
        Form::Whole(576, 9000),
        "1500",
        "bytes that a packet of the network holds, with its headers",
    )],
    about: "A fragment of a datagram is lost, each with probability `p`, and with it the datagram; those that fit one packet arrive. Telegrams of picoScan profiles 3, 6 and 9 need several, those of a multiScan136 ten.",
    reports: "segments_lost",
    recovery: "next turn",
    make: |settings| {
        let mtu = settings.whole("mtu")?.and_then(|mtu| u32::try_from(mtu).ok()).unwrap_or(1500);
        Ok(PartFault::Datagrams(DatagramFault { fate: Fate::InFragments { mtu }, bursts: None }))
    },
};
