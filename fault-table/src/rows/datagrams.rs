//! Datagrams that do not arrive, or arrive twice.

use crate::datagrams::{DatagramFault, Fate};
use crate::parameter::{Form, Parameter};
use crate::part_fault::PartFault;
use crate::row::{Family, Row};
use crate::settings::Settings;

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

fn datagrams(settings: &Settings<'_>, fate: Fate) -> Result<PartFault, rowscan_strict_toml::TomlError> {
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
    about: "Datagrams of NMEA sentences or CAN frames are lost, each with probability `p`, or in bursts.",
    reports: "frames lost",
    recovery: "next frame",
    make: |settings| datagrams(settings, Fate::Lost),
};

/// Twice.
pub(super) const UDP_DUP: Row = Row {
    name: "udp_dup",
    family: Family::Datagrams,
    parameters: PARAMETERS,
    about: "Datagrams of NMEA sentences or CAN frames come twice, each with probability `p`, or in bursts.",
    reports: "nothing",
    recovery: "next frame",
    make: |settings| datagrams(settings, Fate::Doubled),
};
