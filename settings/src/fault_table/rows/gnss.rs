//! Faults of the GNSS receiver: what it reports is not where the tractor is.

use crate::fault_table::parameter::{Form, Parameter};
use crate::fault_table::part_fault::PartFault;
use crate::fault_table::row::{Family, Row};
use crate::fault_table::vehicle::GnssFault;

/// Seconds that GPS time is ahead of UTC since 2017: what a receiver is off by that has not heard of them yet.
const LEAP_S: f64 = 18.0;

/// What is reported is not where the tractor is.
pub(super) const ROW: Row = Row {
    name: "gnss",
    family: Family::Vehicle,
    parameters: &[
        Parameter::new("lost", Form::Flag, "false", "no position"),
        Parameter::new("float", Form::Flag, "false", "RTK float: 0.3 m of noise"),
        Parameter::new("stale", Form::Flag, "false", "the last fix comes again and again, with its time"),
        Parameter::new(
            "bad_checksum",
            Form::Flag,
            "false",
            "NMEA sentences have wrong checksums; on the bus there are none",
        ),
        Parameter::new("jump_m", Form::Number(-1e6, 1e6), "0", "the position is off by so many metres"),
        Parameter::new(
            "jump_deg",
            Form::Number(-360.0, 360.0),
            "0",
            "into this direction, degrees clockwise from north",
        ),
        Parameter::new(
            "lever_arm_m",
            Form::Pair(-20.0, 20.0),
            "[0, 0]",
            "the antenna is so much farther ahead and right than is reckoned with, metres",
        ),
        Parameter::new(
            "leap",
            Form::Flag,
            "false",
            "time is 18 s ahead: the receiver does not know the leap seconds yet",
        ),
    ],
    about: "What the receiver reports, in sentences and on the bus, is not where the tractor is. The tractor and its scanners go on as they do.",
    reports: "fix quality, speed_held",
    recovery: "≤ 2 s after fix",
    make: |settings| {
        let fault = GnssFault {
            lost: settings.flag("lost")?,
            float: settings.flag("float")?,
            stale: settings.flag("stale")?,
            bad_checksum: settings.flag("bad_checksum")?,
            jump_m: settings.number("jump_m")?.unwrap_or(0.0),
            jump_deg: settings.number("jump_deg")?.unwrap_or(0.0),
            lever_arm_m: settings.pair("lever_arm_m")?.unwrap_or((0.0, 0.0)),
            time_s: if settings.flag("leap")? { LEAP_S } else { 0.0 },
        };
        if (GnssFault { jump_deg: 0.0, ..fault }) == GnssFault::default() {
            return Err(settings.refuse("expected one of `lost`, `float`, `stale`, `bad_checksum`, `jump_m`, `lever_arm_m`, `leap`: without any nothing would happen"));
        }
        Ok(PartFault::Gnss(fault))
    },
};
